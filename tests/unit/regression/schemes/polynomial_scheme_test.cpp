// SPDX-License-Identifier: Apache-2.0
#include "common/regression/schemes/polynomial_scheme.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <stdexcept>

#include "tests/support/wrong_key.h"
#include "tests/unit/regression/schemes/drift_records.h"

namespace zerodrift::regression::testing {
namespace {

constexpr std::uint64_t kSeed = 5;
constexpr int kTerms = PolynomialScheme::kTerms;

Eigen::Matrix<double, 1, kTerms> row_of(const Features& x) {
  Eigen::Matrix<double, 1, kTerms> row;
  row << 1.0, x[0], x[0] * x[0], x[0] * x[0] * x[0], x[1], x[0] * x[1];
  return row;
}

// The prior as kTerms more equations: coefficient = 0 +- deviation.
struct Batch {
  Eigen::VectorXd coefficients;
  Eigen::MatrixXd covariance;  // times the mean square of the residuals
};
Batch batch_solution(const std::vector<DriftLabel>& labels, const PolynomialOptions& options) {
  const auto count = static_cast<Eigen::Index>(labels.size());
  Eigen::MatrixXd system = Eigen::MatrixXd::Zero(count + kTerms, kTerms);
  Eigen::VectorXd target = Eigen::VectorXd::Zero(count + kTerms);
  const double prior = 1.0 / (options.prior_deviation * std::sqrt(labels.front().variance));
  for (Eigen::Index i = 0; i < kTerms; ++i) system(count + i, i) = i == 0 ? prior / 1e6 : prior;
  double age = 1.0;  // weight of what is older
  for (Eigen::Index i = count; i-- > 0;) {
    const DriftLabel& label = labels[static_cast<std::size_t>(i)];
    const double weight = std::sqrt(age / label.variance);
    system.row(i) = weight * row_of({label.features[0], label.features[1]});
    target(i) = weight * label.drift;
    age *= options.forgetting;
  }
  system.bottomRows(kTerms) *= std::sqrt(age);
  const Eigen::VectorXd solution = system.colPivHouseholderQr().solve(target);
  double weight = 0.0;
  for (std::size_t i = 0; i < labels.size(); ++i) weight = options.forgetting * weight + 1.0;
  const double misfit = (system * solution - target).squaredNorm() / (weight - kTerms);
  return {solution, misfit * (system.transpose() * system).inverse()};
}

TEST(PolynomialLaws, RecursiveEqualsBatchLeastSquares) {
  for (const double forgetting : {1.0, 0.99}) {
    const PolynomialOptions options{.forgetting = forgetting};
    PolynomialScheme scheme(options);
    Gaussian gaussian(kSeed);
    std::vector<Features> features;
    for (int i = 0; i < 300; ++i)
      features.push_back({2.0 * gaussian.uniform() - 1.0, 2.0 * gaussian.uniform() - 1.0});
    std::vector<DriftLabel> labels;
    for (std::size_t i = 0; i < features.size(); ++i) {
      const double variance = i % 3 == 0 ? 4e-4 : 1e-4;
      labels.push_back({.time_s = static_cast<double>(i + 1),
                        .duration_s = 1.0,
                        .features = features[i],
                        .drift = smooth_drift(features[i]) + 0.01 * gaussian.next(),
                        .variance = variance});
      scheme.learn(labels.back());
      if (i != 9 && i != 50 && i != 299) continue;
      const Batch batch = batch_solution(labels, options);
      // Both solve by orthogonal transformations. Rounding 2e-16 times the condition of the ten
      // labels' system, of the order of 1e4; two digits to spare.
      EXPECT_LT((scheme.coefficients() - batch.coefficients).norm(), 1e-10) << "label " << i;
      const Features probe{0.3, -0.4};
      const double variance_here = row_of(probe) * batch.covariance * row_of(probe).transpose();
      // The batch's covariance is by inverting the normal equations: the condition's square.
      EXPECT_NEAR(scheme.predict(1e3, probe).variance / variance_here, 1.0, 1e-6) << "label " << i;
    }
  }
}

TEST(PolynomialScenario, AKnownCubicIsRecovered) {
  Eigen::Matrix<double, kTerms, 1> truth;
  truth << 0.5, -0.3, 0.2, 0.1, 0.25, -0.15;
  constexpr double kNoise = 0.01;
  PolynomialScheme scheme;
  Gaussian gaussian(kSeed);
  Eigen::Matrix<double, kTerms, kTerms> information;
  information.setZero();
  for (std::size_t i = 0; i < 3000; ++i) {
    const Features x = features_at(i);
    information += row_of(x).transpose() * row_of(x) / (kNoise * kNoise);
    scheme.learn({.time_s = static_cast<double>(i + 1),
                  .duration_s = 1.0,
                  .features = x,
                  .drift = row_of(x) * truth + kNoise * gaussian.next(),
                  .variance = kNoise * kNoise});
  }
  const auto covariance = information.inverse();
  for (int i = 0; i < kTerms; ++i) {
    // 5 sigma.
    EXPECT_NEAR(scheme.coefficients()(i), truth(i), 5.0 * std::sqrt(covariance(i, i))) << i;
  }
  const Features probe{0.2, 0.1};
  const double expected = row_of(probe) * covariance * row_of(probe).transpose();
  // The mean square residual of 3000 labels has a standard error of sqrt(2/3000) = 2.6 %; 5 sigma.
  EXPECT_NEAR(scheme.predict(4000.0, probe).variance / expected, 1.0, 0.13);
}

// Why the option exists. The cubic itself misses 0.02 of this drift; what wanders besides in 12000
// labels, 0.002 sqrt(12000) = 0.2, is followed with a memory of 1000 labels and not with all.
TEST(PolynomialScenario, ForgettingFollowsAWanderingDrift) {
  for (const std::uint64_t seed : {kSeed, kSeed + 1, kSeed + 2}) {
    const Record record = heat_cool_record(12000, 0.002, seed);
    PolynomialScheme remembering, forgetting({.forgetting = 0.999});
    const double kept = rms_error(record, predict_all(remembering, record, 1), 4000);
    const double forgot = rms_error(record, predict_all(forgetting, record, 1), 4000);
    EXPECT_LT(forgot, 0.75 * kept) << "seed " << seed;
  }
}

TEST(PolynomialAbuse, OneTemperatureForeverGivesTheMeanAndNothingWild) {
  PolynomialScheme scheme;
  const Features x{0.7, 0.0};
  EXPECT_EQ(scheme.predict(0.0, x).drift, 0.0);
  EXPECT_LT(scheme.predict(0.0, x).variance, 0.0);
  for (int i = 0; i < 100000; ++i) {
    scheme.learn(
        {.time_s = i + 1.0, .duration_s = 1.0, .features = x, .drift = 0.25, .variance = 1e-4});
  }
  EXPECT_NEAR(scheme.predict(1e6, x).drift, 0.25, 1e-9);
  EXPECT_GE(scheme.predict(1e6, x).variance, 0.0);
  // The constant explains it all: the prior holds every other coefficient at 0.
  EXPECT_NEAR(scheme.predict(1e6, Features{-1.0, 1.0}).drift, 0.25, 1e-6);
}

TEST(PolynomialAbuse, ValidateNamesTheWrongKey) {
  const auto key_of = zerodrift::testing::wrong_key<PolynomialScheme, PolynomialOptions>;
  EXPECT_FALSE(PolynomialOptions{}.validate());
  EXPECT_EQ(key_of({.temperature_feature = 16}), "temperature_feature");
  EXPECT_EQ(key_of({.rate_feature = 99}), "rate_feature");
  EXPECT_EQ(key_of({.prior_deviation = 0.0}), "prior_deviation");
  EXPECT_EQ(key_of({.forgetting = 1.5}), "forgetting");
}

}  // namespace
}  // namespace zerodrift::regression::testing
