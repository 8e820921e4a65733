// SPDX-License-Identifier: Apache-2.0
#include "common/experts/kalman_bank.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

#include "common/experts/thermal_basis.h"

namespace zerodrift::experts {
namespace {

Labelled label(double time_s, double drift, double variance = 1.0, const Basis& basis = {}) {
  return {time_s, 5.0, drift, variance, basis};
}

// The same by scalars: one number for each filter, as a textbook has it.
TEST(KalmanBankGolden, ARandomWalkIsTheScalarFilterAveragedByItsEvidence) {
  constexpr std::array kWalks{1e-6, 1e-4, 1e-3, 1e-2, 1e-1, 1.0};
  std::array<double, kWalks.size()> mean{}, variance{}, log_weight{};
  KalmanBank bank({});
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  double truth = 0.0;
  for (int k = 0; k < 400; ++k) {
    truth += 0.1 * normal(random);
    const double measured = truth + normal(random);
    bank.learn(label(5.0 * (k + 1), measured));
    double sum = 0.0, expected = 0.0;
    for (std::size_t m = 0; m < kWalks.size(); ++m) {
      if (k == 0) {
        mean[m] = measured;
        variance[m] = 1e8 / (1e8 + 1.0);
      } else {
        const double prior = variance[m] + kWalks[m];
        const double innovation = measured - mean[m];
        log_weight[m] = 0.998 * log_weight[m] - 0.5 * std::log(prior + 1.0) -
                        0.5 * innovation * innovation / (prior + 1.0);
        mean[m] += prior / (prior + 1.0) * innovation;
        variance[m] = prior / (prior + 1.0);
      }
    }
    for (std::size_t m = 0; m < kWalks.size(); ++m) {
      const double weight = std::exp(log_weight[m] - log_weight[2]);
      sum += weight;
      expected += weight * mean[m];
    }
    ASSERT_NEAR(bank.forecast().level, expected / sum, 1e-6) << k;
  }
}

TEST(KalmanBankScenario, FindsTheCoefficientsOfADriftThatIsLinearInTemperature) {
  KalmanBank bank({.terms = {kTemperature, kTemperatureRate}});
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  for (int k = 1; k <= 2000; ++k) {
    const double t = 5.0 * k;
    Basis basis{};
    basis[kTemperature] = std::sin(t / 900.0);
    basis[kTemperatureRate] = std::cos(t / 900.0) / 3.0;
    bank.learn(label(
        t, 40.0 + 25.0 * basis[kTemperature] - 12.0 * basis[kTemperatureRate] + normal(random), 1.0,
        basis));
  }
  // Five standard errors of least squares with 2000 labels: 5 / sqrt(2000 / 2) and thrice that.
  EXPECT_NEAR(bank.forecast().coefficient[kTemperature], 25.0, 0.16);
  EXPECT_NEAR(bank.forecast().coefficient[kTemperatureRate], -12.0, 0.48);
}

// A label that says nothing must change nothing: the process noise over a span is that of its
// parts.
TEST(KalmanBankLaws, ALabelWithoutInformationChangesNoForecast) {
  for (const SlopeModel slopes : {SlopeModel::kNone, SlopeModel::kDamped}) {
    KalmanBank one({.terms = {kTemperature}, .slopes = slopes});
    KalmanBank two({.terms = {kTemperature}, .slopes = slopes});
    std::mt19937_64 random(11);
    std::normal_distribution<double> normal;
    double drift = 0.0;
    for (int k = 1; k <= 60; ++k) {
      Basis basis{};
      basis[kTemperature] = 0.01 * k;
      drift += 0.3 + 0.1 * normal(random);
      one.learn(label(60.0 * k, drift, 1.0, basis));
      two.learn(label(60.0 * k, drift, 1.0, basis));
      two.learn(label(60.0 * k + 25.0, 0.0, 1e18, basis));
    }
    // The forgetting of the evidence counts labels, so weights differ by some thousandths.
    Basis basis{};
    basis[kTemperature] = 0.61;
    EXPECT_NEAR(one.forecast().at(3720.0, basis), two.forecast().at(3720.0, basis), 0.02);
  }
}

// Rule: what a first label looks like, as one of a drift that runs after a cold start, doesn't
// decide how fast things are believed to change. Before: the errors stayed 2.5 times as large.
TEST(KalmanBankScenario, ALoudFirstLabelIsForgotten) {
  const auto rms_error = [](double first_variance) {
    KalmanBank bank({.terms = {kTemperature}});
    std::mt19937_64 random(11);
    std::normal_distribution<double> normal;
    double squares = 0.0;
    for (int k = 1; k <= 3000; ++k) {
      const double t = 5.0 * k;
      Basis basis{};
      basis[kTemperature] = std::sin(t / 900.0);
      const double truth = 20.0 * basis[kTemperature] + 3.0;
      if (k > 1000) squares += std::pow(bank.forecast().at(t, basis) - truth, 2);
      bank.learn(label(t, truth + normal(random), k == 1 ? first_variance : 1.0, basis));
    }
    return std::sqrt(squares / 2000.0);
  };
  const double usual = rms_error(1.0);
  for (const double first : {0.1, 1e4, 1e8}) EXPECT_LT(rms_error(first), 1.2 * usual) << first;
}

TEST(KalmanBankScenario, ATrendGoesOnAndDiesAway) {
  KalmanBank bank({.slopes = SlopeModel::kDamped});
  std::mt19937_64 random(13);
  std::normal_distribution<double> normal;
  for (int k = 1; k <= 400; ++k) bank.learn(label(5.0 * k, 0.5 * k + normal(random)));
  const LinearForecast forecast = bank.forecast();
  EXPECT_NEAR(forecast.at(2000.0 + 60.0, {}) - forecast.at(2000.0, {}), 6.0, 0.6);
  EXPECT_LT(forecast.at(2000.0 + 36'000.0, {}), forecast.level + 0.1 * 3300.0);
}

TEST(KalmanBankAbuse, GapsJumpsAndTermsThatNeverMoveLeaveNumbers) {
  KalmanBank bank({.terms = {kTemperature, kTemperatureRate, kTemperatureSquared, kTemperatureCubed,
                             kTemperatureTimesRate},
                   .slopes = SlopeModel::kDamped});
  double t = 0.0;
  std::mt19937_64 random(17);
  for (int k = 0; k < 5000; ++k) {
    t += k % 100 == 0 ? 1e5 : 1.0 + static_cast<double>(random() % 10);
    const double drift = k % 777 == 0 ? 1e6 : static_cast<double>(k % 7);
    Basis basis{};
    if (k > 2500) basis.fill(3.0 * std::sin(1e-3 * t));
    bank.learn(label(t, drift, k % 5 == 0 ? 1e-6 : 1.0, basis));
    ASSERT_TRUE(std::isfinite(bank.forecast().at(t + 1e4, basis))) << k;
    double sum = 0.0;
    for (const double weight : bank.weights()) sum += weight;
    ASSERT_NEAR(sum, 1.0, 1e-9);
  }
}

}  // namespace
}  // namespace zerodrift::experts
