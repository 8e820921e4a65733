// SPDX-License-Identifier: Apache-2.0
#include "common/allan/sample_clock.h"

#include <algorithm>
#include <cmath>

#include "common/core/median.h"
#include "common/core/require.h"

namespace zerodrift::allan {
namespace {

constexpr double kLongestRegularStep = 1.5;  // periods
constexpr double kPeriodTolerance = 0.15;    // of the nominal period
constexpr std::size_t kBlock = 256;
constexpr std::size_t kLastSteps = 32;
constexpr std::size_t kFewestSteps = 8;  // to speak of a period
constexpr double kMostMissing = 0x1.0p62;

bool is_nearer(double step_s, double to_s, double than_s) {
  return std::abs(step_s - to_s) < std::abs(step_s - than_s);
}

// How many of the steps come before the change: the split that puts the fewest on the wrong side.
std::size_t split_of(const std::vector<double>& steps_s, double before_s, double after_s) {
  std::ptrdiff_t wrong = 0;
  std::ptrdiff_t fewest = 0;
  std::size_t split = 0;
  for (std::size_t i = 0; i < steps_s.size(); ++i) {
    wrong += is_nearer(steps_s[i], after_s, before_s) ? 1 : -1;
    if (wrong >= fewest) continue;
    fewest = wrong;
    split = i + 1;
  }
  return split;
}

}  // namespace

std::uint64_t missing_between(double step_s, double period_s) noexcept {
  if (!(step_s > kLongestRegularStep * period_s)) return 0;
  return static_cast<std::uint64_t>(std::min(std::round(step_s / period_s), kMostMissing)) - 1;
}

SampleClock::SampleClock(double nominal_period_s) : nominal_s_(nominal_period_s) {
  core::require(nominal_period_s > 0.0, "a sample clock has a period above 0");
  recent_s_.reserve(2 * kBlock);
}

std::uint64_t SampleClock::add(double step_s) {
  ++steps_;
  recent_s_.push_back(step_s);
  if (steps_ % kBlock == 0) {
    look_for_change(kBlock);
    if (recent_s_.size() > kBlock)
      recent_s_.erase(recent_s_.begin(), recent_s_.begin() + static_cast<std::ptrdiff_t>(kBlock));
  }
  if (!(step_s > kLongestRegularStep * nominal_s_)) {
    regular_s_ += step_s;
    ++regular_;
    return 0;
  }
  ++gaps_;
  longest_gap_s_ = std::max(longest_gap_s_, step_s);
  const std::uint64_t missing = missing_between(step_s, nominal_s_);
  missing_ += missing;
  return missing;
}

void SampleClock::finish() {
  const std::size_t newest = std::min(kLastSteps, recent_s_.size());
  if (newest >= kFewestSteps) look_for_change(newest);
}

void SampleClock::look_for_change(std::size_t newest_steps) {
  if (change_) return;
  const double median_s = core::median_of(
      {recent_s_.end() - static_cast<std::ptrdiff_t>(newest_steps), recent_s_.end()});
  if (std::abs(median_s - nominal_s_) <= kPeriodTolerance * nominal_s_) return;
  const std::uint64_t first_step = steps_ - recent_s_.size();
  // Step i leads to sample i + 1.
  change_ = PeriodChange{.sample = first_step + split_of(recent_s_, nominal_s_, median_s) + 1,
                         .before_s = nominal_s_,
                         .after_s = median_s};
}

double SampleClock::period_s() const noexcept {
  return regular_ == 0 ? nominal_s_ : regular_s_ / static_cast<double>(regular_);
}

}  // namespace zerodrift::allan
