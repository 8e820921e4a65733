// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/reading_steps.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace zerodrift::diagnosis {
namespace {

constexpr double kMostDigits = 1e12;
// Of a step: what is left of a reading's conversion into the unit it was written in.
constexpr double kTolerance = 1e-3;
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
  while (std::abs(steps - std::round(steps)) > kTolerance || std::round(steps) == 0.0) {
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

double ReadingSteps::step_of(const Decade& decade) const {
  if (!decade.has_step) return 0.0;
  const double divisor =
      decade.readings >= kReadingsForDivisor ? static_cast<double>(decade.divisor) : 1.0;
  return unit_ * divisor * power_of_ten(-decade.decimals);
}

// A smaller reading is never told in larger steps: a few that end in zeros by chance don't count.
double ReadingSteps::step_at(double value) const {
  const double size = std::abs(value / unit_);
  if (!std::isfinite(size) || size == 0.0) return 0.0;
  const std::size_t own = decade_of(size);
  if (decades_[own].readings == 0) return 0.0;
  double step = step_of(decades_[own]);
  for (std::size_t larger = own + 1; larger < kDecades; ++larger) {
    if (decades_[larger].readings > 0) step = std::min(step, step_of(decades_[larger]));
  }
  return step;
}

}  // namespace zerodrift::diagnosis
