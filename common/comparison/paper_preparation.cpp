// SPDX-License-Identifier: Apache-2.0
#include "common/comparison/paper_preparation.h"

#include <Eigen/Core>
#include <Eigen/QR>
#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <string>

#include "common/allan/deviations.h"

namespace zerodrift::comparison {
namespace {

void require_positive(const char* key, double value) {
  if (value > 0.0 && std::isfinite(value)) return;
  throw std::invalid_argument(std::string(key) + " is " + std::to_string(value) +
                              ", must be positive and finite");
}

// Sample that ends point `k` of `points`: evenly from the first full minute's to the last.
std::size_t end_of_point(std::size_t k, std::size_t points, std::size_t window,
                         std::size_t samples) {
  if (points == 1) return window - 1;
  const std::size_t room = samples - window;
  return window - 1 + (k * room + (points - 1) / 2) / (points - 1);
}

using Coefficients = Eigen::Matrix<double, 5, 1>;  // A-2 .. A2

// 100 steps on the logarithmic scale from 1 to the power of two, rounded up, without repeats.
std::vector<std::size_t> paper_clusters(std::size_t points) {
  constexpr int kSteps = 99;
  const auto octaves = static_cast<double>(std::bit_width(points / 2) - 1);
  std::vector<std::size_t> sizes;
  for (int step = 0; step <= kSteps; ++step) {
    const double exact = std::exp2(octaves * step / kSteps);
    const auto size = static_cast<std::size_t>(std::ceil(exact));
    if (sizes.empty() || size > sizes.back()) sizes.push_back(size);
  }
  return sizes;
}

// Columns are scaled to length 1, so that no term counts less for the unit of its tau.
Coefficients least_squares(const std::vector<allan::DeviationPoint>& curve) {
  const auto rows = static_cast<Eigen::Index>(curve.size());
  Eigen::Matrix<double, Eigen::Dynamic, 5> terms(rows, 5);
  Eigen::VectorXd deviations(rows);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const auto& point = curve[static_cast<std::size_t>(i)];
    const double root = std::sqrt(point.tau_s);
    terms.row(i) << 1.0 / point.tau_s, 1.0 / root, 1.0, root, point.tau_s;
    deviations(i) = point.deviation;
  }
  const Coefficients lengths = terms.colwise().norm().transpose();
  terms *= lengths.cwiseInverse().asDiagonal();
  return terms.householderQr().solve(deviations).cwiseQuotient(lengths);
}

}  // namespace

void PaperPreparation::Sum::add(double sample) noexcept {
  if (!std::isfinite(sample)) return;
  value += sample;
  ++count;
}

PaperPreparation::PaperPreparation(double sample_interval_s, double duration_s) {
  require_positive("sample_interval_s", sample_interval_s);
  require_positive("duration_s", duration_s);
  if (sample_interval_s > kPaperWindowS) {
    throw std::invalid_argument("sample_interval_s is " + std::to_string(sample_interval_s) +
                                ", must not exceed the minute that is averaged over");
  }
  window_ = static_cast<std::size_t>(std::llround(kPaperWindowS / sample_interval_s));
  samples_ = static_cast<std::size_t>(std::llround(duration_s / sample_interval_s));
  if (samples_ >= window_) point_count_ = std::min(kPaperPoints, samples_ - window_ + 1);
  interval_s_ = point_count_ > 1 ? static_cast<double>(samples_ - window_) /
                                       static_cast<double>(point_count_ - 1) * sample_interval_s
                                 : kPaperWindowS;
  block_.resize(window_);
  tails_.resize(window_ + 1);
  points_.reserve(point_count_);
  next_end_ = window_ - 1;
}

bool PaperPreparation::add(double value) noexcept {
  if (next_sample_ == samples_) return false;
  const std::size_t place = next_sample_ % window_;
  block_[place] = value;
  head_.add(value);
  const bool ends_point = points_.size() < point_count_ && next_sample_ == next_end_;
  if (ends_point) {
    points_.push_back(window_mean(place));
    next_end_ = end_of_point(points_.size(), point_count_, window_, samples_);
  }
  if (place + 1 == window_) close_block();
  ++next_sample_;
  return ends_point;
}

void PaperPreparation::close_block() noexcept {
  tails_[window_] = {};
  for (std::size_t i = window_; i-- > 0;) {
    tails_[i] = tails_[i + 1];
    tails_[i].add(block_[i]);
  }
  head_ = {};
}

double PaperPreparation::window_mean(std::size_t place) const noexcept {
  const Sum& tail = tails_[place + 1];
  const std::size_t count = tail.count + head_.count;
  return count > 0 ? (tail.value + head_.value) / static_cast<double>(count)
                   : std::numeric_limits<double>::quiet_NaN();
}

PreparedSeries prepare(std::span<const double> samples, double sample_interval_s) {
  if (samples.empty()) return {};
  PaperPreparation preparation(sample_interval_s,
                               static_cast<double>(samples.size()) * sample_interval_s);
  for (const double sample : samples) preparation.add(sample);
  const auto points = preparation.points();
  return {preparation.interval_s(), {points.begin(), points.end()}};
}

Moments moments(std::span<const double> points) noexcept {
  Moments m;
  double sum = 0.0;
  double absolute = 0.0;
  double squares = 0.0;
  for (const double point : points) {
    if (!std::isfinite(point)) continue;
    ++m.points;
    sum += point;
    absolute += std::abs(point);
    squares += point * point;
  }
  if (m.points == 0) return m;
  const auto n = static_cast<double>(m.points);
  m.mean = sum / n;
  m.mean_absolute_error = absolute / n;
  m.root_mean_square = std::sqrt(squares / n);
  double about_mean = 0.0;
  for (const double point : points) {
    if (std::isfinite(point)) about_mean += (point - m.mean) * (point - m.mean);
  }
  m.standard_deviation = std::sqrt(about_mean / n);
  return m;
}

std::optional<PaperCoefficients> paper_coefficients(std::span<const double> points_radps,
                                                    double interval_s) {
  constexpr std::size_t kFewestPoints = 16;  // clusters of 1 to 8, for five terms
  const auto finite = [](double point) { return std::isfinite(point); };
  if (points_radps.size() < kFewestPoints ||
      !std::all_of(points_radps.begin(), points_radps.end(), finite)) {
    return std::nullopt;
  }
  const std::vector<double> angle = allan::angle_from_rate(points_radps, interval_s);
  std::vector<allan::DeviationPoint> curve;
  for (const std::size_t size : paper_clusters(points_radps.size())) {
    const auto point = allan::deviation(allan::Statistic::kOadev, angle, interval_s, size);
    if (point) curve.push_back(*point);
  }
  const Coefficients a = least_squares(curve);
  const double flat = std::sqrt(2.0 * std::numbers::ln2 / std::numbers::pi);  // 0.664
  return PaperCoefficients{std::abs(a(1)), std::abs(a(2)) / flat,
                           std::numbers::sqrt3 * std::abs(a(3))};
}

}  // namespace zerodrift::comparison
