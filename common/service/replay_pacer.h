// SPDX-License-Identifier: Apache-2.0
// How publishers of records and simulations keep from outrunning their consumers: credit, not
// guesswork. Each consumer that must not lose a sample publishes how far it is (replay_progress,
// best effort, the newest repeated); a publisher stays within a window of the slowest. A consumer
// that is gone, or that said nothing for the topic's lease, is no longer waited for; one that is
// heard again stands where the replay is then.
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
        joined_after;  // newest sample sent before it was heard of; none: from the first
    std::optional<std::uint64_t> taken;  // newest sequence
    core::SensorTime needed{core::kNever};
  };
  void note(const msg::ReplayProgress& progress, const dds::SampleOrigin& origin);
  void forget(const eprosima::fastrtps::rtps::GUID_t& writer);
  [[nodiscard]] bool has_announced(const std::string& name) const;
  [[nodiscard]] bool all_announced() const;
  // Sequence numbers up to `newest` that the slowest consumer has not taken; of several with one
  // name the furthest counts.
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
// lease (a learner that chooses its kernel, a report of many gyros) isn't taken for gone. Whether a
// consumer gets on, its progress says. Any thread.
class ReplayProgressReporter {
 public:
  ReplayProgressReporter(dds::Participant& participant, std::string consumer);
  ~ReplayProgressReporter();
  ReplayProgressReporter(const ReplayProgressReporter&) = delete;
  ReplayProgressReporter& operator=(const ReplayProgressReporter&) = delete;

  // Beside what the thread says, at once.
  void announce();
  void report(std::uint32_t gyro_id, std::uint64_t sequence, core::SensorTime needed);

 private:
  void announce_until_closed();

  std::string consumer_;
  dds::Writer<msg::ReplayProgress> writer_;
  std::mutex mutex_;  // of the writer; held for a write
  std::mutex closing_mutex_;
  std::condition_variable closing_;
  bool closed_ = false;
  std::thread announcer_;
};

}  // namespace zerodrift::service
