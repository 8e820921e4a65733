// SPDX-License-Identifier: Apache-2.0
// The spectra of stochastic effects, against what the effects make and against the Allan variances
// of IEEE Std 952-1997, Annex C.
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>
#include <string>
#include <vector>

#include "common/core/units.h"
#include "common/twin/flicker_noise.h"
#include "tests/unit/twin/examples.h"
#include "tests/unit/twin/excited_inputs.h"

namespace zerodrift::twin {
namespace {

using std::numbers::pi;

const Parameters kDefaults{};

Density density_of(const std::string& kind, const Parameters& given, double interval_s) {
  const EffectDefinition& definition = *find_effect(kind);
  return definition.spectrum.density(complete_parameters(definition, given), interval_s);
}

// Allan variance at a cluster of m samples of a series with this density, by
//     int_0^(1/2dt) S(f) 2 sin^4(pi f m dt)/(m sin(pi f dt))² df,
// exact for sampled series. The midpoint rule is exact for trigonometric polynomials of fewer terms
// than points.
double allan_variance(const std::string& kind, const Parameters& given, int m, double interval_s,
                      int points = 1 << 14) {
  const double step_hz = 0.5 / interval_s / points;
  const Density density = density_of(kind, given, interval_s);
  double sum = 0.0;
  for (int i = 0; i < points; ++i) {
    const double frequency_hz = (i + 0.5) * step_hz;
    const double x = pi * frequency_hz * interval_s;
    const double transfer = 2.0 * std::pow(std::sin(m * x), 4.0) / std::pow(m * std::sin(x), 2.0);
    sum += density(frequency_hz) * transfer;
  }
  return sum * step_hz;
}

double markov_allan_variance(double variance, double correlation_s, double tau_s) {
  const double x = tau_s / correlation_s;
  return 2.0 * variance / x * (1.0 - (3.0 - 4.0 * std::exp(-x) + std::exp(-2.0 * x)) / (2.0 * x));
}

TEST(SpectrumLaws, AngleRandomWalkHasTheAllanVarianceOfItsCoefficient) {
  const double n = 0.01 * core::kRadPerDeg / 60.0;  // rad/√s
  const double found =
      allan_variance("angle_random_walk", {{"coefficient_deg_per_sqrt_h", 0.01}}, 100, 0.5);
  EXPECT_NEAR(found / (n * n / 50.0), 1.0, 1e-11);  // exact: rounding of 16384 terms
}

TEST(SpectrumLaws, QuantizationHasTheAllanVarianceOfItsStep) {
  const double q_rad = 0.2 * core::kRadPerDeg / 3600.0;
  const double found = allan_variance("quantization", {{"step_arcsec", 0.2}}, 100, 0.5);
  EXPECT_NEAR(found / (3.0 * q_rad * q_rad / 12.0 / 2500.0), 1.0, 1e-11);
}

TEST(SpectrumLaws, RateRandomWalkHasTheAllanVarianceOfItsCoefficient) {
  const double k = core::radps_from_deg_h(0.05) / 60.0;  // rad/s/√s
  const double found =
      allan_variance("rate_random_walk", {{"coefficient_deg_per_h_1_5", 0.05}}, 100, 0.5);
  // K² tau/3 (1 + 1/(2 m²)) for a sampled walk.
  EXPECT_NEAR(found / (k * k * 50.0 / 3.0 * (1.0 + 0.5e-4)), 1.0, 1e-10);
}

TEST(SpectrumLaws, MarkovAndTelegraphHaveTheAllanVarianceOfTheirCorrelation) {
  const double sigma = core::radps_from_deg_h(0.05);
  // Sampling adds about 1/m² (to a walk 1/(2 m²)): 1e-4.
  EXPECT_NEAR(allan_variance("markov", {{"sigma_deg_h", 0.05}, {"tau_s", 60.0}}, 113, 1.0) /
                  markov_allan_variance(sigma * sigma, 60.0, 113.0),
              1.0, 2e-4);
  // Up for 3/4 of the time, correlated over 75 s.
  const double amplitude = core::radps_from_deg_h(0.1);
  EXPECT_NEAR(
      allan_variance("telegraph", {{"amplitude_deg_h", 0.1}, {"up_s", 300.0}, {"down_s", 100.0}},
                     100, 1.0) /
          markov_allan_variance(amplitude * amplitude * 0.75 * 0.25, 75.0, 100.0),
      1.0, 2e-4);
}

TEST(SpectrumLaws, BiasInstabilityIsFlickerOfItsCoefficient) {
  const double b = core::radps_from_deg_h(0.05);
  const double found = allan_variance("bias_instability",
                                      {{"coefficient_deg_h", 0.05}, {"longest_correlation_s", 1e4}},
                                      100, 1.0, 1 << 16);
  // The deviation is within 2 % of flat (flicker_noise.h), hence the variance within 4 %.
  EXPECT_NEAR(found / (2.0 * std::numbers::ln2 / pi * b * b), 1.0, 0.04);
  const FlickerNoiseOptions options{.bias_instability = 1.0};
  for (const double interval_s : {0.005, 1.0}) {
    const FlickerDensity density(options, interval_s);
    const double shortest_s = std::max(150.0 * options.shortest_correlation_s, 250.0 * interval_s);
    for (double period_s = shortest_s; period_s < options.longest_correlation_s / 4.0;
         period_s *= 1.3) {
      EXPECT_NEAR(density(1.0 / period_s) * pi / period_s, 1.0, 0.02)
          << period_s << " s at an interval of " << interval_s << " s";
    }
  }
}

// In place, length a power of two (Cooley & Tukey 1965).
void fourier_transform(std::vector<std::complex<double>>& values) {
  const std::size_t n = values.size();
  for (std::size_t i = 1, j = 0; i < n; ++i) {
    std::size_t bit = n >> 1U;
    for (; (j & bit) != 0; bit >>= 1U) j ^= bit;
    j ^= bit;
    if (i < j) std::swap(values[i], values[j]);
  }
  for (std::size_t length = 2; length <= n; length *= 2) {
    const std::complex<double> turn = std::polar(1.0, -2.0 * pi / static_cast<double>(length));
    for (std::size_t start = 0; start < n; start += length) {
      std::complex<double> w = 1.0;
      for (std::size_t k = start; k < start + length / 2; ++k, w *= turn) {
        const auto odd = values[k + length / 2] * w;
        values[k + length / 2] = values[k] - odd;
        values[k] += odd;
      }
    }
  }
}

// One-sided Hann periodogram, bins 1 to n/2 - 1 at k/(n dt).
std::vector<double> periodogram(const std::vector<double>& series, double interval_s) {
  const std::size_t n = series.size();
  std::vector<std::complex<double>> values(n);
  for (std::size_t i = 0; i < n; ++i) {
    const double angle = 2.0 * pi * static_cast<double>(i) / static_cast<double>(n);
    values[i] = series[i] * (1.0 - std::cos(angle));
  }
  fourier_transform(values);
  std::vector<double> density;
  for (std::size_t k = 1; k < n / 2; ++k) {
    // The mean square of the window is 3/2.
    density.push_back(2.0 * interval_s * std::norm(values[k]) / (1.5 * static_cast<double>(n)));
  }
  return density;
}

class StochasticEffects : public testing::TestWithParam<std::string> {};

INSTANTIATE_TEST_SUITE_P(Catalogue, StochasticEffects,
                         testing::Values("quantization", "angle_random_walk", "bias_instability",
                                         "rate_random_walk", "markov", "telegraph"),
                         [](const auto& test) { return test.param; });

TEST_P(StochasticEffects, MakeSeriesOfTheirSpectrum) {
  constexpr std::size_t kSamples = 1 << 17;
  constexpr double kInterval = 1.0;
  const auto effect = make_effect({.kind = GetParam()}, kInterval, NoiseStream(5, GetParam()));
  const NoiseStream noise(9, "rate");
  std::vector<double> series;
  EffectInputs inputs;
  for (std::size_t i = 0; i < kSamples; ++i) {
    inputs.sample = i;
    // For quantization: a rate of many steps a sample makes its errors white and uniform.
    inputs.rate_radps = core::radps_from_deg_h(10.0) * noise.gaussian(i);
    series.push_back(effect->step(inputs));
  }
  const auto found = periodogram(series, kInterval);
  const Density density = density_of(GetParam(), kDefaults, kInterval);
  // Octaves from 2048 bins of 7.6e-6 Hz up. Each bin's relative deviation is 1 and a Hann window
  // leaves about half of them independent: √(2/2048) = 3 %, less above; 5 sigma.
  for (std::size_t first = 2048; first <= 32768; first *= 2) {
    double ratio = 0.0;
    const std::size_t end = std::min(2 * first, found.size());
    for (std::size_t k = first; k < end; ++k) {
      const double frequency_hz =
          static_cast<double>(k + 1) / (static_cast<double>(kSamples) * kInterval);
      ratio += found[k] / density(frequency_hz);
    }
    const double n = static_cast<double>(end - first);
    EXPECT_NEAR(ratio / n, 1.0, 5.0 * std::sqrt(2.0 / n)) << "from bin " << first;
  }
}

}  // namespace
}  // namespace zerodrift::twin
