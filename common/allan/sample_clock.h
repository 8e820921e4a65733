// SPDX-License-Identifier: Apache-2.0
// What the time stamps of a record say: its sample period, where samples are missing, and whether
// the period changes on the way.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

namespace zerodrift::allan {

// The period of a record changes for good.
struct PeriodChange {
  std::uint64_t sample = 0;  // the first that comes at the new period, counted from 0
  double before_s = 0.0;
  double after_s = 0.0;
};

// How many samples are missing between two that are `step_s` apart: a step of more than 1.5 periods
// is a gap.
[[nodiscard]] std::uint64_t missing_between(double step_s, double period_s) noexcept;

class SampleClock {
 public:
  explicit SampleClock(double nominal_period_s);

  // Time from the sample before to this one. Answers how many samples are missing between them, by
  // the nominal period. O(1) amortised.
  std::uint64_t add(double step_s);

  // A median of 256 steps, or of the last 32 at the end of the record, that is off the nominal
  // period by more than 15 %: jitter and drops don't do that. The first change stays.
  [[nodiscard]] std::optional<PeriodChange> period_change() const { return change_; }
  // To be called at the end of the record: looks at the steps not yet looked at.
  void finish();

  // Mean of the steps that are not gaps: what jitter of single stamps leaves of the period. The
  // nominal one before the first step.
  [[nodiscard]] double period_s() const noexcept;
  [[nodiscard]] std::uint64_t gaps() const noexcept { return gaps_; }
  [[nodiscard]] std::uint64_t missing() const noexcept { return missing_; }  // over all gaps
  [[nodiscard]] double longest_gap_s() const noexcept { return longest_gap_s_; }

 private:
  void look_for_change(std::size_t newest_steps);

  double nominal_s_;
  double regular_s_ = 0.0;  // sum of the steps that are not gaps
  std::uint64_t regular_ = 0;
  std::uint64_t steps_ = 0;
  std::uint64_t gaps_ = 0;
  std::uint64_t missing_ = 0;
  double longest_gap_s_ = 0.0;
  std::vector<double> recent_s_;  // the last one to two blocks of steps
  std::optional<PeriodChange> change_;
};

}  // namespace zerodrift::allan
