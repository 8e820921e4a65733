// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/reading_steps.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace zerodrift::diagnosis {
namespace {

constexpr double kMostDigits = 1e12;
// Of a reading: what its conversion into SI and back leaves, with a margin of ten.
constexpr double kConversion = 1e-14;
constexpr std::uint32_t kReadingsForDivisor = 20;

double power_of_ten(int exponent) {
  return std::pow(10.0, exponent);
}

}  // namespace

std::size_t ReadingSteps::decade_of(double in_units) {
  const double exponent = std::floor(std::log10(in_units));
  return static_cast<std::size_t>(
      std::clamp(exponent - kLowest, 0.0, static_cast<double>(kDecades - 1)));
}

void ReadingSteps::add(double value) {
  const double size = std::abs(value / unit_);
  if (!std::isfinite(size) || size == 0.0) return;
  Decade& decade = decades_[decade_of(size)];
  if (!decade.has_step || size == decade.last) return;
  decade.last = size;
  ++decade.readings;
  double steps = size * power_of_ten(decade.decimals);
  while (std::abs(steps - std::round(steps)) > kConversion * steps) {
    ++decade.decimals;
    decade.divisor *= 10;
    steps = size * power_of_ten(decade.decimals);
    if (!(steps < kMostDigits)) {
      decade.has_step = false;
      return;
    }
  }
  decade.divisor = std::gcd(decade.divisor, static_cast<std::int64_t>(std::round(steps)));
}

// A smaller reading is never given in larger steps: a few that end in zeros by chance don't count.
// Readings of other sizes and the same decimals are of the same steps.
double ReadingSteps::step_at(double value) const {
  const double size = std::abs(value / unit_);
  if (!std::isfinite(size) || size == 0.0) return 0.0;
  const Decade& own = decades_[decade_of(size)];
  if (own.readings == 0 || !own.has_step) return 0.0;
  const double step = unit_ * power_of_ten(-own.decimals);
  std::uint32_t readings = 0;
  std::int64_t divisor = 0;
  for (const Decade& decade : decades_) {
    if (decade.readings == 0) continue;
    const bool is_larger = &decade > &own;
    if (is_larger && !decade.has_step) return 0.0;
    if (is_larger && decade.decimals > own.decimals) return unit_ * power_of_ten(-decade.decimals);
    if (!decade.has_step || decade.decimals != own.decimals) continue;
    readings += decade.readings;
    divisor = std::gcd(divisor, decade.divisor);
  }
  return readings >= kReadingsForDivisor ? step * static_cast<double>(divisor) : step;
}

}  // namespace zerodrift::diagnosis
