// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/temperature_course.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

#include "common/diagnosis/median.h"

namespace zerodrift::diagnosis {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

// In units of an interval.
struct LocalFit {
  double value = kNone;
  double slope = kNone;
  double curvature = kNone;
  double readings = 0.0;
  double slope_error = 0.0;  // of readings with an error of 1
};

// A polynomial through the readings within `half` intervals of `centre`, with fewer terms where
// there are too few readings. Nothing beyond the readings: an outage is bridged, not extrapolated
// into.
template <int kTerms>
std::optional<LocalFit> local_fit(const std::vector<double>& values, std::size_t centre,
                                  std::size_t half) {
  const std::size_t begin = centre > half ? centre - half : 0;
  const std::size_t end = std::min(centre + half + 1, values.size());
  using Terms = Eigen::Matrix<double, kTerms, 1>;
  Eigen::Matrix<double, kTerms, kTerms> normal = Eigen::Matrix<double, kTerms, kTerms>::Zero();
  Terms right = Terms::Zero();
  int readings = 0;
  bool before = false;
  bool after = false;
  for (std::size_t i = begin; i < end; ++i) {
    if (std::isnan(values[i])) continue;
    before = before || i <= centre;
    after = after || i >= centre;
    const double x =
        (static_cast<double>(i) - static_cast<double>(centre)) / static_cast<double>(half);
    Terms row = Terms::Ones();
    for (int term = 1; term < kTerms; ++term) row(term) = x * row(term - 1);
    normal += row * row.transpose();
    right += row * values[i];
    ++readings;
  }
  if (!before || !after) return std::nullopt;
  const Eigen::Index terms = readings >= 3 * kTerms - 1 ? kTerms : readings >= 2 ? 2 : 1;
  const auto factor = normal.topLeftCorner(terms, terms).ldlt();
  const Eigen::VectorXd c = factor.solve(right.head(terms)).eval();
  if (!c.allFinite()) return std::nullopt;
  const double width = static_cast<double>(half);
  LocalFit fit{.value = c(0), .slope = 0.0, .curvature = 0.0};
  fit.readings = static_cast<double>(readings);
  if (terms > 1) {
    fit.slope = c(1) / width;
    const Eigen::VectorXd unit = Eigen::VectorXd::Unit(terms, 1);
    fit.slope_error = std::sqrt(std::max(0.0, factor.solve(unit)(1))) / width;
  }
  if (terms > 2) fit.curvature = 2.0 * c(2) / (width * width);
  return fit;
}

// Of the readings, from their differences in the order of time.
struct ReadingErrors {
  double noise_degc = 0.0;  // standard deviation, white
  double step_degc = 0.0;   // the usual difference of two that differ: a step, where they have one

  explicit ReadingErrors(const std::vector<double>& values) {
    std::vector<double> first, second;  // sizes of differences
    double before = kNone, step_before = kNone;
    for (const double value : values) {
      if (std::isnan(value)) continue;
      const double step = value - before;
      if (std::isfinite(step) && step != 0.0) first.push_back(std::abs(step));
      if (std::isfinite(step - step_before)) second.push_back(std::abs(step - step_before));
      step_before = step;
      before = value;
    }
    constexpr double kMedianOfNormal = 0.6745;
    if (!first.empty()) step_degc = median_of(std::move(first));
    if (!second.empty())
      noise_degc = median_of(std::move(second)) / kMedianOfNormal / std::sqrt(6.0);
  }

  // Of a slope over +- `half` intervals, per interval: what noise makes of it, two standard
  // deviations, or what the steps do.
  [[nodiscard]] double of_slope(const LocalFit& fit, std::size_t half) const {
    const double width = static_cast<double>(half);
    const double in_the_middle = 1.0 / std::sqrt(width * width * fit.readings / 3.0);
    const double of_step = 0.5 * step_degc / width * fit.slope_error / in_the_middle;
    return std::max(2.0 * noise_degc * fit.slope_error, of_step);
  }
};

// The quartic where the two slopes differ by more than their errors.
LocalFit chosen_fit(const std::vector<double>& values, std::size_t centre, std::size_t half,
                    const ReadingErrors& errors) {
  const auto usual = local_fit<3>(values, centre, half);
  if (!usual) return {};
  const double shorter_half = static_cast<double>(half) / std::numbers::sqrt2;
  const auto shorter = static_cast<std::size_t>(std::max(1.0, std::round(shorter_half)));
  const auto quick = local_fit<5>(values, centre, shorter);
  if (!quick) return *usual;
  const double error = errors.of_slope(*usual, half) + errors.of_slope(*quick, shorter);
  return std::abs(quick->slope - usual->slope) > error ? *quick : *usual;
}

}  // namespace

std::vector<double> bridged(std::vector<double> values) {
  std::optional<std::size_t> last;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (std::isnan(values[i])) continue;
    for (std::size_t j = last ? *last + 1 : 0; j < i; ++j) {
      const double share =
          last ? static_cast<double>(j - *last) / static_cast<double>(i - *last) : 1.0;
      values[j] = last ? values[*last] + share * (values[i] - values[*last]) : values[i];
    }
    last = i;
  }
  if (!last) return {};
  std::fill(values.begin() + static_cast<std::ptrdiff_t>(*last), values.end(), values[*last]);
  return values;
}

TemperatureCourse temperature_course(const std::vector<double>& readings_degc, double interval_s,
                                     double half_window_s) {
  const auto half = static_cast<std::size_t>(std::max(1.0, std::round(half_window_s / interval_s)));
  const ReadingErrors errors(readings_degc);
  TemperatureCourse course;
  for (std::size_t i = 0; i < readings_degc.size(); ++i) {
    const LocalFit fit = chosen_fit(readings_degc, i, half, errors);
    course.degc.push_back(fit.value);
    course.degc_per_s.push_back(fit.slope / interval_s);
    course.degc_per_s2.push_back(fit.curvature / (interval_s * interval_s));
  }
  for (auto* values : {&course.degc, &course.degc_per_s, &course.degc_per_s2})
    *values = bridged(std::move(*values));
  return course;
}

}  // namespace zerodrift::diagnosis
