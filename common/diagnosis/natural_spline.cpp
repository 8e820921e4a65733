// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/natural_spline.h"

#include <algorithm>
#include <utility>

namespace zerodrift::diagnosis {

NaturalSpline::NaturalSpline(std::vector<Knot> knots)
    : knots_(std::move(knots)), second_(knots_.size(), 0.0) {
  std::vector<double> share(knots_.size(), 0.0);
  for (std::size_t i = 1; i + 1 < knots_.size(); ++i) {
    const double before = knots_[i].place - knots_[i - 1].place;
    const double after = knots_[i + 1].place - knots_[i].place;
    const double pivot = 2.0 * (before + after) - before * share[i - 1];
    share[i] = after / pivot;
    second_[i] = (6.0 * (slope(i) - slope(i - 1)) - before * second_[i - 1]) / pivot;
  }
  for (std::size_t i = knots_.size() - 1; i-- > 1;) second_[i] -= share[i] * second_[i + 1];
}

double NaturalSpline::at(double place) const {
  const auto next = std::upper_bound(knots_.begin() + 1, knots_.end() - 1, place,
                                     [](double p, const Knot& knot) { return p < knot.place; });
  const auto i = static_cast<std::size_t>(next - knots_.begin()) - 1;
  const double width = knots_[i + 1].place - knots_[i].place;
  if (place < knots_[i].place)
    return knots_[i].value + (slope(i) - width * second_[i + 1] / 6.0) * (place - knots_[i].place);
  if (place > knots_[i + 1].place) {
    return knots_[i + 1].value +
           (slope(i) + width * second_[i] / 6.0) * (place - knots_[i + 1].place);
  }
  const double a = (knots_[i + 1].place - place) / width;
  const double b = 1.0 - a;
  return a * knots_[i].value + b * knots_[i + 1].value +
         (a * (a * a - 1.0) * second_[i] + b * (b * b - 1.0) * second_[i + 1]) * width * width /
             6.0;
}

double NaturalSpline::slope(std::size_t piece) const {
  return (knots_[piece + 1].value - knots_[piece].value) /
         (knots_[piece + 1].place - knots_[piece].place);
}

}  // namespace zerodrift::diagnosis
