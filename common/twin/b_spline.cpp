// SPDX-License-Identifier: Apache-2.0
#include "common/twin/b_spline.h"

namespace zerodrift::twin {

LocalSplines splines_at(std::span<const double> knots, double x) noexcept {
  const std::size_t last_interval = knots.size() - kSplineDegree - 2;
  std::size_t j = kSplineDegree;
  while (j < last_interval && x >= knots[j + 1]) ++j;
  LocalSplines local{j - kSplineDegree, {1.0, 0.0, 0.0, 0.0}};
  std::array<double, kSplineDegree + 1> left{};
  std::array<double, kSplineDegree + 1> right{};
  for (std::size_t d = 1; d <= kSplineDegree; ++d) {
    left[d] = x - knots[j + 1 - d];
    right[d] = knots[j + d] - x;
    double saved = 0.0;
    for (std::size_t r = 0; r < d; ++r) {
      const double width = right[r + 1] + left[d - r];
      const double share = width > 0.0 ? local.values[r] / width : 0.0;
      local.values[r] = saved + right[r + 1] * share;
      saved = left[d - r] * share;
    }
    local.values[d] = saved;
  }
  return local;
}

std::vector<double> knots_around(std::span<const double> inner) {
  std::vector<double> knots(kSplineDegree, inner.front());
  knots.insert(knots.end(), inner.begin(), inner.end());
  knots.insert(knots.end(), kSplineDegree, inner.back());
  return knots;
}

}  // namespace zerodrift::twin
