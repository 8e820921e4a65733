// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/gap.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "common/allan/rolling_allan.h"
#include "common/core/require.h"
#include "common/twin/effect_catalogue.h"

namespace zerodrift::diagnosis {
namespace {

// sin(m x) / (m sin x): response of a mean over m values.
double mean_response(double x, double m) {
  const double denominator = m * std::sin(x);
  return denominator == 0.0 ? 1.0 : std::sin(m * x) / denominator;
}

double half_phase(std::size_t k, std::size_t n) {
  return std::numbers::pi * static_cast<double>(k) / (2.0 * static_cast<double>(n));
}

std::vector<allan::AllanPoint> allan_points(std::span<const double> values,
                                            std::span<const std::uint8_t> valid,
                                            double interval_s) {
  constexpr double kClustersAtLeast = 10.0;
  const double duration_s = interval_s * static_cast<double>(values.size());
  allan::RollingAllanOptions options;
  options.sample_interval_s = interval_s;
  options.window_s = duration_s;
  options.panes = 1;
  options.longest_tau_s = std::max(interval_s, duration_s / kClustersAtLeast);
  allan::RollingAllan statistics(options);
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (valid[i] != 0) {
      statistics.add(values[i]);
    } else {
      statistics.gap(1);
    }
  }
  return statistics.points(allan::Span::kSinceStart);
}

std::vector<double> twin_curve(const TwinWaveform& twin, std::span<const std::uint8_t> valid,
                               double interval_s, const std::vector<allan::AllanPoint>& measured) {
  const auto drift = allan_points(twin.drift_radps, valid, interval_s);
  std::vector<double> curve;
  for (std::size_t i = 0; i < measured.size(); ++i) {
    const auto m = static_cast<std::size_t>(std::llround(measured[i].tau_s / interval_s));
    const double of_drift = i < drift.size() ? drift[i].deviation_radps : 0.0;
    curve.push_back(
        std::sqrt(of_drift * of_drift + allan_variance_of_noise(twin.noise_dct_variances, m)));
  }
  return curve;
}

double mean_log_distance(const std::vector<double>& measured, const std::vector<double>& twin) {
  double sum = 0.0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < measured.size(); ++i) {
    if (!(measured[i] > 0.0 && twin[i] > 0.0)) continue;
    sum += std::abs(std::log(measured[i] / twin[i]));
    ++count;
  }
  return count == 0 ? std::numeric_limits<double>::quiet_NaN() : sum / static_cast<double>(count);
}

}  // namespace

BlockMeans block_means(std::span<const double> values, std::span<const std::uint8_t> valid,
                       std::size_t block) {
  core::require(values.size() == valid.size() && block >= 1,
                "block means need a block of one sample and the validity of each");
  BlockMeans means;
  for (std::size_t begin = 0; begin + block <= values.size(); begin += block) {
    double sum = 0.0;
    std::size_t count = 0;
    for (std::size_t i = begin; i < begin + block; ++i) {
      if (valid[i] == 0) continue;
      sum += values[i];
      ++count;
    }
    if (2 * count < block || count == 0) continue;
    means.centre.push_back(static_cast<double>(begin) + 0.5 * static_cast<double>(block));
    means.mean.push_back(sum / static_cast<double>(count));
  }
  return means;
}

BlockRms rms_of_block_means(std::span<const double> values, std::span<const std::uint8_t> valid,
                            std::size_t block) {
  const std::vector<double> means = block_means(values, valid, block).mean;
  if (means.size() < 2) return {};
  const auto n = static_cast<double>(means.size());
  const double mean = std::accumulate(means.begin(), means.end(), 0.0) / n;
  double squares = 0.0;
  for (const double value : means) squares += (value - mean) * (value - mean);
  return {std::sqrt(squares / n + mean * mean), std::sqrt(squares / n)};
}

double expected_rms_of_block_means(std::span<const double> dct_variances, std::size_t block) {
  const std::size_t n = dct_variances.size();
  double sum = 0.0;
  for (std::size_t k = 1; k < n; ++k) {
    const double response = mean_response(half_phase(k, n), static_cast<double>(block));
    sum += dct_variances[k] * response * response;
  }
  return n == 0 ? 0.0 : std::sqrt(sum / static_cast<double>(n));
}

bool stands_out(double rms_radps, double noise_rms_radps) {
  return noise_rms_radps > 0.0 && rms_radps > 2.0 * noise_rms_radps;
}

double allan_variance_of_noise(std::span<const double> dct_variances, std::size_t cluster_size) {
  const std::size_t n = dct_variances.size();
  const auto m = static_cast<double>(cluster_size);
  double sum = 0.0;
  for (std::size_t k = 1; k < n; ++k) {
    const double x = half_phase(k, n);
    const double sine = std::sin(m * x);
    const double response = mean_response(x, m) * sine;
    sum += dct_variances[k] * response * response;
  }
  return n == 0 ? 0.0 : 2.0 * sum / static_cast<double>(n);
}

std::vector<double> model_noise(const twin::Model& model, core::Axis axis, double interval_s,
                                std::size_t size) {
  std::vector<double> variances(size, 0.0);
  for (const twin::EffectSpec& spec : model.effects) {
    const twin::EffectDefinition* definition = twin::find_effect(spec.kind);
    if (definition == nullptr || spec.axis != axis || spec.parameters.empty()) continue;
    if (definition->family != twin::Family::kStochastic || !definition->spectrum.density) continue;
    const twin::Density density = definition->spectrum.density(
        twin::complete_parameters(*definition, spec.parameters), interval_s);
    for (std::size_t k = 1; k < size; ++k) {
      const double frequency_hz =
          static_cast<double>(k) / (2.0 * static_cast<double>(size) * interval_s);
      variances[k] += density(frequency_hz) / (2.0 * interval_s);
    }
  }
  return variances;
}

AllanCurves allan_curves(std::span<const double> measured_radps,
                         std::span<const std::uint8_t> valid, double interval_s,
                         const TwinWaveform& before, const TwinWaveform& after) {
  const auto measured = allan_points(measured_radps, valid, interval_s);
  AllanCurves curves;
  for (const allan::AllanPoint& point : measured) {
    curves.tau_s.push_back(point.tau_s);
    curves.measured_radps.push_back(point.deviation_radps);
  }
  curves.before_radps = twin_curve(before, valid, interval_s, measured);
  curves.after_radps = twin_curve(after, valid, interval_s, measured);
  return curves;
}

AllanDistance allan_distance(const AllanCurves& curves) {
  return {mean_log_distance(curves.measured_radps, curves.before_radps),
          mean_log_distance(curves.measured_radps, curves.after_radps)};
}

}  // namespace zerodrift::diagnosis
