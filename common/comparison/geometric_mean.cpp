// SPDX-License-Identifier: Apache-2.0
#include "common/comparison/geometric_mean.h"

#include <boost/math/distributions/students_t.hpp>
#include <cmath>

namespace zerodrift::comparison {

GeometricMean geometric_mean(std::span<const double> values) {
  GeometricMean mean;
  double sum = 0.0;
  const auto counts = [](double value) { return std::isfinite(value) && value > 0.0; };
  for (const double value : values) {
    if (!counts(value)) continue;
    sum += std::log(value);
    ++mean.count;
  }
  if (mean.count == 0) return mean;
  const auto n = static_cast<double>(mean.count);
  const double centre = sum / n;
  mean.value = std::exp(centre);
  if (mean.count == 1) return mean;
  double squares = 0.0;
  for (const double value : values) {
    if (counts(value)) squares += (std::log(value) - centre) * (std::log(value) - centre);
  }
  const boost::math::students_t_distribution<double> student(n - 1.0);
  const double half = boost::math::quantile(student, 0.975) * std::sqrt(squares / (n - 1.0) / n);
  mean.lower = std::exp(centre - half);
  mean.upper = std::exp(centre + half);
  return mean;
}

}  // namespace zerodrift::comparison
