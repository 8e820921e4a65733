// SPDX-License-Identifier: Apache-2.0
#include "common/compensation/scale_factor.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace zerodrift::compensation {
namespace {

using core::index;

constexpr double kReferenceDegc = 25.0;
// What is known at first, standard deviations: no drift beyond MEMS gyros', an error well within
// the bound, and its change over a tenth of a percent within 30 °C.
constexpr double kFirstBiasRadps = 1.0 * core::kRadPerDeg;
constexpr double kFirstShare = ScaleFactor::kLargest / 3.0;
constexpr double kFirstPerDegc = 30e-6;
constexpr double kAgeingPerS = 1e-6 * 1e-6 / 60.0;  // variance
constexpr double kNotLinear = 50e-6;
constexpr double kOutlierSigmas = 4.0;
constexpr std::uint64_t kWindowBlocks = 32;
constexpr std::uint64_t kMostOutliers = kWindowBlocks / 4;
constexpr double kLargestMeanSquare = 2.0;  // 1, give or take .25 of 32 blocks
constexpr double kWidening = 4.0;

Eigen::Vector3d first_variances() {
  return Eigen::Vector3d{kFirstBiasRadps, kFirstShare, kFirstPerDegc}.cwiseAbs2();
}

double above_degc(std::optional<double> temperature_degc) {
  return temperature_degc ? *temperature_degc - kReferenceDegc : 0.0;
}

// Variances at most those at first, correlations as they are.
void cap(Eigen::Matrix3d& covariance) {
  const Eigen::Vector3d most = first_variances();
  for (Eigen::Index i = 0; i < 3; ++i) {
    if (!(covariance(i, i) > most[i])) continue;
    const double scale = std::sqrt(most[i] / covariance(i, i));
    covariance.row(i) *= scale;
    covariance.col(i) *= scale;
  }
}

// The drift is unknown again.
void forget_bias(Eigen::Matrix3d& covariance) {
  covariance.row(0).setZero();
  covariance.col(0).setZero();
  covariance(0, 0) = kFirstBiasRadps * kFirstBiasRadps;
}

double share_of(const Eigen::Vector3d& mean, double above_degc) {
  return mean[1] + mean[2] * above_degc;
}

double variance_of_share(const Eigen::Matrix3d& covariance, double above_degc) {
  return std::max(0.0, covariance(1, 1) + 2.0 * above_degc * covariance(1, 2) +
                           above_degc * above_degc * covariance(2, 2));
}

}  // namespace

ScaleFactor::Estimate::Estimate() noexcept : covariance(first_variances().asDiagonal()) {}

bool ScaleFactor::Estimate::makes_sense() const noexcept {
  if (!mean.allFinite() || !covariance.allFinite()) return false;
  for (Eigen::Index i = 0; i < 3; ++i) {
    if (covariance(i, i) < 0.0) return false;
    for (Eigen::Index j = 0; j < i; ++j) {
      const double largest = covariance(i, i) * covariance(j, j) * (1.0 + 1e-9);
      if (covariance(i, j) * covariance(i, j) > largest) return false;
    }
  }
  return true;
}

void ScaleFactor::Estimate::carry(core::StateArchive& archive) {
  archive.numbers(mean.data(), 3);
  archive.numbers(covariance.data(), 9);
  archive.require(makes_sense());
}

ScaleFactor::ScaleFactor(const RestGateOptions& rest) : rest_(rest) {}

void ScaleFactor::add(core::Axis axis, double measured_radps, double known_radps,
                      double known_variance_radps2) noexcept {
  Axis& own = axes_[index(axis)];
  ++own.samples;
  own.measured += measured_radps;
  own.difference += measured_radps - known_radps;
  own.known_variance = std::max(own.known_variance, known_variance_radps2);
}

void ScaleFactor::close(core::SensorTime now, std::optional<double> temperature_degc,
                        const core::PerAxis<Noise>& noise, bool may_learn) noexcept {
  for (const auto a : core::kAxes) {
    Axis& axis = axes_[index(a)];
    const auto n = static_cast<double>(std::exchange(axis.samples, 0));
    const double measured = std::exchange(axis.measured, 0.0) / n;
    const double difference = std::exchange(axis.difference, 0.0) / n;
    const double known_variance = std::exchange(axis.known_variance, 0.0);
    const double sigma = noise[index(a)].block_sigma_radps;
    if (!(n > 0.0) || !(sigma > 0.0) || !may_learn) continue;
    // Such a reference can't tell the largest error from none.
    if (std::abs(measured) > kLeastMotionRadps && known_variance > std::pow(kLargest * measured, 2))
      continue;
    learn(axis, {.time = now,
                 .above_degc = above_degc(temperature_degc),
                 .measured_radps = measured,
                 .difference_radps = difference,
                 .variance_radps2 = std::max(sigma * sigma, noise[index(a)].sample_variance / n) +
                                    known_variance + std::pow(kNotLinear * measured, 2),
                 .slew_radps2 = std::max(rest_.max_slew_radps2, rest_.noise_slew_per_s * sigma)});
  }
}

// One step of the filter, in Joseph's form; an outlier teaches nothing.
void ScaleFactor::learn(Axis& axis, const Block& block) noexcept {
  Eigen::Vector3d& mean = axis.learning.mean;
  Eigen::Matrix3d& covariance = axis.learning.covariance;
  if (axis.learned_at != core::kNever) {
    const double elapsed_s = core::seconds(block.time - axis.learned_at);
    covariance(0, 0) += std::pow(block.slew_radps2 * elapsed_s, 2);
    covariance(1, 1) += kAgeingPerS * std::max(0.0, elapsed_s);
    cap(covariance);
  }
  axis.learned_at = block.time;
  const Eigen::Vector3d row{1.0, block.measured_radps, block.measured_radps * block.above_degc};
  const Eigen::Vector3d spread = covariance * row;
  const double variance = row.dot(spread) + block.variance_radps2;
  const double innovation = block.difference_radps - row.dot(mean);
  const double square = innovation * innovation / variance;
  const bool fits = square <= kOutlierSigmas * kOutlierSigmas;  // false for NaN
  if (fits) {
    const Eigen::Vector3d gain = spread / variance;
    const Eigen::Matrix3d left = Eigen::Matrix3d::Identity() - gain * row.transpose();
    mean += gain * innovation;
    const Eigen::Matrix3d updated =
        left * covariance * left.transpose() + block.variance_radps2 * gain * gain.transpose();
    covariance = 0.5 * (updated + updated.transpose());
  }
  if (!axis.learning.makes_sense()) {
    axis = {};
    return;
  }
  if (!(std::abs(block.measured_radps) > kLeastMotionRadps)) return;
  ++axis.window.blocks;
  if (fits) {
    axis.window.squares += square;
  } else {
    ++axis.window.outliers;
  }
  if (axis.window.blocks == kWindowBlocks) judge_window(axis, block.above_degc);
}

void ScaleFactor::judge_window(Axis& axis, double above_degc) noexcept {
  const Window window = std::exchange(axis.window, {});
  const auto fitting = static_cast<double>(window.blocks - window.outliers);
  if (window.outliers <= kMostOutliers && window.squares <= kLargestMeanSquare * fitting &&
      std::abs(share_of(axis.learning.mean, above_degc)) <= kLargest) {
    axis.in_force = axis.learning;
    ++axis.windows;
    return;
  }
  ++axis.refused;
  axis.in_force.covariance *= kWidening;
  cap(axis.in_force.covariance);
  axis.learning = axis.in_force;
  forget_bias(axis.learning.covariance);
}

void ScaleFactor::restart() noexcept {
  for (Axis& axis : axes_) {
    Axis anew{};
    anew.windows = axis.windows;
    anew.refused = axis.refused;
    anew.in_force = axis.in_force;
    anew.learning = axis.in_force;
    forget_bias(anew.learning.covariance);
    axis = anew;
  }
}

double ScaleFactor::share(core::Axis axis, double above_degc) const noexcept {
  const Axis& own = axes_[index(axis)];
  if (own.windows == 0) return 0.0;
  return std::clamp(share_of(own.in_force.mean, above_degc), -kLargest, kLargest);
}

double ScaleFactor::error_radps(core::Axis axis, double rate_radps,
                                std::optional<double> temperature_degc) const noexcept {
  return share(axis, above_degc(temperature_degc)) * rate_radps;
}

double ScaleFactor::variance_radps2(core::Axis axis, double rate_radps,
                                    std::optional<double> temperature_degc) const noexcept {
  const Axis& own = axes_[index(axis)];
  if (own.windows == 0) return 0.0;
  return variance_of_share(own.in_force.covariance, above_degc(temperature_degc)) * rate_radps *
         rate_radps;
}

double ScaleFactor::as_measured(core::Axis axis, double true_rate_radps,
                                std::optional<double> temperature_degc) const noexcept {
  return true_rate_radps / (1.0 - share(axis, above_degc(temperature_degc)));
}

ScaleFactorState ScaleFactor::state(core::Axis axis,
                                    std::optional<double> temperature_degc) const noexcept {
  const Axis& own = axes_[index(axis)];
  ScaleFactorState state{.windows = own.windows, .refused = own.refused};
  if (own.windows == 0) return state;
  const double above = above_degc(temperature_degc);
  const double share = this->share(axis, above);
  const double change = 1.0 / ((1.0 - share) * (1.0 - share));  // ds / dc
  state.is_known = true;
  state.error = share / (1.0 - share);
  state.sigma = change * std::sqrt(variance_of_share(own.in_force.covariance, above));
  state.per_degc = change * own.in_force.mean[2];
  state.per_degc_sigma = change * std::sqrt(own.in_force.covariance(2, 2));
  return state;
}

}  // namespace zerodrift::compensation
