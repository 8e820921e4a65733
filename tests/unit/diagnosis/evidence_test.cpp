// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/evidence.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "common/diagnosis/generic_functions.h"
#include "common/diagnosis/search_board.h"
#include "tests/unit/diagnosis/search_record.h"

namespace zerodrift::diagnosis {
namespace {

using test::Series;

// A random walk plus white noise, a known ramp and a candidate, n small enough for dense algebra.
struct SmallProblem {
  static constexpr std::size_t kN = 60;
  Series series, ramp, candidate, other;
  std::vector<std::uint8_t> valid = std::vector<std::uint8_t>(kN, 1);

  SmallProblem() {
    series = test::coloured_noise(kN, 1.0, {1.0, 0.0, 0.3}, 8);
    for (std::size_t i = 0; i < kN; ++i) {
      const double t = static_cast<double>(i);
      ramp.push_back(t + 0.01 * t * t);
      candidate.push_back(std::sin(0.3 * t));
      other.push_back(std::exp(-0.1 * t));
      series[i] += 2.0 * candidate[i] + 0.1 * ramp[i];
    }
  }

  [[nodiscard]] SearchProblem problem(std::function<std::vector<Series>()> columns) const {
    SearchProblem p;
    p.series = series;
    p.valid = valid;
    p.known.push_back({"ramp", ramp});
    p.noise.known = {{{NoiseKind::kWhite, 0.0}, 1.0, 0.1},
                     {{NoiseKind::kRandomWalk, 0.0}, 0.09, 0.1}};
    p.noise.unlisted = UnlistedNoise::kExcluded;
    CandidateGroup g;
    g.name = "candidate";
    g.variants = {{}};
    g.columns = [columns = std::move(columns)](const std::vector<double>&) { return columns(); };
    p.groups.push_back(std::move(g));
    return p;
  }
};

// Rows and columns of a basis of the series without mean: the contrasts i - (i + 1), in which a
// random walk is white and white noise is tridiagonal. Nothing of the cosine domain is in it.
Eigen::MatrixXd differences(Eigen::Index n) {
  Eigen::MatrixXd d = Eigen::MatrixXd::Zero(n - 1, n);
  for (Eigen::Index i = 0; i + 1 < n; ++i) {
    d(i, i) = -1.0;
    d(i, i + 1) = 1.0;
  }
  return d;
}

Eigen::VectorXd vector_of(const Series& x) {
  return Eigen::Map<const Eigen::VectorXd>(x.data(), static_cast<Eigen::Index>(x.size()));
}

TEST(EvidenceLaws, AmplitudesAreThoseOfDenseGeneralisedLeastSquares) {
  const SmallProblem small;
  const SearchProblem problem = small.problem([&] {
    return std::vector<Series>{small.candidate, small.other};
  });
  const SearchOptions options;
  const Board board(problem, options);
  const Eigen::VectorXd spectrum = board.dictionary().spectra() * board.dictionary().prior_square();
  const ColumnEvidence e =
      column_evidence(board.project(board.known(), {0}, spectrum).front(), options.evidence);

  const Eigen::MatrixXd d = differences(SmallProblem::kN);
  const Eigen::Index m = SmallProblem::kN - 1;
  const Eigen::MatrixXd covariance =
      0.09 * Eigen::MatrixXd::Identity(m, m) + 1.0 * d * d.transpose();
  Eigen::MatrixXd x(m, 3);
  x << d * vector_of(small.ramp), d * vector_of(small.candidate), d * vector_of(small.other);
  const Eigen::LLT<Eigen::MatrixXd> factor(covariance);
  const Eigen::MatrixXd inverse = (x.transpose() * factor.solve(x)).inverse();
  const Eigen::VectorXd dense = inverse * x.transpose() * factor.solve(d * vector_of(small.series));
  for (Eigen::Index j = 0; j < 2; ++j) {
    const double norm = board.variant(0).columns()[static_cast<std::size_t>(j)].norm;
    // Rounding of the condition of the normal equations, some 1e4.
    EXPECT_NEAR(e.amplitudes(j) / norm, dense(j + 1), 1e-9 * std::abs(dense(j + 1)));
    EXPECT_NEAR(std::sqrt(e.covariance(j, j)) / norm, std::sqrt(inverse(j + 1, j + 1)),
                1e-9 * std::sqrt(inverse(j + 1, j + 1)));
  }
}

TEST(EvidenceLaws, TheBayesFactorDoesNotDependOnTheColumnsScaleOrMixture) {
  const SmallProblem small;
  const auto evidence = [&](double a, double b, double c, double d) {
    const SearchProblem problem = small.problem([=, &small] {
      Series first(SmallProblem::kN);
      Series second(SmallProblem::kN);
      for (std::size_t i = 0; i < SmallProblem::kN; ++i) {
        first[i] = a * small.candidate[i] + b * small.other[i];
        second[i] = c * small.candidate[i] + d * small.other[i];
      }
      return std::vector<Series>{first, second};
    });
    const SearchOptions options;
    const Board board(problem, options);
    return board.evaluate(board.known(), {}, {}).groups[0].log_evidence;
  };
  const double once = evidence(1.0, 0.0, 0.0, 1.0);
  EXPECT_GT(once, 1.0);
  // Rounding times condition.
  EXPECT_NEAR(evidence(1e9, 0.0, 0.0, 1e-9), once, 1e-8);
  EXPECT_NEAR(evidence(1.0, 0.5, -2.0, 3.0), once, 1e-8);
}

TEST(EvidenceLaws, AnotherMultipleOfAModelColumnInTheSeriesChangesNothing) {
  SmallProblem small;
  const auto evidence = [&] {
    const SearchProblem problem =
        small.problem([&] { return std::vector<Series>{small.candidate}; });
    const SearchOptions options;
    const Board board(problem, options);
    return board.evaluate(board.known(), {}, {}).groups[0].log_evidence;
  };
  const double before = evidence();
  for (std::size_t i = 0; i < SmallProblem::kN; ++i) small.series[i] += 50.0 + 7.0 * small.ramp[i];
  EXPECT_NEAR(evidence(), before, 1e-6);  // rounding of squares 1e6 times larger
}

TEST(EvidenceLaws, ADependentColumnAddsNothing) {
  ProjectedColumns c;
  c.gram.resize(2, 2);
  c.gram << 4.0, 8.0, 8.0, 16.0;
  c.products = Eigen::Vector2d(6.0, 12.0);
  c.unprojected = c.gram.diagonal();
  const ColumnEvidence e = column_evidence(c, {});
  EXPECT_EQ(e.rank, 1);
  EXPECT_DOUBLE_EQ(e.chi_square, 9.0);
  EXPECT_DOUBLE_EQ(e.amplitudes(0), 1.5);
  EXPECT_DOUBLE_EQ(e.amplitudes(1), 0.0);
}

// White noise and a random walk beside the first four powers of a temperature, as a model has them,
// and splines of it, which the powers nearly span.
double chi_square_of_splines(double period_s, int intervals, double walk, std::uint64_t seed) {
  constexpr std::size_t kSamples = 4000;
  std::mt19937_64 random(5);
  std::normal_distribution<double> noise;
  Series temperature(kSamples);
  for (std::size_t i = 0; i < kSamples; ++i) {
    const double turns = static_cast<double>(i) / period_s;
    temperature[i] = std::sin(2.0 * std::numbers::pi * turns) + 3e-3 * noise(random);
  }
  SearchProblem problem;
  for (int power = 1; power <= 4; ++power) {
    Series column(kSamples);
    std::transform(temperature.begin(), temperature.end(), column.begin(),
                   [&](double x) { return std::pow(x, power); });
    problem.known.push_back({"power", std::move(column)});
  }
  problem.noise.known = {{{NoiseKind::kWhite, 0.0}, 1.0, 0.1},
                         {{NoiseKind::kRandomWalk, 0.0}, walk * walk, 0.1}};
  problem.noise.unlisted = UnlistedNoise::kExcluded;
  CandidateGroup group;
  group.name = "splines";
  group.variants = {{}};
  group.columns = [&](const std::vector<double>&) {
    return spline_basis(temperature, intervals, Knots::kUniform);
  };
  problem.groups.push_back(std::move(group));
  const std::vector<std::uint8_t> valid(kSamples, 1);
  const Series series = test::coloured_noise(kSamples, 1.0, {1.0, 0.0, walk}, seed);
  problem.valid = valid;
  problem.series = series;
  const SearchOptions options;
  const Board board(problem, options);
  return board.evaluate(board.known(), {}, {}).groups[0].chi_square;
}

// What is left of the last splines beside the others is what large parts leave of each other, and
// its share in a record without any function of the temperature was up to 7000.
TEST(EvidenceLaws, WhatIsLeftOfNothingIsNoEvidence) {
  for (const double period_s : {3000.0, 5000.0, 10000.0, 16000.0, 24000.0}) {
    for (const int intervals : {8, 24, 28, 32}) {
      const double most = intervals + 3.0;  // columns
      for (const double walk : {1e-2, 3e-2, 1e-1}) {
        for (const std::uint64_t seed : {1U, 2U}) {
          EXPECT_LT(chi_square_of_splines(period_s, intervals, walk, seed),
                    most + 5.0 * std::sqrt(2.0 * most))
              << period_s << ' ' << intervals << ' ' << walk << ' ' << seed;
        }
      }
    }
  }
}

TEST(EvidenceLaws, TheAverageBayesFactorUnderNoiseIsOne) {
  // Under the null hypothesis E[BF] = 1 for any proper prior. By quadrature over z up to 5000; what
  // lies beyond is 2 P(N > 5) of the largest of the 14 scales. The integrand is a mixture of normal
  // densities of standard deviation sqrt(2) and more: a step of 0.1 is exact to rounding.
  double mean = 0.0;
  constexpr double kStep = 0.1;
  for (int i = -50000; i <= 50000; ++i) {
    const double z = kStep * i;
    ProjectedColumns c;
    c.gram.setConstant(1, 1, 1.0);
    c.products.setConstant(1, z);
    c.unprojected.setConstant(1, 1.0);
    const double bf = column_evidence(c, {}, Detail::kEvidence).log_bayes_factor;
    mean += kStep * std::exp(bf - 0.5 * z * z) / std::sqrt(2.0 * std::numbers::pi);
  }
  EXPECT_NEAR(mean, 1.0, 1e-6);
}

TEST(EvidenceLaws, AnAmplitudeOutOfItsLimitsLosesWhatItsErrorSays) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  EXPECT_EQ(log_probability_within(3.0, 2.0, -kInfinity, kInfinity), 0.0);
  EXPECT_NEAR(log_probability_within(100.0, 1.0, 0.0, 900.0), 0.0, 1e-12);
  EXPECT_NEAR(log_probability_within(0.0, 1.0, 0.0, 900.0), std::log(0.5), 1e-12);
  EXPECT_NEAR(log_probability_within(902.0, 1.0, 0.0, 900.0), std::log(0.02275013194817921), 1e-9);
  // Where one way to compute it takes over from the other: within its 2 %, and steeper still.
  double before = 0.0;
  for (double beyond = 7.0; beyond < 60.0; beyond += 0.01) {
    const double here = log_probability_within(-60.0 - beyond, 1.0, -60.0, 900.0);
    EXPECT_LT(here, before + (std::abs(beyond - 8.0) < 0.02 ? 0.02 : 0.0)) << beyond;
    EXPECT_NEAR(here, -0.5 * beyond * beyond - std::log(beyond) - 0.919, 0.03) << beyond;
    before = here;
  }
  EXPECT_EQ(log_probability_within(1.0, 1.0, 1.0, 0.0), -kInfinity);
}

TEST(GapBridge, IsALinearOperatorThatKeepsWhatIsThere) {
  std::vector<std::uint8_t> valid(1000, 1);
  for (std::size_t i = 0; i < 5; ++i) valid[i] = 0;
  for (std::size_t i = 300; i < 420; ++i) valid[i] = 0;
  valid[700] = 0;
  for (std::size_t i = 990; i < 1000; ++i) valid[i] = 0;
  const GapBridge bridge(valid);
  EXPECT_DOUBLE_EQ(bridge.missing_share(), 0.136);
  Series a(1000);
  Series b(1000);
  Series sum(1000);
  Series ramp(1000);
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  for (std::size_t i = 0; i < 1000; ++i) {
    a[i] = normal(random);
    b[i] = normal(random);
    sum[i] = 2.0 * a[i] - 3.0 * b[i];
    ramp[i] = static_cast<double>(i);
  }
  const Series before = a;
  bridge.apply(a);
  bridge.apply(b);
  bridge.apply(sum);
  bridge.apply(ramp);
  for (std::size_t i = 0; i < 1000; ++i) {
    EXPECT_NEAR(sum[i], 2.0 * a[i] - 3.0 * b[i], 1e-12);
    if (valid[i] != 0) {
      EXPECT_EQ(a[i], before[i]);
    }
    // A ramp is bridged exactly; ends are held.
    if (i >= 5 && i < 990) {
      EXPECT_NEAR(ramp[i], static_cast<double>(i), 1e-9);
    }
  }
}

TEST(ColumnTransform, ConstantColumnsHaveNoNormAndBrokenOnesAreRefused) {
  const std::vector<std::uint8_t> valid(100, 1);
  ColumnTransform transform(SpectralBands(100, 50), valid);
  EXPECT_EQ(transform.columns({Series(100, 273.15)}).front().norm, 0.0);
  Series nan(100, 1.0);
  nan[50] = std::numeric_limits<double>::quiet_NaN();
  const Series short_one(99, 1.0);
  EXPECT_TRUE(transform.takes(Series(100, 1.0)));
  EXPECT_FALSE(transform.takes(nan));
  EXPECT_FALSE(transform.takes(short_one));
  EXPECT_THROW((void)transform.columns({nan}), std::logic_error);
  EXPECT_THROW((void)transform.columns({short_one}), std::logic_error);
}

}  // namespace
}  // namespace zerodrift::diagnosis
