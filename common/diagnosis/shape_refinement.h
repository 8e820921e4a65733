// SPDX-License-Identifier: Apache-2.0
// One shape parameter moved to where a function of the shape is largest.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "common/core/golden_section.h"
#include "common/diagnosis/search_problem.h"

namespace zerodrift::diagnosis {

// How far a parameter is moved from `centre`, in what it moves in evenly: itself or a logarithm.
struct Reach {
  Reach(const ShapeRange& range, double centre)
      : is_logarithmic(range.scale == ShapeScale::kLogarithmic), origin(range.origin) {
    const double step = is_logarithmic ? std::log(range.step) : range.step;
    low = std::max(to(centre) - step, to(range.lowest));
    high = std::min(to(centre) + step, to(range.highest));
  }
  [[nodiscard]] double to(double x) const { return is_logarithmic ? std::log(x - origin) : x; }
  [[nodiscard]] double from(double x) const { return is_logarithmic ? origin + std::exp(x) : x; }

  bool is_logarithmic;
  double origin;
  double low = 0.0;
  double high = 0.0;
};

// Moves shape[i] to the largest f within a step of `centre`; that value.
template <typename F>
double refine_along(std::size_t i, const ShapeRange& range, double centre,
                    std::vector<double>& shape, F&& f) {
  constexpr int kEvenSteps = 8;
  constexpr int kGoldenSteps = 6;
  constexpr double kNothing = -std::numeric_limits<double>::infinity();
  if (range.scale == ShapeScale::kFixed) return kNothing;
  const Reach reach(range, centre);
  const double low = reach.low;
  const double high = reach.high;
  if (!(high > low)) return kNothing;
  const auto at = [&](double x) {
    shape[i] = reach.from(x);
    return f(shape);
  };
  const double spacing = (high - low) / kEvenSteps;
  double best = low;
  double value = at(low);
  for (int step = 1; step <= kEvenSteps; ++step) {
    const double x = low + spacing * step;
    const double here = at(x);
    if (here <= value) continue;
    value = here;
    best = x;
  }
  core::golden_section(std::max(low, best - spacing), std::min(high, best + spacing), kGoldenSteps,
                       [&](double x) {
                         const double here = at(x);
                         if (here > value) {
                           value = here;
                           best = x;
                         }
                         return -here;
                       });
  shape[i] = reach.from(best);
  return value;
}

}  // namespace zerodrift::diagnosis
