// SPDX-License-Identifier: Apache-2.0
#include "common/regression/gram_dictionary.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

#include "tests/unit/regression/test_records.h"

namespace zerodrift::regression::testing {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr std::uint64_t kSeed = 11;

MatrixXd gram_of(const Kernel& kernel, const std::vector<Sample>& samples) {
  const auto n = static_cast<Index>(samples.size());
  MatrixXd gram(n, n);
  for (Index i = 0; i < n; ++i) {
    for (Index j = 0; j < n; ++j) {
      const Sample& a = samples[static_cast<std::size_t>(i)];
      const Sample& b = samples[static_cast<std::size_t>(j)];
      evaluate_row(kernel, {a.x.data(), 1, a.x.size(), 1}, b.x.data(), &gram(i, j));
      if (kernel.is_stationary()) gram(i, j) += 1.0;
    }
  }
  return gram;
}

VectorXd targets_of(const std::vector<Sample>& samples) {
  VectorXd targets(static_cast<Index>(samples.size()));
  for (Index i = 0; i < targets.size(); ++i) targets[i] = samples[static_cast<std::size_t>(i)].y;
  return targets;
}

// The same by batch factorisation.
struct Batch {
  double squared_norm;
  double log_determinant;
  double prediction;
};

Batch batch_of(const Kernel& kernel, double ridge, const std::vector<Sample>& samples,
               const std::vector<double>& x) {
  const auto n = static_cast<Index>(samples.size());
  const VectorXd targets = targets_of(samples), ones = VectorXd::Ones(n);
  const Eigen::LLT<MatrixXd> factor(gram_of(kernel, samples) + ridge * MatrixXd::Identity(n, n));
  const VectorXd solved_ones = factor.solve(ones);
  const double mean = solved_ones.dot(targets) / solved_ones.sum();
  const VectorXd weights = factor.solve(targets - mean * ones);
  std::vector<Sample> extended = samples;
  extended.push_back({x, 0.0});
  const VectorXd cross = gram_of(kernel, extended).col(n).head(n);
  return {
      (targets - mean * ones).dot(weights),
      2.0 * MatrixXd(factor.matrixL()).diagonal().array().log().sum() + std::log(solved_ones.sum()),
      mean + cross.dot(weights)};
}

GramDictionaryOptions options_for(KernelKind kind, double ridge) {
  GramDictionaryOptions options;
  options.kernel = kernel_of(kind);
  options.ridge = ridge;
  options.novelty_tolerance = 2.0 * ridge;
  return options;
}

TEST(GramDictionaryLaws, GrowingSampleBySampleEqualsTheBatchFactorisation) {
  constexpr double kRidge = 1e-2;
  for (const KernelKind kind : kAllKernelKinds) {
    GramDictionary dictionary(options_for(kind, kRidge));
    RecordGenerator generator(RecordKind::kSmooth, 2, kSeed);
    std::vector<Sample> held;
    for (const Sample& sample : generator.take(80)) {
      if (dictionary.offer(sample.x, sample.y).outcome == GrowthOutcome::kGrown) {
        held.push_back(sample);
      }
      if (held.size() < 2) continue;
      ASSERT_EQ(dictionary.size(), held.size());
      const std::vector<double> x{0.3, -0.4};
      const Batch batch = batch_of(kernel_of(kind), kRidge, held, x);
      // Condition below 80 / ridge = 8e3 (stationary) or 1e5 (polynomial): 1e-16 grows to 1e-11.
      const double tolerance = 1e-10;
      EXPECT_NEAR(dictionary.squared_norm(), batch.squared_norm,
                  tolerance * (1.0 + batch.squared_norm))
          << name(kind);
      EXPECT_NEAR(dictionary.log_determinant(), batch.log_determinant, tolerance * 100.0)
          << name(kind);
      EXPECT_NEAR(dictionary.predict(x), batch.prediction, tolerance) << name(kind);
    }
  }
}

// Eq. (5) and (7) of the paper by their own words: Gram-Schmidt of alpha_k = Phi_0 y_k - Phi_k y_0,
// with vectors as coefficients over Phi_0..Phi_n-1 and the scalar product a' K b. No bias there, so
// the dictionary gets a first sample that makes one vanish: Phi = 0, y = 0 (a linear kernel's
// origin).
TEST(GramDictionaryLaws, SquaredNormIsThePapersEquationSeven) {
  GramDictionaryOptions options;
  options.kernel.kind = KernelKind::kLinear;
  options.dimension = 6;
  options.ridge = 0.0;
  options.novelty_tolerance = 1e-10;
  GramDictionary dictionary(options);
  ASSERT_EQ(dictionary.offer(std::vector<double>(6, 0.0), 0.0).outcome, GrowthOutcome::kGrown);
  RecordGenerator generator(RecordKind::kSmooth, 6, kSeed);
  const std::vector<Sample> samples = generator.take(6);
  for (const Sample& sample : samples) {
    ASSERT_EQ(dictionary.offer(sample.x, sample.y).outcome, GrowthOutcome::kGrown);
  }
  const MatrixXd gram = gram_of(options.kernel, samples);
  const VectorXd y = targets_of(samples);
  std::vector<VectorXd> basis;
  for (Index k = 1; k < y.size(); ++k) {
    VectorXd alpha = VectorXd::Zero(y.size());
    alpha[0] = y[k];
    alpha[k] = -y[0];
    for (int pass = 0; pass < 2; ++pass) {  // twice is enough
      for (const VectorXd& beta : basis) alpha -= beta.dot(gram * alpha) * beta;
    }
    basis.push_back(alpha / std::sqrt(alpha.dot(gram * alpha)));
  }
  double outside = gram(0, 0);
  for (const VectorXd& beta : basis) outside -= std::pow(gram.row(0).dot(beta), 2);
  const double equation_seven = y[0] * y[0] / outside;
  // Six vectors in six dimensions: condition of the Gram matrix below 1e4.
  EXPECT_NEAR(dictionary.squared_norm() / equation_seven, 1.0, 1e-11);
}

// alpha_{l+1} in the span, eq. (8)-(11): a linear kernel in 3 dimensions spans itself with 4
// samples, one of which the bias takes.
TEST(GramDictionaryLaws, DictionaryStopsGrowingAtTheRankOfTheKernel) {
  GramDictionaryOptions options;
  options.kernel.kind = KernelKind::kLinear;
  options.dimension = 3;
  options.ridge = 0.0;
  options.novelty_tolerance = 1e-9;
  GramDictionary dictionary(options);
  RecordGenerator generator(RecordKind::kSmooth, 3, kSeed);
  for (const Sample& sample : generator.take(50)) {
    const double y = 0.5 + sample.x[0] - 2.0 * sample.x[1] + 0.25 * sample.x[2];
    const GrowthReport report = dictionary.offer(sample.x, y);
    if (report.outcome == GrowthOutcome::kGrown) continue;
    ASSERT_EQ(report.outcome, GrowthOutcome::kSpanned);
    EXPECT_NEAR(report.prior_residual, 0.0, 1e-12);  // both halves of the paper's test
  }
  EXPECT_EQ(dictionary.size(), 4U);
}

TEST(GramDictionaryLaws, RejectedSampleChangesNothing) {
  GramDictionaryOptions options = options_for(KernelKind::kRbf, 1e-3);
  options.capacity = 10;
  GramDictionary dictionary(options);
  RecordGenerator generator(RecordKind::kSmooth, 2, kSeed);
  bool was_full = false;
  for (const Sample& sample : generator.take(100)) {
    const double norm = dictionary.squared_norm(), determinant = dictionary.log_determinant();
    const std::size_t size = dictionary.size();
    const GrowthReport report = dictionary.offer(sample.x, sample.y);
    was_full = was_full || report.outcome == GrowthOutcome::kFull;
    if (report.outcome == GrowthOutcome::kGrown) continue;
    EXPECT_EQ(dictionary.squared_norm(), norm);
    EXPECT_EQ(dictionary.log_determinant(), determinant);
    EXPECT_EQ(dictionary.size(), size);
  }
  EXPECT_TRUE(was_full);
}

TEST(GramDictionaryLaws, NoveltyFallsToTheRidgeAtASampleHeld) {
  const GramDictionaryOptions options = options_for(KernelKind::kRbf, 1e-3);
  GramDictionary dictionary(options);
  RecordGenerator generator(RecordKind::kSmooth, 2, kSeed);
  std::vector<Sample> held;
  for (const Sample& sample : generator.take(100)) {
    if (dictionary.offer(sample.x, sample.y).outcome == GrowthOutcome::kGrown) {
      held.push_back(sample);
    }
  }
  ASSERT_GT(held.size(), 10U);
  for (const Sample& sample : held) {
    const GrowthReport report = dictionary.offer(sample.x, sample.y);
    EXPECT_EQ(report.outcome, GrowthOutcome::kSpanned);
    EXPECT_GE(report.novelty, 0.0);
    EXPECT_LE(report.novelty, options.ridge * (1.0 + 1e-9));
  }
}

TEST(GramDictionaryAbuse, HardRecordsKeepEverythingFinite) {
  for (const RecordKind kind : kAllRecordKinds) {
    for (const KernelKind kernel : kAllKernelKinds) {
      GramDictionaryOptions options = options_for(kernel, 0.0);
      options.novelty_tolerance = 1e-10;
      GramDictionary dictionary(options);
      RecordGenerator generator(kind, 2, kSeed);
      for (const Sample& sample : generator.take(300)) {
        const GrowthReport report = dictionary.offer(sample.x, sample.y);
        ASSERT_TRUE(std::isfinite(report.novelty) && std::isfinite(report.prior_residual));
        ASSERT_TRUE(std::isfinite(dictionary.squared_norm()));
        ASSERT_TRUE(std::isfinite(dictionary.log_determinant()));
      }
      if (kind == RecordKind::kIdentical) {
        EXPECT_EQ(dictionary.size(), 1U);
      }
    }
  }
}

TEST(GramDictionaryAbuse, UnusableSamplesAreRefused) {
  GramDictionary dictionary(GramDictionaryOptions{});
  const double nan = std::nan(""), infinity = std::numeric_limits<double>::infinity();
  EXPECT_EQ(dictionary.offer(std::vector<double>{nan, 0.0}, 0.0).outcome, GrowthOutcome::kRefused);
  EXPECT_EQ(dictionary.offer(std::vector<double>{0.0, 0.0}, nan).outcome, GrowthOutcome::kRefused);
  EXPECT_EQ(dictionary.offer(std::vector<double>{0.0, infinity}, 0.0).outcome,
            GrowthOutcome::kRefused);
  EXPECT_EQ(dictionary.offer(std::vector<double>{0.0, 0.0}, 1e7).outcome, GrowthOutcome::kRefused);
  EXPECT_EQ(dictionary.offer(std::vector<double>{0.0}, 0.0).outcome, GrowthOutcome::kRefused);
  EXPECT_EQ(dictionary.size(), 0U);
  EXPECT_EQ(dictionary.predict(std::vector<double>{0.0, 0.0}), 0.0);
}

TEST(GramDictionaryAbuse, ValidateNamesTheWrongKey) {
  const auto key_of = [](const GramDictionaryOptions& options) {
    const std::string error = options.validate().value_or("");
    return error.substr(0, error.find(':'));
  };
  GramDictionaryOptions options;
  EXPECT_EQ(key_of(options), "");
  options.dimension = 0;
  EXPECT_EQ(key_of(options), "dimension");
  options = {};
  options.capacity = 1;
  EXPECT_EQ(key_of(options), "capacity");
  options = {};
  options.kernel.gamma = 0.0;
  EXPECT_EQ(key_of(options), "kernel.gamma");
  options = {};
  options.ridge = -1.0;
  EXPECT_EQ(key_of(options), "ridge");
  options = {};
  options.novelty_tolerance = options.ridge;
  EXPECT_EQ(key_of(options), "novelty_tolerance");
  EXPECT_THROW(GramDictionary{options}, std::invalid_argument);
}

}  // namespace
}  // namespace zerodrift::regression::testing
