// SPDX-License-Identifier: Apache-2.0
// How publishers of records and simulations keep from outrunning their consumers: credit, not
// guesswork. Each consumer that must not lose a sample publishes how far it is (replay_progress,
// best effort, the newest repeated); a publisher stays within a window of the slowest. A consumer
// that left (dds::Departure::kLeft) is no longer waited for; one that only says nothing is: what
// was sent meanwhile would be lost to it. Those that are named are waited for from the first sample
// on; a recorder, say, that comes later is kept pace with from its first report on. Of several
// processes with one name (redundant instances) the furthest is waited for in this way, and the
// others like the recorder: none loses a sample while it gets on, and none that died is waited for
// as long as one that nobody replaces. What was sent before one that is named was connected comes
// neither to it nor to anybody behind it, the monitor behind the compensation, say: nobody is
// waited for with it.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "common/core/time.h"
#include "common/dds/participant.h"
#include "common/service/replay_credit.h"

namespace zerodrift::service {

// For those who wait: how often they look whether to stop.
inline constexpr std::chrono::milliseconds kStopCheck{100};

class ReplayPacer {
 public:
  // Waits for the consumers named in `wait_for`, e.g. {"compensation", "allan_monitor"}; none:
  // nobody is waited for.
  ReplayPacer(dds::Participant& participant, std::uint32_t gyro_id,
              std::vector<std::string> wait_for);

  // A reader of the rates was met. Any thread.
  void note_reader(const eprosima::fastrtps::rtps::GUID_t& reader);

  // All waits return false when `at_most` has passed first.
  bool wait_for_consumers(std::chrono::milliseconds at_most);
  // Until all consumers are within the window of the newest sample sent, the replay's first being
  // `first_sequence`; true also says that the caller sends `sequence` now. A jump in the sequence
  // numbers waits for nobody.
  bool wait_for_room(std::uint64_t sequence, std::uint64_t first_sequence,
                     std::chrono::milliseconds at_most);
  // As of the ReplayCredit.
  [[nodiscard]] std::string let_unconnected_join(std::uint64_t first_sequence);
  [[nodiscard]] std::string leave_behind(std::uint64_t first_sequence);
  // Until all consumers have taken `sequence`.
  bool wait_for_all(std::uint64_t sequence, std::uint64_t first_sequence,
                    std::chrono::milliseconds at_most);
  // Until somebody needs temperatures up to `time`.
  bool wait_until_needed(core::SensorTime time, std::chrono::milliseconds at_most);

  [[nodiscard]] bool anybody_to_wait_for() const noexcept { return credit_.anybody_to_wait_for(); }
  // Names of the consumers that have not announced themselves, comma-separated.
  [[nodiscard]] std::string missing_consumers();

 private:
  void note(const msg::ReplayProgress& progress, const dds::SampleOrigin& origin);
  // What `action` answers; whoever waits looks again.
  template <typename Action>
  auto change(Action action) {
    const std::lock_guard lock(mutex_);
    changed_.notify_all();
    return action();
  }
  template <typename Condition>
  bool wait(std::chrono::milliseconds at_most, Condition condition) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, at_most, condition);
  }

  std::uint32_t gyro_id_;
  std::mutex mutex_;
  std::condition_variable changed_;
  ReplayCredit credit_;
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
