// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/temperature_course.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <numbers>
#include <optional>
#include <span>
#include <utility>

#include "common/core/median.h"
#include "common/core/not_known.h"
#include "common/diagnosis/coarse_readings.h"

namespace zerodrift::diagnosis {
namespace {

// Of the temperature that a thermometer behind its lag shows, in units of an interval.
struct LocalFit {
  double value = core::kNaN;
  double slope = core::kNaN;
  double readings = 0.0;
  double slope_error = 0.0;  // of readings with an error of 1
};

// On a grid of intervals, of which some have none.
struct Readings {
  std::vector<std::uint8_t> there{};
  std::vector<double> values{};  // 0 where there is none

  explicit Readings(const std::vector<double>& with_gaps) : values(with_gaps) {
    for (double& value : values) {
      there.push_back(std::isnan(value) ? 0 : 1);
      if (std::isnan(value)) value = 0.0;
    }
  }
};

// A polynomial through the readings within `half` intervals of a place, with fewer terms where
// there are too few readings, and its derivatives, of which a lag is taken off. Nothing beyond the
// readings: an outage is bridged, not extrapolated into.
template <int kTerms>
class LocalPolynomial {
 public:
  // `lag` in intervals.
  LocalPolynomial(std::size_t half, std::size_t size, double lag)
      : half_(half), reach_(std::min(half, size)), lag_(lag), rows_(kTerms, 2 * reach_ + 1) {
    for (Eigen::Index i = 0; i < rows_.cols(); ++i) {
      const double x = (static_cast<double>(i) - static_cast<double>(reach_)) / width();
      rows_(0, i) = 1.0;
      for (int term = 1; term < kTerms; ++term) rows_(term, i) = x * rows_(term - 1, i);
    }
  }

  [[nodiscard]] std::optional<LocalFit> at(const Readings& readings, std::size_t centre) {
    const std::size_t begin = centre > half_ ? centre - half_ : 0;
    const std::size_t end = std::min(centre + half_ + 1, readings.values.size());
    const Weights& weights =
        weights_of(std::span(readings.there).subspan(begin, end - begin), centre - begin);
    if (!weights.are_between_readings) return std::nullopt;
    const Eigen::Map<const Eigen::VectorXd> window(&readings.values[begin],
                                                   static_cast<Eigen::Index>(end - begin));
    const double value = weights.value.dot(window);
    const double slope = weights.slope.dot(window);
    if (!std::isfinite(value) || !std::isfinite(slope)) return std::nullopt;
    return LocalFit{value, slope, weights.readings, weights.slope_error};
  }

 private:
  static constexpr int kEnough = 3 * kTerms - 1;  // readings for all terms
  using Terms = Eigen::Matrix<double, kTerms, 1>;
  using Square = Eigen::Matrix<double, kTerms, kTerms>;
  using Bounded = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kTerms, kTerms>;

  // What doesn't depend on the values: fits are sums over a window.
  struct Weights {
    std::vector<std::uint8_t> there{};  // in which places of the window readings are
    std::size_t centre = 0;             // of these places
    bool are_between_readings = false;
    Eigen::VectorXd value{}, slope{};
    double readings = 0.0;
    double slope_error = 0.0;
  };

  [[nodiscard]] double width() const { return static_cast<double>(half_); }

  // Readings come regularly, so that the same few windows come again and again.
  const Weights& weights_of(std::span<const std::uint8_t> there, std::size_t centre) {
    constexpr std::size_t kMost = 64;
    const auto known = std::find_if(known_.begin(), known_.end(), [&](const Weights& weights) {
      return weights.centre == centre && std::ranges::equal(weights.there, there);
    });
    if (known != known_.end()) return *known;
    if (known_.size() == kMost) known_.pop_front();
    return known_.emplace_back(made(there, centre));
  }

  [[nodiscard]] Weights made(std::span<const std::uint8_t> there, std::size_t centre) const {
    const auto row = [&](std::size_t i) {
      return rows_.col(static_cast<Eigen::Index>(i + reach_ - centre));
    };
    Weights weights{.there = {there.begin(), there.end()}, .centre = centre};
    Square normal = Square::Zero();
    bool before = false;
    bool after = false;
    for (std::size_t i = 0; i < there.size(); ++i) {
      if (there[i] == 0) continue;
      before = before || i <= centre;
      after = after || i >= centre;
      normal += row(i) * row(i).transpose();
      weights.readings += 1.0;
    }
    weights.are_between_readings = before && after;
    if (!weights.are_between_readings) return weights;
    const Eigen::Index terms = weights.readings >= kEnough ? kTerms : weights.readings >= 2 ? 2 : 1;
    // What the value and the slope without the lag, y + lag y' and y' + lag y", make of the
    // coefficients.
    Terms value = Terms::Zero(), slope = Terms::Zero();
    value.template head<2>() << 1.0, lag_ / width();
    slope.template head<3>() << 0.0, 1.0 / width(), 2.0 * lag_ / (width() * width());
    const Eigen::LDLT<Bounded> factor(normal.topLeftCorner(terms, terms));
    const double variance = slope.head(terms).dot(factor.solve(slope.head(terms)));
    weights.slope_error = std::sqrt(std::max(0.0, variance));
    for (Terms* of : {&value, &slope}) {
      of->head(terms) = factor.solve(of->head(terms)).eval();
      of->tail(kTerms - terms).setZero();
    }
    weights.value.setZero(static_cast<Eigen::Index>(there.size()));
    weights.slope = weights.value;
    for (std::size_t i = 0; i < there.size(); ++i) {
      if (there[i] == 0) continue;
      weights.value(static_cast<Eigen::Index>(i)) = row(i).dot(value);
      weights.slope(static_cast<Eigen::Index>(i)) = row(i).dot(slope);
    }
    return weights;
  }

  std::size_t half_;
  std::size_t reach_;  // of that, within a series
  double lag_;
  Eigen::Matrix<double, kTerms, Eigen::Dynamic> rows_;  // powers of the distance, one a place
  std::deque<Weights> known_;
};

// Of the readings, from their differences in the order of time.
struct ReadingErrors {
  double noise_degc = 0.0;  // standard deviation, white, from the median
  // From the mean square, of the steps too; 0 where no noise carries the readings over them.
  double variance_degc2 = 0.0;
  double step_degc = 0.0;  // the usual difference of two that differ: a step, where they have one

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
    for (const double size : second) {
      constexpr double kWild = 6.0;  // some 2.4 standard deviations of readings without steps
      variance_degc2 += std::pow(std::min(size, kWild * step_degc), 2) /
                        (6.0 * static_cast<double>(second.size()));
    }
    if (variance_degc2 <= step_degc * step_degc / 12.0) variance_degc2 = 0.0;
    if (!second.empty())
      noise_degc = core::median_of(std::move(second)) / core::kMedianOfNormal / std::sqrt(6.0);
  }

  // Of a slope over +- `half` intervals, per interval: what noise makes of it, two standard
  // deviations, or what the steps do.
  [[nodiscard]] double of_slope(const LocalFit& fit, std::size_t half) const {
    return std::max(2.0 * noise_degc * fit.slope_error, of_step(fit, half));
  }

 private:
  [[nodiscard]] double of_step(const LocalFit& fit, std::size_t half) const {
    const double width = static_cast<double>(half);
    const double in_the_middle = 1.0 / std::sqrt(width * width * fit.readings / 3.0);
    return 0.5 * step_degc / width * fit.slope_error / in_the_middle;
  }
};

// Means over +- `half` places, of those that are finite.
std::vector<double> local_means(const std::vector<double>& values, std::size_t half) {
  std::vector<double> sums(values.size() + 1, 0.0);
  std::vector<double> counts(values.size() + 1, 0.0);
  for (std::size_t i = 0; i < values.size(); ++i) {
    const bool is_there = std::isfinite(values[i]);
    sums[i + 1] = sums[i] + (is_there ? values[i] : 0.0);
    counts[i + 1] = counts[i] + (is_there ? 1.0 : 0.0);
  }
  std::vector<double> means(values.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    const std::size_t begin = i > half ? i - half : 0;
    const std::size_t end = std::min(values.size(), i + half + 1);
    means[i] = (sums[end] - sums[begin]) / (counts[end] - counts[begin]);
  }
  return means;
}

class ChosenFits {
 public:
  ChosenFits(const std::vector<double>& readings, std::size_t half, double lag)
      : errors_(readings),
        course_(course_of(readings, half)),
        readings_(course_.degc),
        half_(half),
        lag_(lag) {}

  [[nodiscard]] std::vector<LocalFit> run() const {
    std::vector<LocalFit> fits = usual_or_quick();
    std::vector<std::uint8_t> may_widen(fits.size(), 1);
    for (std::size_t half = half_; half < kWidest * half_; half *= 2) widen(fits, half, may_widen);
    return fits;
  }

 private:
  // Noise of a fifth of a step, whose flips make a variance of step² / sqrt(pi) / 5, is enough for
  // means to be better than what is known without it.
  [[nodiscard]] WithoutSteps course_of(const std::vector<double>& readings,
                                       std::size_t half) const {
    constexpr double kOfFlips = std::numbers::inv_sqrtpi / 5.0;
    const double of_noise = errors_.variance_degc2;
    if (of_noise > kOfFlips * errors_.step_degc * errors_.step_degc)
      return {readings, std::vector<double>(readings.size(), of_noise)};
    return without_steps(readings, half / kReadingsEachSide, of_noise);
  }

  // The quartic where the two slopes differ by more than their errors.
  [[nodiscard]] std::vector<LocalFit> usual_or_quick() const {
    const auto shorter = static_cast<std::size_t>(
        std::max(1.0, std::round(static_cast<double>(half_) / std::numbers::sqrt2)));
    LocalPolynomial<3> quadratic(half_, course_.degc.size(), lag_);
    LocalPolynomial<5> quartic(shorter, course_.degc.size(), lag_);
    std::vector<LocalFit> fits(course_.degc.size());
    for (std::size_t i = 0; i < fits.size(); ++i) {
      const auto usual = quadratic.at(readings_, i);
      if (!usual) continue;
      fits[i] = *usual;
      const auto quick = quartic.at(readings_, i);
      if (!quick) continue;
      const double error = errors_.of_slope(*usual, half_) + errors_.of_slope(*quick, shorter);
      if (std::abs(quick->slope - usual->slope) > error) fits[i] = *quick;
    }
    return fits;
  }

  // Twice as wide where that changes slopes, in the mean square over the wider window, by no more
  // than four times what noise alone does: of two or so independent slopes one mean in 50 is larger
  // by chance.
  void widen(std::vector<LocalFit>& fits, std::size_t half,
             std::vector<std::uint8_t>& may_widen) const {
    LocalPolynomial<3> twice(2 * half, course_.degc.size(), lag_);
    std::vector<LocalFit> wider(fits.size());
    std::vector<double> changes(fits.size(), core::kNaN);
    const std::vector<double> variances = local_means(course_.variance_degc2, half);
    for (std::size_t i = 0; i < fits.size(); ++i) {
      const auto fit = twice.at(readings_, i);
      if (!fit || std::isnan(fits[i].slope)) continue;
      wider[i] = *fit;
      const double by_noise =
          variances[i] * (std::pow(fits[i].slope_error, 2) - std::pow(fit->slope_error, 2));
      if (by_noise > 0.0) changes[i] = std::pow(fit->slope - fits[i].slope, 2) / by_noise;
    }
    changes = local_means(changes, 2 * half);
    for (std::size_t i = 0; i < fits.size(); ++i) {
      may_widen[i] = may_widen[i] != 0 && changes[i] < kMostOfNoise ? 1 : 0;
      if (may_widen[i] != 0) fits[i] = wider[i];
    }
  }

  static constexpr std::size_t kWidest = 4;
  static constexpr double kMostOfNoise = 4.0;

  ReadingErrors errors_;
  WithoutSteps course_;
  Readings readings_;  // of the course
  std::size_t half_;
  double lag_;
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
                                     double half_window_s, double lag_s) {
  const auto half = static_cast<std::size_t>(std::max(1.0, std::round(half_window_s / interval_s)));
  TemperatureCourse course;
  for (const LocalFit& fit : ChosenFits(readings_degc, half, lag_s / interval_s).run()) {
    course.degc.push_back(fit.value);
    course.degc_per_s.push_back(fit.slope / interval_s);
  }
  for (auto* values : {&course.degc, &course.degc_per_s}) *values = bridged(std::move(*values));
  return course;
}

}  // namespace zerodrift::diagnosis
