// SPDX-License-Identifier: Apache-2.0
#include "common/regression/schemes/krls_t.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <stdexcept>

#include "common/regression/schemes/persistence.h"
#include "tests/support/wrong_key.h"
#include "tests/unit/regression/schemes/drift_records.h"

namespace zerodrift::regression::testing {
namespace {

constexpr std::uint64_t kSeed = 8;

double kernel_of(const Features& a, const Features& b, double gamma) {
  return std::exp(-gamma * ((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1])));
}

// Gaussian process regression with the scheme's own offset, signal and noise.
DriftPrediction dense_prediction(const Record& record, const KrlsT& scheme, double gamma,
                                 const Features& probe) {
  const auto count = static_cast<Eigen::Index>(record.size());
  const auto& prior = scheme.prior();
  Eigen::MatrixXd covariance(count, count);
  Eigen::VectorXd target(count), to_probe(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Features& x = record.features[static_cast<std::size_t>(i)];
    for (Eigen::Index j = 0; j < count; ++j) {
      covariance(i, j) =
          prior.signal_variance * kernel_of(x, record.features[static_cast<std::size_t>(j)], gamma);
    }
    covariance(i, i) += record.label_variance + prior.extra_noise_variance;
    to_probe(i) = prior.signal_variance * kernel_of(x, probe, gamma);
    target(i) = record.labels[static_cast<std::size_t>(i)] - prior.offset;
  }
  const Eigen::LLT<Eigen::MatrixXd> solver(covariance);
  return {prior.offset + to_probe.dot(solver.solve(target)),
          prior.signal_variance - to_probe.dot(solver.solve(to_probe))};
}

Record scattered_record(std::size_t count) {
  Gaussian gaussian(kSeed);
  Record record;
  record.label_variance = 0.01;
  for (std::size_t i = 0; i < count; ++i) {
    record.features.push_back({4.0 * gaussian.uniform() - 2.0, 4.0 * gaussian.uniform() - 2.0});
    record.labels.push_back(smooth_drift(record.features.back()) + 0.1 * gaussian.next());
  }
  return record;
}

// Far enough from each other that all of them join the basis.
Record spread_record() {
  Gaussian gaussian(kSeed);
  Record record;
  record.label_variance = 0.01;
  for (int i = 0; i < 144; ++i) {
    const double column = i % 12, row = i / 12;
    record.features.push_back({(column + 0.4 * gaussian.uniform()) / 3.0 - 2.0,
                               (row + 0.4 * gaussian.uniform()) / 3.0 - 2.0});
    record.labels.push_back(smooth_drift(record.features.back()) + 0.1 * gaussian.next());
  }
  return record;
}

TEST(KrlsTLaws, WithoutForgettingAndWithRoomForAllItIsGaussianProcessRegression) {
  const Record record = spread_record();
  const KrlsTOptions options{
      .initial = {.labels = 50}, .budget = 200, .gamma = 10.0, .lambda = 1.0};
  KrlsT scheme(options);
  for (std::size_t i = 0; i < record.size(); ++i) scheme.learn(record.label(i));
  ASSERT_EQ(scheme.basis_size(), record.size());
  Gaussian gaussian(kSeed + 1);
  for (int k = 0; k < 100; ++k) {
    const Features probe{4.0 * gaussian.uniform() - 2.0, 4.0 * gaussian.uniform() - 2.0};
    const DriftPrediction dense = dense_prediction(record, scheme, options.gamma, probe);
    const DriftPrediction tracked = scheme.predict(1e3, probe);
    // The nugget, 1e-8 of the signal, beside a noise of the order of 1e-2 of it: 1e-6.
    EXPECT_NEAR(tracked.drift, dense.drift, 1e-6);
    EXPECT_NEAR(tracked.variance, dense.variance, 1e-6);
  }
}

// What leaving near-copies out of the basis costs. A sample that doesn't join leaves less than 1e-5
// of the signal's variance out, and could have told the probe's own novelty, at most 1, no more
// than 1e-5 / c, c the noise over the signal; 150 of them 1.5e-3 / c.
TEST(KrlsTLaws, NearCopiesLeftOutOfTheBasisCostLittle) {
  const Record record = scattered_record(150);
  const KrlsTOptions options{.initial = {.labels = 50}, .budget = 150, .gamma = 3.0, .lambda = 1.0};
  KrlsT scheme(options);
  for (std::size_t i = 0; i < record.size(); ++i) scheme.learn(record.label(i));
  ASSERT_LT(scheme.basis_size(), record.size());
  const auto& prior = scheme.prior();
  const double noise = record.label_variance + prior.extra_noise_variance;
  Gaussian gaussian(kSeed + 1);
  for (int k = 0; k < 100; ++k) {
    const Features probe{4.0 * gaussian.uniform() - 2.0, 4.0 * gaussian.uniform() - 2.0};
    const double dense = dense_prediction(record, scheme, options.gamma, probe).variance;
    EXPECT_NEAR(scheme.predict(1e3, probe).variance, dense,
                1.5e-3 * prior.signal_variance * prior.signal_variance / noise);
  }
}

TEST(KrlsTLaws, WithForgettingItReturnsToThePrior) {
  const Record record = scattered_record(100);
  KrlsT scheme({.initial = {.labels = 100}, .budget = 100, .gamma = 3.0, .lambda = 0.9});
  for (std::size_t i = 0; i < 100; ++i) scheme.learn(record.label(i));
  const Features far{30.0, 30.0};
  for (int i = 0; i < 400; ++i) {
    scheme.learn(
        {.time_s = 101.0 + i, .duration_s = 1.0, .features = far, .drift = 5.0, .variance = 0.01});
  }
  // 0.9^400 = 5e-19 of what was known is left; the far samples say nothing about here.
  const DriftPrediction here = scheme.predict(1e3, Features{0.0, 0.0});
  EXPECT_NEAR(here.drift, scheme.prior().offset, 1e-6);
  EXPECT_NEAR(here.variance, scheme.prior().signal_variance, 1e-6);
  // Without a label's noise beyond what 10 labels' memory averages, it stands at the far value.
  EXPECT_NEAR(scheme.predict(1e3, far).drift, 5.0, 0.5);
}

TEST(KrlsTLaws, ALabelOfLessNoiseCountsForMore) {
  const Features x{0.0, 0.0};
  const auto after = [&](double variance) {
    Record record = scattered_record(60);
    KrlsT scheme({.initial = {.labels = 60}});
    for (std::size_t i = 0; i < 60; ++i) scheme.learn(record.label(i));
    const double extra = scheme.prior().extra_noise_variance;
    scheme.learn(
        {.time_s = 100.0, .duration_s = 1.0, .features = x, .drift = 10.0, .variance = variance});
    EXPECT_GE(extra, 0.0);
    return scheme.predict(101.0, x).drift;
  };
  EXPECT_GT(after(1e-4), after(1.0) + 0.1);
}

TEST(KrlsTScenario, FollowsTheHeatCoolRecordBetterThanPersistence) {
  const Record record = heat_cool_record(9000, 0.0003, kSeed);
  for (const std::size_t delay : {1u, 50u}) {
    KrlsT scheme;
    Persistence persistence;
    const double tracked = rms_error(record, predict_all(scheme, record, delay), 3000);
    const double held = rms_error(record, predict_all(persistence, record, delay), 3000);
    EXPECT_LT(tracked, held / 3.0) << "delay " << delay;
    EXPECT_LE(scheme.basis_size(), 60u);
  }
}

// Stuck, quantised and jumping inputs, 1e5 labels each: no growth, no loss of definiteness.
TEST(KrlsTAbuse, StaysSoundOverAHundredThousandHardLabels) {
  for (const double lambda : {1.0, 0.999}) {
    for (const int kind : {0, 1, 2}) {
      KrlsT scheme({.budget = 20, .gamma = 3.0, .lambda = lambda});
      Gaussian gaussian(kSeed);
      for (std::size_t i = 0; i < 100000; ++i) {
        Features x = features_at(i);
        if (kind == 0) x = {0.5, 0.5};
        if (kind == 1) x = {std::round(4.0 * x[0]) / 4.0, std::round(4.0 * x[1]) / 4.0};
        if (kind == 2) x = {3.0 * gaussian.next(), 3.0 * gaussian.next()};
        const double drift = kind == 1 ? std::round(100.0 * smooth_drift(x)) / 100.0
                                       : std::sin(x[0]) + 0.03 * gaussian.next();
        scheme.learn({.time_s = static_cast<double>(i + 1),
                      .duration_s = 1.0,
                      .features = x,
                      .drift = drift,
                      .variance = 1e-6});
        if (i % 1000 != 999) continue;
        const DriftPrediction here = scheme.predict(1e9, x);
        ASSERT_LE(scheme.basis_size(), 20u);
        ASSERT_TRUE(std::isfinite(here.drift) && std::fabs(here.drift) < 5.0)
            << "kind " << kind << " label " << i << ": " << here.drift;
        // Never more than the prior, by more than the nugget.
        ASSERT_GE(here.variance, 0.0);
        ASSERT_LE(here.variance, 1.000001 * scheme.prior().signal_variance);
      }
    }
  }
}

TEST(KrlsTAbuse, KnowsNothingBeforeLearningAndTheMeanDuringTheInitialSet) {
  KrlsT scheme;
  const Features x{0.5, 0.5};
  EXPECT_EQ(scheme.predict(0.0, x).drift, 0.0);
  EXPECT_LT(scheme.predict(0.0, x).variance, 0.0);
  scheme.learn({.time_s = 1.0, .duration_s = 1.0, .features = x, .drift = 2.0, .variance = 1e-4});
  EXPECT_EQ(scheme.predict(2.0, x).drift, 2.0);
  EXPECT_LT(scheme.predict(2.0, x).variance, 0.0);
}

TEST(KrlsTAbuse, ValidateNamesTheWrongKey) {
  const auto key_of = zerodrift::testing::wrong_key<KrlsT, KrlsTOptions>;
  EXPECT_FALSE(KrlsTOptions{}.validate());
  EXPECT_EQ(key_of({.initial = {.labels = 0}}), "initial.labels");
  EXPECT_EQ(key_of({.budget = 0}), "budget");
  EXPECT_EQ(key_of({.gamma = 0.0}), "gamma");
  EXPECT_EQ(key_of({.lambda = 0.0}), "lambda");
  EXPECT_EQ(key_of({.lambda = 1.1}), "lambda");
}

}  // namespace
}  // namespace zerodrift::regression::testing
