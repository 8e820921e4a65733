// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace zerodrift::service {

// How far a consumer has taken one gyro's samples, and when a replay is notified
// (ReplayProgressReporter): a replay waits for each of its consumers, whether they have a use for
// the gyro or not. One thread at a time.
class ConsumerPace {
 public:
  // A sample was taken. A late one is older than what was taken before. True: a report is due.
  [[nodiscard]] bool take(std::uint64_t sequence, bool is_paced, bool is_late) noexcept {
    is_waited_for_ = is_paced;
    if (!is_paced || is_late) return false;
    newest_sequence_ = sequence;
    return ++since_report_ >= kSamplesPerReport;
  }
  void note_report() noexcept { since_report_ = 0; }

  // The newest sample is of a replay or simulation, which waits.
  [[nodiscard]] bool is_waited_for() const noexcept { return is_waited_for_; }
  [[nodiscard]] std::uint64_t newest_sequence() const noexcept { return newest_sequence_; }

 private:
  static constexpr std::uint64_t kSamplesPerReport = 32;

  std::uint64_t newest_sequence_ = 0;
  std::uint64_t since_report_ = 0;
  bool is_waited_for_ = false;
};

}  // namespace zerodrift::service
