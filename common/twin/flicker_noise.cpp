// SPDX-License-Identifier: Apache-2.0
#include "common/twin/flicker_noise.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/twin/spectrum.h"

namespace zerodrift::twin {
namespace {

constexpr double kMovesPerCorrelationTime = 16.0;
constexpr double kLongestHoldS = 1.0;

// Samples from move to move: a power of two, so that longer holds fall on shorter ones.
std::uint64_t stride_of(double correlation_s, double interval_s) {
  const double hold_s = std::min(correlation_s / kMovesPerCorrelationTime, kLongestHoldS);
  std::uint64_t stride = 1;
  while (2.0 * static_cast<double>(stride) * interval_s <= hold_s) stride *= 2;
  return stride;
}

// Allan variance of a first-order Markov process of unit variance (Tehrani 1983).
double markov_allan_variance(double tau_s, double correlation_s) noexcept {
  const double x = tau_s / correlation_s;
  if (x < 1e-3) return x * 2.0 / 3.0;  // avoids cancellation; error below x²/2
  return 2.0 / x * (1.0 - (3.0 - 4.0 * std::exp(-x) + std::exp(-2.0 * x)) / (2.0 * x));
}

// The variance of each process.
double level_variance(const FlickerNoiseOptions& options) noexcept {
  return std::numbers::ln2 / std::numbers::pi * options.bias_instability * options.bias_instability;
}

}  // namespace

FlickerDensity::FlickerDensity(const FlickerNoiseOptions& options, double interval_s)
    : interval_s_(interval_s), level_variance_(level_variance(options)) {
  for (double correlation_s = options.shortest_correlation_s;; correlation_s *= 2.0) {
    levels_.emplace_back(1.0, correlation_s, interval_s);
    if (correlation_s >= options.longest_correlation_s) break;
  }
}

double FlickerDensity::operator()(double frequency_hz) const noexcept {
  const double sine = half_angle(frequency_hz, interval_s_);
  double sum = 0.0;
  for (const FirstOrderDensity& level : levels_) sum += level.at(sine);
  return level_variance_ * sum;
}

FlickerNoise::FlickerNoise(const FlickerNoiseOptions& options, double interval_s,
                           const NoiseStream& noise)
    : level_variance_(level_variance(options)) {
  const double deviation = std::sqrt(level_variance_);
  double correlation_s = options.shortest_correlation_s;
  for (std::uint64_t number = 0;; ++number, correlation_s *= 2.0) {
    const std::uint64_t stride = stride_of(correlation_s, interval_s);
    const double hold = static_cast<double>(stride) * interval_s / correlation_s;
    const NoiseStream own = noise.substream(number);
    levels_.push_back({correlation_s, stride, std::exp(-hold),
                       deviation * std::sqrt(-std::expm1(-2.0 * hold)), own,
                       deviation * own.gaussian(0)});
    if (correlation_s >= options.longest_correlation_s) break;
  }
}

double FlickerNoise::step(std::uint64_t sample) noexcept {
  bool moved = sample == 0;
  for (Level& level : levels_) {
    if (sample % level.stride != 0) break;
    if (sample == 0) continue;
    level.value =
        level.memory * level.value + level.innovation * level.noise.gaussian(sample / level.stride);
    moved = true;
  }
  if (!moved) return sum_;
  sum_ = 0.0;
  for (const Level& level : levels_) sum_ += level.value;
  return sum_;
}

double FlickerNoise::allan_variance(double tau_s) const noexcept {
  double sum = 0.0;
  for (const Level& level : levels_) {
    sum += level_variance_ * markov_allan_variance(tau_s, level.correlation_s);
  }
  return sum;
}

}  // namespace zerodrift::twin
