// SPDX-License-Identifier: Apache-2.0
// The curve of least mean square curvature through given points (Schoenberg 1964).
#pragma once

#include <cstddef>
#include <vector>

namespace zerodrift::diagnosis {

struct Knot {
  double place = 0.0;
  double value = 0.0;
};

// Cubics whose first two derivatives are continuous, straight beyond the ends.
class NaturalSpline {
 public:
  // Two knots or more, places ascending. O(knots).
  explicit NaturalSpline(std::vector<Knot> knots);

  // O(log knots).
  [[nodiscard]] double at(double place) const;

 private:
  [[nodiscard]] double slope(std::size_t piece) const;  // of its chord

  std::vector<Knot> knots_;
  std::vector<double> second_;  // derivatives at the knots
};

}  // namespace zerodrift::diagnosis
