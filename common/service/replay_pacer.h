// SPDX-License-Identifier: Apache-2.0
// How publishers of records and simulations keep from outrunning their consumers: credit, not
// guesswork. Each consumer that must not lose a sample publishes how far it is (replay_progress,
// best effort, the newest repeated); a publisher stays within a window of the slowest. A consumer
// that left (dds::Departure::kLeft) is no longer waited for; one that only says nothing is: what
// was sent meanwhile would be lost to it. Those that are named are waited for from the first sample
// on; a recorder, say, that comes later is kept pace with from its first report on. Of several
// processes with one name (redundant instances) the furthest is waited for in this way, and the
// others like the recorder: none loses a sample while it gets on, and none that died is waited for
// as long as one that nobody replaces.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "common/core/time.h"
#include "common/dds/participant.h"

namespace zerodrift::service {

class ReplayPacer {
 public:
  // Sequence numbers ahead of the slowest consumer: far below the history kept, so that nothing can
  // be overwritten.
  static constexpr std::uint64_t kWindow = 256;

  // Waits for the consumers named in `wait_for`, e.g. {"compensation", "allan_monitor"}; none:
  // nobody is waited for.
  ReplayPacer(dds::Participant& participant, std::uint32_t gyro_id,
              std::vector<std::string> wait_for);

  // All waits return false when `at_most` has passed first.
  bool wait_for_consumers(std::chrono::milliseconds at_most);
  // Until all consumers are within the window of the newest sample sent, the replay's first being
  // `first_sequence`; true also says that the caller sends `sequence` now. A jump in the sequence
  // numbers waits for nobody.
  bool wait_for_room(std::uint64_t sequence, std::uint64_t first_sequence,
                     std::chrono::milliseconds at_most);
  // Consumers that have taken nothing although another took all that was sent: what was sent before
  // they were connected (behind the compensation, say) never comes to them. From now on they stand
  // where the replay is. Their names, comma-separated; "" where nobody took all, or all took
  // something.
  [[nodiscard]] std::string let_unconnected_join(std::uint64_t first_sequence);
  // Consumers that others can do without, not named or not the furthest of their name, and that
  // have not taken all that was sent: they are no longer waited for until they get on. Their names,
  // comma-separated.
  [[nodiscard]] std::string leave_behind(std::uint64_t first_sequence);
  // Until all consumers have taken `sequence`.
  bool wait_for_all(std::uint64_t sequence, std::uint64_t first_sequence,
                    std::chrono::milliseconds at_most);
  // Until somebody needs temperatures up to `time`.
  bool wait_until_needed(core::SensorTime time, std::chrono::milliseconds at_most);

  [[nodiscard]] bool anybody_to_wait_for() const noexcept { return !wait_for_.empty(); }
  // Names of the consumers that have not announced themselves, comma-separated.
  [[nodiscard]] std::string missing_consumers();

 private:
  // A process that announced itself, and what it took of this gyro.
  struct Consumer {
    std::string name;
    eprosima::fastrtps::rtps::GUID_t writer;
    std::optional<std::uint64_t>
        joined_after;  // newest sample sent before it was known; none: from the first
    std::optional<std::uint64_t> taken;  // newest sequence
    core::SensorTime needed{core::kNever};
    bool is_left_behind = false;
  };
  void note(const msg::ReplayProgress& progress, const dds::SampleOrigin& origin);
  void forget(const eprosima::fastrtps::rtps::GUID_t& writer);
  [[nodiscard]] bool has_announced(const std::string& name) const;
  [[nodiscard]] bool all_announced() const;
  [[nodiscard]] bool is_named(const Consumer& consumer) const;
  // It is not left behind, and is named or has said of this replay how far it is.
  [[nodiscard]] bool keeps_up(const Consumer& consumer, std::uint64_t first_sequence) const;
  // Sequence numbers up to `newest` that the furthest consumer of this name has not taken; none:
  // nobody has the name.
  [[nodiscard]] std::optional<std::uint64_t> least_backlog(const std::string& name,
                                                           std::uint64_t newest,
                                                           std::uint64_t first_sequence) const;
  // Sequence numbers up to `newest` that the slowest consumer has not taken.
  [[nodiscard]] std::uint64_t backlog(std::uint64_t newest, std::uint64_t first_sequence) const;
  [[nodiscard]] std::uint64_t backlog(const Consumer& consumer, std::uint64_t newest,
                                      std::uint64_t first_sequence) const;
  bool wait(std::chrono::milliseconds at_most, const std::function<bool()>& condition);

  std::uint32_t gyro_id_;
  std::vector<std::string> wait_for_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<Consumer> consumers_;
  std::optional<std::uint64_t> newest_sent_;
  dds::Reader<msg::ReplayProgress> reader_;
};

// The consumer's side. Says four times a second, on a thread of its own, that there is a consumer:
// for publishers that come later, and so that a consumer that is busy for longer than the topic's
// lease (a learner that chooses its kernel, a report of many gyros) isn't reported as silent.
// Whether a consumer gets on, its progress says. Any thread.
class ReplayProgressReporter {
 public:
  ReplayProgressReporter(dds::Participant& participant, std::string consumer);
  // Says instead that this is the publisher of a gyro's temperatures, and which probes it has.
  // Throws std::invalid_argument where their names don't fit into the message.
  ReplayProgressReporter(dds::Participant& participant, std::uint32_t gyro_id,
                         const std::vector<std::string>& probes);
  ~ReplayProgressReporter();
  ReplayProgressReporter(const ReplayProgressReporter&) = delete;
  ReplayProgressReporter& operator=(const ReplayProgressReporter&) = delete;

  // Beside what the thread says, at once.
  void announce();
  void report(std::uint32_t gyro_id, std::uint64_t sequence, core::SensorTime needed);

 private:
  ReplayProgressReporter(dds::Participant& participant, msg::ReplayProgress announcement);
  void announce_until_closed();
  void write(msg::ReplayProgress& progress);

  msg::ReplayProgress announcement_;
  dds::Writer<msg::ReplayProgress> writer_;
  std::mutex mutex_;  // of the writer; held for a write
  std::mutex closing_mutex_;
  std::condition_variable closing_;
  bool closed_ = false;
  std::thread announcer_;
};

}  // namespace zerodrift::service
