// SPDX-License-Identifier: Apache-2.0
// How well both rate estimators do on a thermometer of 0.0625 °C resolution (a common 12-bit one),
// against the truth.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <numbers>
#include <random>
#include <string>

#include "common/thermal/local_polynomial_rate.h"
#include "common/thermal/sliding_mean_rate.h"

namespace zerodrift::thermal {
namespace {

constexpr double kResolution = 0.0625;  // °C
constexpr double kSampleRateHz = 200.0;
constexpr double kWindowS = 60.0;
constexpr std::int64_t kSamples = 200 * 3600;

double quantised(double temperature_degc) {
  return kResolution * std::round(temperature_degc / kResolution);
}

// Chamber from -15 to 50 °C, the probe following with one time constant, as in the paper's
// experiment.
struct ChamberStep {
  double time_constant_s;
  double temperature_degc(double t) const { return 50.0 - 65.0 * std::exp(-t / time_constant_s); }
  double rate_degc_per_s(double t) const {
    return 65.0 / time_constant_s * std::exp(-t / time_constant_s);
  }
};

struct RateErrors {
  double sliding_now;     // rms against the rate at the newest reading, °C/s
  double sliding_at_lag;  // rms against the rate that it belongs to
  double linear_now;
  double quadratic_now;
};

struct SquareMean {
  double sum = 0.0;
  double n = 0.0;
  void add(double error) {
    sum += error * error;
    n += 1.0;
  }
  double root() const { return std::sqrt(sum / n); }
};

RateErrors measure(const ChamberStep& truth, double noise_degc, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0.0, 1.0);
  SlidingMeanRate sliding({});
  LocalPolynomialRate linear({.degree = 1});
  LocalPolynomialRate quadratic({.degree = 2});
  SquareMean sliding_now, sliding_at_lag, linear_now, quadratic_now;
  for (std::int64_t i = 0; i < kSamples; ++i) {
    const double t = static_cast<double>(i) / kSampleRateHz;
    const double reading = quantised(truth.temperature_degc(t) + noise_degc * noise(random));
    sliding.add(core::from_seconds(t), reading);
    linear.add(core::from_seconds(t), reading);
    quadratic.add(core::from_seconds(t), reading);
    if (i < 12'000 || i % 211 != 0) continue;
    const double now = truth.rate_degc_per_s(t);
    sliding_now.add(*sliding.rate_degc_per_s() - now);
    sliding_at_lag.add(*sliding.rate_degc_per_s() - truth.rate_degc_per_s(t - sliding.lag_s()));
    linear_now.add(*linear.rate_degc_per_s() - now);
    quadratic_now.add(*quadratic.rate_degc_per_s() - now);
  }
  return {sliding_now.root(), sliding_at_lag.root(), linear_now.root(), quadratic_now.root()};
}

void state(const std::string& name, const RateErrors& errors) {
  const auto row = [&](const char* estimator, double error_degc_per_s) {
    std::printf("  %-10s %-34s rms %.5f degC/min\n", name.c_str(), estimator,
                60.0 * error_degc_per_s);
    ::testing::Test::RecordProperty(name + "_" + estimator,
                                    std::to_string(60.0 * error_degc_per_s));
  };
  row("sliding mean, rate now", errors.sliding_now);
  row("sliding mean, rate 30 s ago", errors.sliding_at_lag);
  row("polynomial degree 1, rate now", errors.linear_now);
  row("polynomial degree 2, rate now", errors.quadratic_now);
}

TEST(QuantisedThermometerScenario, DitheredReadingsGiveTheNoiseThatTheGainsPredict) {
  constexpr std::uint64_t kSeed = 625;
  SCOPED_TRACE(kSeed);
  constexpr double kNoise = 0.05;
  const RateErrors errors = measure({.time_constant_s = 3000.0}, kNoise, kSeed);
  state("dithered", errors);

  // Noise near the resolution makes the quantisation error white and uniform: variance q²/12 beside
  // the noise's.
  const double sigma = std::hypot(kNoise, kResolution / std::sqrt(12.0));
  const double n = kWindowS * kSampleRateHz;
  // 3350 rates 1.055 s apart: the sliding mean's are independent of each other but for pairs 60 s
  // apart, 5 sigma of the rms = 5 / sqrt(2 * 3350 / 2) = 9 %.
  EXPECT_NEAR(errors.sliding_at_lag / (std::numbers::sqrt2 * sigma / kWindowS), 1.0, 0.09);
  // The polynomial's errors are alike over some 10 s (the end lobe of its weights): 350 independent
  // ones, 5 / sqrt(2 * 350) = 19 %; the cubic term of the truth adds T''' W² / 20 <= 4e-7 °C/s, 1 %
  // of the noise.
  EXPECT_NEAR(errors.quadratic_now / (std::sqrt(192.0 / n) * sigma / kWindowS), 1.0, 0.2);
  // What the paper's lag costs on this profile: T'' lag at the start, 65 / 3000² * 30 s = 2.2e-4
  // °C/s, decaying.
  EXPECT_GT(errors.linear_now, errors.quadratic_now);
}

TEST(QuantisedThermometerScenario, UnditheredReadingsStayWithinTheStepsTheyHide) {
  const RateErrors errors = measure({.time_constant_s = 3000.0}, 0.0, 0);
  state("undithered", errors);

  // Without noise each reading is off by at most q / 2. Sliding mean: two independent uniform
  // errors, rms q / sqrt(6). Ramps beat with the sampling, so 20 % is left for what is not uniform.
  EXPECT_NEAR(errors.sliding_at_lag / (kResolution / std::sqrt(6.0) / kWindowS), 1.0, 0.2);
  // The polynomial weighs readings by (36 + 192 x + 180 x²) / W, whose absolute integral is 11.8 /
  // W: the worst case is q / 2 * 11.8 / 60 s. A sawtooth is far from the worst case.
  EXPECT_LT(errors.quadratic_now, 0.5 * kResolution * 11.8 / kWindowS);
}

TEST(QuantisedThermometerScenario, OnAQuickChamberTheLagCostsMoreThanTheZeroLagEstimatorsNoise) {
  constexpr std::uint64_t kSeed = 626;
  SCOPED_TRACE(kSeed);
  const RateErrors errors = measure({.time_constant_s = 600.0}, 0.05, kSeed);
  state("quick", errors);

  // Half a window of T'' = 65 / 600² °C/s² exp(-t / 600), rms over the hour from 60 s on: sqrt(mean
  // exp(-2t / 600)) = sqrt(300 * exp(-0.2) / 3540) = 0.263, so 30 * 1.8e-4 * 0.263 = 1.43e-3 °C/s
  // for either method that lags.
  constexpr double kLagError = 30.0 * 65.0 / (600.0 * 600.0) * 0.263;
  EXPECT_NEAR(errors.linear_now / kLagError, 1.0, 0.05);  // next order: lag / (2 * 600 s) = 2.5 %
  EXPECT_GT(errors.sliding_now, kLagError);
  // Noise of 1.1e-4 °C/s and T''' W² / 20 = 5e-5 °C/s at the start: a tenth of the lag's error.
  EXPECT_LT(errors.quadratic_now, 0.15 * kLagError);
}

}  // namespace
}  // namespace zerodrift::thermal
