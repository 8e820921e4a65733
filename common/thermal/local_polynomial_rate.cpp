// SPDX-License-Identifier: Apache-2.0
#include "common/thermal/local_polynomial_rate.h"

#include <cmath>
#include <stdexcept>

#include "common/core/integer_time.h"

namespace zerodrift::thermal {
namespace {

constexpr std::size_t kMaxTerms = 3;  // 1, x, x²
using Vector = std::array<double, kMaxTerms>;
using Matrix = std::array<Vector, kMaxTerms>;

// A pivot below this share of its diagonal means that the readings' times do not determine the
// polynomial. Evenly spread readings give 0.03; rounding alone would give 1e-15.
constexpr double kSmallestPivotShare = 1e-6;

const LocalPolynomialRateOptions& checked(const LocalPolynomialRateOptions& options) {
  if (const auto problem = options.validate()) throw std::invalid_argument(*problem);
  return options;
}

// Replaces the lower triangle of the leading `terms` rows by L and the diagonal by D of L D L'.
// False if not positive definite within kSmallestPivotShare.
bool factorise(Matrix& m, std::size_t terms) noexcept {
  for (std::size_t j = 0; j < terms; ++j) {
    const double diagonal = m[j][j];
    for (std::size_t k = 0; k < j; ++k) m[j][j] -= m[j][k] * m[j][k] * m[k][k];
    if (!(m[j][j] > kSmallestPivotShare * diagonal)) return false;
    for (std::size_t i = j + 1; i < terms; ++i) {
      for (std::size_t k = 0; k < j; ++k) m[i][j] -= m[i][k] * m[j][k] * m[k][k];
      m[i][j] /= m[j][j];
    }
  }
  return true;
}

// Solves L D L' x = b for the factors of factorise().
Vector solve(const Matrix& ldl, Vector b, std::size_t terms) noexcept {
  for (std::size_t i = 0; i < terms; ++i) {
    for (std::size_t k = 0; k < i; ++k) b[i] -= ldl[i][k] * b[k];
  }
  for (std::size_t i = terms; i-- > 0;) {
    b[i] /= ldl[i][i];
    for (std::size_t k = i + 1; k < terms; ++k) b[i] -= ldl[k][i] * b[k];
  }
  return b;
}

}  // namespace

// Weighted sums over the bins; temperatures relative to the newest reading. Lower triangle only.
struct LocalPolynomialRate::NormalEquations {
  Matrix matrix{};
  Vector right_side{};

  void add(const Vector& row, double temperature, double weight) noexcept {
    for (std::size_t i = 0; i < kMaxTerms; ++i) {
      for (std::size_t j = 0; j <= i; ++j) matrix[i][j] += weight * row[i] * row[j];
      right_side[i] += weight * row[i] * temperature;
    }
  }
};

std::optional<std::string> LocalPolynomialRateOptions::validate() const {
  if (degree != 1 && degree != 2) {
    return "degree is " + std::to_string(degree) + ", must be 1 or 2";
  }
  if (!(window_s >= 1e-3 && window_s <= 1e6)) {
    return "window_s is " + std::to_string(window_s) + ", must be 0.001 to 1e6";
  }
  const std::size_t fewest = static_cast<std::size_t>(degree) + 2;
  if (bins < fewest || bins > LocalPolynomialRate::kMaxBins) {
    return "bins is " + std::to_string(bins) + ", must be " + std::to_string(fewest) + " to " +
           std::to_string(LocalPolynomialRate::kMaxBins);
  }
  if (min_bins < fewest || min_bins > bins) {
    return "min_bins is " + std::to_string(min_bins) + ", must be " + std::to_string(fewest) +
           " to bins (" + std::to_string(bins) + ")";
  }
  if (!(min_span_fraction >= 0.0 && min_span_fraction <= 0.9)) {
    return "min_span_fraction is " + std::to_string(min_span_fraction) + ", must be 0 to 0.9";
  }
  if (!(max_gap_s > 0.0 && max_gap_s <= 1e6)) {
    return "max_gap_s is " + std::to_string(max_gap_s) + ", must be above 0 and at most 1e6";
  }
  return std::nullopt;
}

LocalPolynomialRate::LocalPolynomialRate(const LocalPolynomialRateOptions& options)
    : options_(checked(options)),
      bin_width_(core::from_seconds(options.window_s / static_cast<double>(options.bins))),
      max_gap_(core::from_seconds(options.max_gap_s)) {}

void LocalPolynomialRate::add(core::SensorTime time, double temperature_degc) noexcept {
  if (!std::isfinite(temperature_degc) || !core::is_usable(time)) return;
  if (!empty_ && time <= newest_time_) return;
  if (!empty_ && time - newest_time_ > max_gap_) reset();

  const std::int64_t bin_index = core::interval_index(time, bin_width_);
  Bin& bin = bins_[slot(bin_index)];
  if (bin.readings == 0 || bin.index != bin_index) bin = Bin{.index = bin_index};
  const double offset_s = core::seconds(time - bin_index * bin_width_);
  ++bin.readings;
  bin.offset_sum_s += offset_s;
  bin.offset_square_sum_s2 += offset_s * offset_s;
  bin.temperature_sum_degc += temperature_degc;

  empty_ = false;
  newest_time_ = time;
  newest_temperature_degc_ = temperature_degc;
}

void LocalPolynomialRate::reset() noexcept {
  bins_.fill(Bin{});
  empty_ = true;
}

std::optional<LocalPolynomialFit> LocalPolynomialRate::fit() const noexcept {
  std::optional<NormalEquations> equations = accumulate();
  const std::size_t terms = static_cast<std::size_t>(options_.degree) + 1;
  if (!equations || !factorise(equations->matrix, terms)) return std::nullopt;

  const Vector coefficients = solve(equations->matrix, equations->right_side, terms);
  // Weights are reading counts, so the inverse of the normal matrix is the coefficients' covariance
  // for unit noise.
  const Vector rate_covariance = solve(equations->matrix, Vector{0.0, 1.0, 0.0}, terms);
  return LocalPolynomialFit{
      .temperature_degc = newest_temperature_degc_ + coefficients[0],
      .rate_degc_per_s = coefficients[1] / options_.window_s,
      .noise_gain_per_s = std::sqrt(rate_covariance[1]) / options_.window_s,
  };
}

std::optional<double> LocalPolynomialRate::rate_degc_per_s() const noexcept {
  const auto result = fit();
  return result ? std::optional(result->rate_degc_per_s) : std::nullopt;
}

double LocalPolynomialRate::lag_s() const noexcept {
  return options_.degree == 2 ? 0.0 : options_.window_s / 2.0;
}

std::optional<LocalPolynomialRate::NormalEquations> LocalPolynomialRate::accumulate()
    const noexcept {
  if (empty_) return std::nullopt;
  const std::int64_t last = core::interval_index(newest_time_, bin_width_);
  const std::int64_t first = last - static_cast<std::int64_t>(options_.bins) + 1;
  NormalEquations equations;
  std::size_t bins_with_readings = 0;
  double oldest_x = 0.0;
  for (std::int64_t index = first; index <= last; ++index) {
    const Bin& bin = bins_[slot(index)];
    if (bin.readings == 0 || bin.index != index) continue;
    const auto n = static_cast<double>(bin.readings);
    const double start_s = core::seconds(index * bin_width_ - newest_time_);
    const double mean_offset_s = bin.offset_sum_s / n;
    const double mean_square_s2 =
        start_s * (start_s + 2.0 * mean_offset_s) + bin.offset_square_sum_s2 / n;
    const double x = (start_s + mean_offset_s) / options_.window_s;
    equations.add({1.0, x, mean_square_s2 / (options_.window_s * options_.window_s)},
                  bin.temperature_sum_degc / n - newest_temperature_degc_, n);
    if (bins_with_readings++ == 0) oldest_x = x;
  }
  if (bins_with_readings < options_.min_bins) return std::nullopt;
  if (-oldest_x < options_.min_span_fraction) return std::nullopt;
  return equations;
}

std::size_t LocalPolynomialRate::slot(std::int64_t bin_index) const noexcept {
  const auto bins = static_cast<std::int64_t>(options_.bins);
  const std::int64_t remainder = bin_index % bins;
  return static_cast<std::size_t>(remainder < 0 ? remainder + bins : remainder);
}

}  // namespace zerodrift::thermal
