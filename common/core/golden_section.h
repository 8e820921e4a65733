// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace zerodrift::core {

// What a search by golden section ends with: the interval that holds the minimum, and the better of
// the two points evaluated inside it.
struct GoldenSection {
  double low = 0.0;
  double high = 0.0;
  double best = 0.0;
};

// Each evaluation but the first two takes the interval to this share of its length.
inline constexpr double kGoldenRatio = 0.6180339887498949;

// Narrows [low, high] about the minimum of a cost that has one there. Calls cost(x) exactly
// `evaluations` times, two at least, so that equal input costs equal work. (Brent's method, as
// Boost.Math has it, begins at an end of the interval: DECISIONS.md 91.)
template <typename Cost>
GoldenSection golden_section(double low, double high, int evaluations, const Cost& cost) {
  double left = high - kGoldenRatio * (high - low);
  double right = low + kGoldenRatio * (high - low);
  double left_cost = cost(left);
  double right_cost = cost(right);
  for (int i = 2; i < evaluations; ++i) {
    if (left_cost < right_cost) {
      high = right;
      right = left;
      right_cost = left_cost;
      left = high - kGoldenRatio * (high - low);
      left_cost = cost(left);
    } else {
      low = left;
      left = right;
      left_cost = right_cost;
      right = low + kGoldenRatio * (high - low);
      right_cost = cost(right);
    }
  }
  return {low, high, left_cost < right_cost ? left : right};
}

}  // namespace zerodrift::core
