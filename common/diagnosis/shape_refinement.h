// SPDX-License-Identifier: Apache-2.0
// One shape parameter moved to where a function of the shape is largest.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>
#include <vector>

#include "common/diagnosis/search_problem.h"

namespace zerodrift::diagnosis {

// Largest of f on [low, high], unimodal or nearly so.
template <typename F>
double golden_maximum(F&& f, double low, double high, int evaluations) {
  constexpr double kGolden = 0.6180339887498949;
  double a = high - kGolden * (high - low);
  double b = low + kGolden * (high - low);
  double fa = f(a);
  double fb = f(b);
  for (int i = 2; i < evaluations; ++i) {
    if (fa >= fb) {
      high = std::exchange(b, a);
      fb = fa;
      a = high - kGolden * (high - low);
      fa = f(a);
    } else {
      low = std::exchange(a, b);
      fa = fb;
      b = low + kGolden * (high - low);
      fb = f(b);
    }
  }
  return fa >= fb ? a : b;
}

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
  const double finest = golden_maximum(at, std::max(low, best - spacing),
                                       std::min(high, best + spacing), kGoldenSteps);
  const double golden = at(finest);
  if (golden > value) return golden;
  shape[i] = from(best);
  return value;
}

}  // namespace zerodrift::diagnosis
