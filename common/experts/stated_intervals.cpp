// SPDX-License-Identifier: Apache-2.0
#include "common/experts/stated_intervals.h"

#include <algorithm>
#include <cmath>

namespace zerodrift::experts {
namespace {

constexpr double kSteady = 2.0;            // power of the age, of a variance
constexpr double kSmallestWidth = 1e-100;  // a number to take the logarithm of

// The power of the age by which something grows from one age to another.
double power(double grew, const JudgedWidth& from, const JudgedWidth& to) {
  return std::log(grew) / std::log(to.age_s / from.age_s);
}

}  // namespace

// The variance of the drift, where a label's error has this half width.
double StatedIntervals::of_drift(double half_width) const noexcept {
  const double width = half_width / kNormalQuantile;
  return std::max(width * width - label_variance, level_variance);
}

double StatedIntervals::no_less_than_known(double half_width) const noexcept {
  return std::max({half_width, kNormalQuantile * std::sqrt(level_variance), kSmallestWidth});
}

double StatedIntervals::variance_at(double age_s) const noexcept {
  const JudgedWidth* before = nullptr;
  const JudgedWidth* last = nullptr;
  for (const JudgedWidth& one : judged) {
    if (one.half_width < 0.0) continue;
    before = last;
    last = &one;
    if (age_s <= one.age_s) break;
  }
  if (last == nullptr) return -1.0;
  const double ratio = age_s / last->age_s;
  if (ratio <= 1.0) {
    if (before == nullptr) return of_drift(last->half_width);
    const double grown = no_less_than_known(last->half_width);
    const double grew = grown / no_less_than_known(before->half_width);
    return of_drift(grown * std::pow(ratio, power(grew, *before, *last)));
  }
  const double oldest = of_drift(last->half_width);
  if (last != &judged.back() || before == nullptr || before->age_s >= last->age_s)
    return of_drift(last->half_width * ratio);
  const double grew = oldest / of_drift(before->half_width);
  return oldest * std::pow(ratio, std::clamp(power(grew, *before, *last), 0.0, kSteady));
}

double StatedIntervals::half_width_at(double age_s) const noexcept {
  const double variance = variance_at(age_s);
  return variance < 0.0 ? -1.0 : kNormalQuantile * std::sqrt(variance + label_variance);
}

}  // namespace zerodrift::experts
