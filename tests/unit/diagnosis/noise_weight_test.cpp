// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/noise_weight.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <numbers>
#include <random>

#include "common/diagnosis/cosine_transform.h"

namespace zerodrift::diagnosis {
namespace {

TEST(NoiseWeightLaws, DividingByTheNoiseIsTheInverseOfItsCovariance) {
  constexpr Eigen::Index kSize = 12;
  std::vector<double> variances(kSize, 0.0);
  for (std::size_t k = 1; k < kSize; ++k) variances[k] = 1.0 + 10.0 / static_cast<double>(k * k);
  Eigen::MatrixXd basis(kSize, kSize);  // columns: the cosines
  for (Eigen::Index k = 0; k < kSize; ++k) {
    for (Eigen::Index j = 0; j < kSize; ++j) {
      basis(j, k) = std::sqrt((k == 0 ? 1.0 : 2.0) / kSize) *
                    std::cos(std::numbers::pi * (static_cast<double>(j) + 0.5) *
                             static_cast<double>(k) / kSize);
    }
  }
  Eigen::VectorXd weights = Eigen::VectorXd::Zero(kSize);
  for (Eigen::Index k = 1; k < kSize; ++k)
    weights(k) = 1.0 / variances[static_cast<std::size_t>(k)];
  Eigen::VectorXd x(kSize);
  for (Eigen::Index j = 0; j < kSize; ++j) x(j) = std::sin(1.7 * static_cast<double>(j * j));
  const Eigen::VectorXd expected = basis * weights.asDiagonal() * basis.transpose() * x;
  const auto found = divided_by_noise({x.data(), static_cast<std::size_t>(kSize)}, variances);
  for (Eigen::Index j = 0; j < kSize; ++j)
    EXPECT_NEAR(found[static_cast<std::size_t>(j)], expected(j), 1e-12);
}

TEST(NoiseWeight, VariancesAreTheSumOfTheTerms) {
  const std::vector<NoiseTerm> terms{{NoiseKind::kWhite, 0.0}, {NoiseKind::kRandomWalk, 0.0}};
  const std::vector<double> squares{2.0, 3.0};
  const auto variances = dct_variances(terms, squares, 100, 0.5);
  EXPECT_EQ(variances[0], 0.0);
  const double eigenvalue = laplacian_eigenvalue(7, 100);
  EXPECT_DOUBLE_EQ(variances[7], 2.0 * unit_spectrum(terms[0], eigenvalue, 0.5) +
                                     3.0 * unit_spectrum(terms[1], eigenvalue, 0.5));
}

TEST(NoiseWeight, TheVarianceOfAMeanIsThatOfItsCovariance) {
  constexpr std::size_t kSize = 12;
  std::vector<double> variances(kSize, 0.0);
  for (std::size_t k = 1; k < kSize; ++k) variances[k] = 1.0 + 10.0 / static_cast<double>(k * k);
  const std::vector<std::uint8_t> valid{0, 1, 1, 0, 0, 1, 0, 0, 1, 0, 0, 0};
  const std::vector<std::size_t> places{1, 2, 5, 8};
  double sum = 0.0;  // of the covariances of every two of the four
  for (const std::size_t i : places) {
    for (const std::size_t j : places) {
      for (std::size_t k = 1; k < kSize; ++k) {
        const auto cosine = [&](std::size_t at) {
          return std::sqrt(2.0 / kSize) *
                 std::cos(std::numbers::pi * (static_cast<double>(at) + 0.5) *
                          static_cast<double>(k) / kSize);
        };
        sum += variances[k] * cosine(i) * cosine(j);
      }
    }
  }
  EXPECT_NEAR(variance_of_mean(valid, variances), sum / 16.0, 1e-12);
  EXPECT_EQ(variance_of_mean(std::vector<std::uint8_t>(kSize, 0), variances), 0.0);
}

TEST(NoiseWeight, OfWhiteNoiseTheWeightedSquareIsThatOfTheDeparturesFromTheMean) {
  const std::vector<double> x{1.0, -2.0, 4.0, 100.0, 3.0, 0.5};
  const std::vector<std::uint8_t> valid{1, 1, 1, 0, 1, 1};
  const std::vector<double> variances{0.0, 0.25, 0.25, 0.25, 0.25, 0.25};
  const double mean = (1.0 - 2.0 + 4.0 + 3.0 + 0.5) / 5.0;
  double squares = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i)
    squares += valid[i] != 0 ? (x[i] - mean) * (x[i] - mean) : 0.0;
  EXPECT_NEAR(weighted_square(x, valid, variances), squares / 0.25, 1e-12 * squares);
  EXPECT_EQ(weighted_square(x, std::vector<std::uint8_t>(x.size(), 0), variances), 0.0);
}

TEST(NoiseWeight, ALineGainsHalfItsSquaredSeparationAtItsFrequencyWhateverItsPhase) {
  constexpr std::size_t kSize = 4000;
  constexpr double kAmplitude = 0.2;  // d² = .5 4000 .2² = 80 under noise of 1
  const std::vector<std::uint8_t> valid(kSize, 1);
  const std::vector<double> variances(kSize, 1.0);
  for (const double phase : {0.0, 1.0, 2.5}) {
    std::vector<double> series(kSize);
    for (std::size_t i = 0; i < kSize; ++i)
      series[i] =
          kAmplitude * std::sin(2.0 * std::numbers::pi * 0.0625 * static_cast<double>(i) + phase);
    EXPECT_NEAR(line_gain_nats(series, valid, variances, 0.03125, 2.0), 40.0, 0.1);
    EXPECT_NEAR(line_gain_nats(series, valid, variances, 0.04, 2.0), 0.0, 0.1);
  }
}

TEST(NoiseWeight, TheRightNoiseIsLikelierAndNoNoiseSaysNothing) {
  constexpr std::size_t kSize = 2000;
  const std::vector<std::uint8_t> valid(kSize, 1);
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal(0.0, 2.0);
  std::vector<double> series(kSize);
  for (double& x : series) x = normal(random);
  const std::vector<double> right(kSize, 4.0);
  const std::vector<double> wrong(kSize, 1.0);
  // n/2 (4 - 1 - ln 4), give or take 3/2 sqrt(2 n).
  EXPECT_NEAR(noise_gain_nats(series, valid, wrong, right), 0.5 * kSize * (3.0 - std::log(4.0)),
              5.0 * 1.5 * std::sqrt(2.0 * kSize));
  EXPECT_EQ(noise_gain_nats(series, valid, right, right), 0.0);
  EXPECT_EQ(noise_gain_nats(series, valid, std::vector<double>(kSize, 0.0), right), 0.0);
}

}  // namespace
}  // namespace zerodrift::diagnosis
