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

// Moves shape[i] to the largest f within a step of `centre`; that value.
template <typename F>
double refine_along(std::size_t i, const ShapeRange& range, double centre,
                    std::vector<double>& shape, F&& f) {
  constexpr int kEvenSteps = 8;
  constexpr int kGoldenSteps = 6;
  constexpr double kNothing = -std::numeric_limits<double>::infinity();
  if (range.scale == ShapeScale::kFixed) return kNothing;
  const bool logarithmic = range.scale == ShapeScale::kLogarithmic;
  const auto to = [&](double x) { return logarithmic ? std::log(x) : x; };
  const auto from = [&](double x) { return logarithmic ? std::exp(x) : x; };
  const double low = std::max(to(centre) - to(range.step), to(range.lowest));
  const double high = std::min(to(centre) + to(range.step), to(range.highest));
  if (!(high > low)) return kNothing;
  const auto at = [&](double x) {
    shape[i] = from(x);
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
  shape[i] = from(best);
  return value;
}

}  // namespace zerodrift::diagnosis
