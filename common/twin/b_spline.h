// SPDX-License-Identifier: Apache-2.0
// Cubic B-splines over given knots (de Boor, A Practical Guide to Splines, 1978).
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

namespace zerodrift::twin {

inline constexpr std::size_t kSplineDegree = 3;

// The splines that are not zero at a place, the first of which has index `first`. They sum to 1.
struct LocalSplines {
  std::size_t first = 0;
  std::array<double, kSplineDegree + 1> values{};
};

// `knots`: not decreasing, the outer ones repeated for the degree, so that there are
// knots.size() - 4 splines, of which the first alone is 1 at the lower end and the last alone at
// the upper one. `x` within them; NaN gives NaN. O(knots).
[[nodiscard]] LocalSplines splines_at(std::span<const double> knots, double x) noexcept;

// The outer ones of `inner`, which increases, repeated for the degree.
[[nodiscard]] std::vector<double> knots_around(std::span<const double> inner);

}  // namespace zerodrift::twin
