// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/temperature_course.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <utility>

#include "common/core/median.h"
#include "common/core/not_known.h"
#include "common/diagnosis/coarse_readings.h"

namespace zerodrift::diagnosis {
namespace {

// In units of an interval.
struct LocalFit {
  double value = core::kNaN;
  double slope = core::kNaN;
  double curvature = core::kNaN;
  double readings = 0.0;
  double slope_error = 0.0;  // of readings with an error of 1
};

// A polynomial through the readings within `half` intervals of a place, with fewer terms where
// there are too few readings. Nothing beyond the readings: an outage is bridged, not extrapolated
// into.
template <int kTerms>
class LocalPolynomial {
 public:
  LocalPolynomial(std::size_t half, std::size_t size)
      : half_(half), reach_(std::min(half, size)), rows_(kTerms, 2 * reach_ + 1) {
    for (Eigen::Index i = 0; i < rows_.cols(); ++i) {
      const double x = (static_cast<double>(i) - static_cast<double>(reach_)) / width();
      rows_(0, i) = 1.0;
      for (int term = 1; term < kTerms; ++term) rows_(term, i) = x * rows_(term - 1, i);
    }
    Window all{.readings = static_cast<int>(rows_.cols())};
    for (Eigen::Index i = 0; i < rows_.cols(); ++i)
      all.normal += rows_.col(i) * rows_.col(i).transpose();
    of_all_ = solver_of(all);
  }

  [[nodiscard]] std::optional<LocalFit> at(const std::vector<double>& values,
                                           std::size_t centre) const {
    const std::size_t begin = centre > half_ ? centre - half_ : 0;
    const std::size_t end = std::min(centre + half_ + 1, values.size());
    const auto row = [&](std::size_t i) {
      return rows_.col(static_cast<Eigen::Index>(i + reach_ - centre));
    };
    Terms right = Terms::Zero();
    int readings = 0;
    bool before = false;
    bool after = false;
    for (std::size_t i = begin; i < end; ++i) {
      if (std::isnan(values[i])) continue;
      before = before || i <= centre;
      after = after || i >= centre;
      right += row(i) * values[i];
      ++readings;
    }
    if (!before || !after) return std::nullopt;
    if (readings == static_cast<int>(rows_.cols())) return fitted(of_all_, right);
    Window window{.readings = readings};
    for (std::size_t i = begin; i < end; ++i) {
      if (!std::isnan(values[i])) window.normal += row(i) * row(i).transpose();
    }
    return fitted(solver_of(window), right);
  }

 private:
  using Terms = Eigen::Matrix<double, kTerms, 1>;
  static constexpr int kEnough = 3 * kTerms - 1;  // readings for all terms

  struct Window {
    Eigen::Matrix<double, kTerms, kTerms> normal = Eigen::Matrix<double, kTerms, kTerms>::Zero();
    int readings = 0;
  };

  // What doesn't depend on the values.
  struct Solver {
    Eigen::LDLT<Eigen::MatrixXd> factor;
    Eigen::Index terms = 1;
    double readings = 0.0;
    double slope_error = 0.0;
  };

  [[nodiscard]] double width() const { return static_cast<double>(half_); }

  [[nodiscard]] Solver solver_of(const Window& window) const {
    Solver solver;
    solver.readings = window.readings;
    solver.terms = window.readings >= kEnough ? kTerms : window.readings >= 2 ? 2 : 1;
    solver.factor.compute(window.normal.topLeftCorner(solver.terms, solver.terms));
    if (solver.terms > 1) {
      const Eigen::VectorXd unit = Eigen::VectorXd::Unit(solver.terms, 1);
      solver.slope_error = std::sqrt(std::max(0.0, solver.factor.solve(unit)(1))) / width();
    }
    return solver;
  }

  [[nodiscard]] std::optional<LocalFit> fitted(const Solver& solver, const Terms& right) const {
    const Eigen::VectorXd c = solver.factor.solve(right.head(solver.terms)).eval();
    if (!c.allFinite()) return std::nullopt;
    LocalFit fit{.value = c(0),
                 .slope = 0.0,
                 .curvature = 0.0,
                 .readings = solver.readings,
                 .slope_error = solver.slope_error};
    if (solver.terms > 1) fit.slope = c(1) / width();
    if (solver.terms > 2) fit.curvature = 2.0 * c(2) / (width() * width());
    return fit;
  }

  std::size_t half_;
  std::size_t reach_;                                   // of that, within a series
  Eigen::Matrix<double, kTerms, Eigen::Dynamic> rows_;  // powers of the distance, one a place
  Solver of_all_;                                       // of readings everywhere
};

// Of the readings, from their differences in the order of time.
struct ReadingErrors {
  double noise_degc = 0.0;  // standard deviation, white
  double step_degc = 0.0;   // the usual difference of two that differ: a step, where they have one

  explicit ReadingErrors(const std::vector<double>& values) {
    std::vector<double> first, second;  // sizes of differences
    double before = core::kNaN, step_before = core::kNaN;
    for (const double value : values) {
      if (std::isnan(value)) continue;
      const double step = value - before;
      if (std::isfinite(step) && step != 0.0) first.push_back(std::abs(step));
      if (std::isfinite(step - step_before)) second.push_back(std::abs(step - step_before));
      step_before = step;
      before = value;
    }
    if (!first.empty()) step_degc = core::median_of(std::move(first));
    if (!second.empty())
      noise_degc = core::median_of(std::move(second)) / core::kMedianOfNormal / std::sqrt(6.0);
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
class ChosenFit {
 public:
  ChosenFit(const std::vector<double>& readings, std::size_t half)
      : values_(without_steps(readings, half / kReadingsEachSide)),
        errors_(readings),
        half_(half),
        shorter_(static_cast<std::size_t>(
            std::max(1.0, std::round(static_cast<double>(half) / std::numbers::sqrt2)))),
        quadratic_(half_, readings.size()),
        quartic_(shorter_, readings.size()) {}

  [[nodiscard]] LocalFit at(std::size_t centre) const {
    const auto usual = quadratic_.at(values_, centre);
    if (!usual) return {};
    const auto quick = quartic_.at(values_, centre);
    if (!quick) return *usual;
    const double error = errors_.of_slope(*usual, half_) + errors_.of_slope(*quick, shorter_);
    return std::abs(quick->slope - usual->slope) > error ? *quick : *usual;
  }

 private:
  std::vector<double> values_;
  ReadingErrors errors_;
  std::size_t half_;
  std::size_t shorter_;
  LocalPolynomial<3> quadratic_;
  LocalPolynomial<5> quartic_;
};

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
  const ChosenFit fits(readings_degc, half);
  TemperatureCourse course;
  for (std::size_t i = 0; i < readings_degc.size(); ++i) {
    const LocalFit fit = fits.at(i);
    course.degc.push_back(fit.value);
    course.degc_per_s.push_back(fit.slope / interval_s);
    course.degc_per_s2.push_back(fit.curvature / (interval_s * interval_s));
  }
  for (auto* values : {&course.degc, &course.degc_per_s, &course.degc_per_s2})
    *values = bridged(std::move(*values));
  return course;
}

}  // namespace zerodrift::diagnosis
