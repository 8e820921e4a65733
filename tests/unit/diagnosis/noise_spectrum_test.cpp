// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/noise_spectrum.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <stdexcept>
#include <vector>

#include "common/diagnosis/evidence.h"
#include "tests/unit/diagnosis/search_record.h"

namespace zerodrift::diagnosis {
namespace {

using test::NoiseLevels;
using test::Series;

// The series without any column.
RowSystem rows_of(const SpectralBands& bands, const Series& series) {
  const std::vector<std::uint8_t> valid(series.size(), 1);
  ColumnTransform transform(bands, valid);
  const SpectralColumn y = transform.series(series, valid);
  RowSystem rows;
  rows.singles = y.singles;
  rows.products = bin_products(bands, y, y);
  rows.ridge.resize(0);
  rows.counts.resize(bands.rows());
  for (Eigen::Index r = 0; r < bands.rows(); ++r) rows.counts(r) = bands.count(r);
  return rows;
}

RowSystem rows_of(const SpectralBands& bands, const Series& series, const Series& column) {
  const std::vector<std::uint8_t> valid(series.size(), 1);
  ColumnTransform transform(bands, valid);
  const SpectralColumn y = transform.series(series, valid);
  const SpectralColumn x = transform.columns({column}).front();
  RowSystem rows = rows_of(bands, series);
  rows.singles.resize(bands.singles(), 2);
  rows.singles << x.singles, y.singles;
  rows.products.resize(bands.bins(), 4);
  rows.products << bin_products(bands, x, x), bin_products(bands, x, y), bin_products(bands, x, y),
      bin_products(bands, y, y);
  rows.ridge.setZero(1);
  return rows;
}

double square_of(const NoiseDictionary& dictionary, const NoiseFit& fit, NoiseKind kind) {
  for (std::size_t m = 0; m < dictionary.terms().size(); ++m) {
    if (dictionary.terms()[m].kind == kind) return fit.squares(static_cast<Eigen::Index>(m));
  }
  return -1.0;
}

NoisePrior three_terms(const NoiseLevels& levels, double relative_sigma) {
  NoisePrior prior;
  prior.known = {
      {{NoiseKind::kWhite, 0.0}, levels.white * levels.white, relative_sigma},
      {{NoiseKind::kFlicker, 0.0}, levels.flicker * levels.flicker, relative_sigma},
      {{NoiseKind::kRandomWalk, 0.0}, levels.random_walk * levels.random_walk, relative_sigma}};
  prior.unlisted = UnlistedNoise::kExcluded;
  return prior;
}

TEST(SpectralBands, CoverEveryCoefficientAboveDcOnce) {
  for (const std::size_t n : {2u, 10u, 901u, 902u, 18000u}) {
    const SpectralBands bands(n, 900);
    double sum = 0.0;
    for (Eigen::Index r = 0; r < bands.rows(); ++r) {
      EXPECT_GE(bands.count(r), 1.0);
      if (r < bands.singles()) {
        EXPECT_EQ(bands.count(r), 1.0);
      }
      sum += bands.count(r);
    }
    EXPECT_EQ(bands.first(0), 1u);
    EXPECT_EQ(sum, static_cast<double>(n - 1));
  }
}

TEST(UnitSpectrum, TheMarkovSpectrumSumsToItsVariance) {
  constexpr std::size_t kN = 20000;
  const NoiseTerm term{NoiseKind::kMarkov, 50.0};
  double sum = 0.0;
  for (std::size_t k = 0; k < kN; ++k) {
    sum += unit_spectrum(term, laplacian_eigenvalue(k, kN), 1.0);
  }
  // Mean over frequencies is the variance; a Riemann sum with n / correlation = 400 points a line
  // width, end point error half of the first term, 100 / 2n.
  EXPECT_NEAR(sum / kN, 1.0, 3e-3);
}

TEST(NoiseFitLaws, TheGradientIsThatOfTheLikelihood) {
  const std::size_t n = 2000;
  const Series y = test::coloured_noise(n, 9.0, {1.0, 0.1, 1e-3}, 5);
  Series x(n);
  for (std::size_t i = 0; i < n; ++i) x[i] = std::sin(0.01 * static_cast<double>(i));
  const SpectralBands bands(n, 300);
  const RowSystem rows = rows_of(bands, y, x);
  const NoiseDictionary dictionary(bands, 9.0, {});
  NoiseFit fit = fit_noise(rows, dictionary);
  Eigen::VectorXd at = fit.squares;
  for (Eigen::Index m = 0; m < at.size(); ++m) {
    at(m) = 1.3 * at(m) + 0.05 * fit.squares(0) / dictionary.spectra()(0, m);
  }
  const Eigen::VectorXd gradient = restricted_gradient(rows, dictionary, at);
  for (Eigen::Index m = 0; m < at.size(); ++m) {
    const double h = 1e-4 * at(m);
    Eigen::VectorXd up = at;
    Eigen::VectorXd down = at;
    up(m) += h;
    down(m) -= h;
    const double slope = (restricted_log_likelihood(rows, dictionary, up) -
                          restricted_log_likelihood(rows, dictionary, down)) /
                         (2.0 * h);
    // Nats per relative change; differences are good to 1e-8 of their curvature and rounding of a
    // likelihood of 1e4 over 1e-4.
    EXPECT_NEAR(gradient(m) * at(m), slope * at(m), 1e-5 * (1.0 + std::abs(slope * at(m)))) << m;
  }
}

TEST(NoiseFitLaws, AtTheOptimumSlopesVanishOrPointOutOfTheBounds) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const SpectralBands bands(6000, 900);
    const RowSystem rows = rows_of(bands, test::coloured_noise(6000, 3.0, {1.0, 0.1, 1e-3}, seed));
    const NoiseDictionary dictionary(bands, 3.0, {});
    const NoiseFit fit = fit_noise(rows, dictionary);
    ASSERT_EQ(fit.status, NoiseFitStatus::kConverged) << seed;
    EXPECT_LT(fit.promised_nats, 1e-3);
    const Eigen::VectorXd gradient = restricted_gradient(rows, dictionary, fit.squares);
    for (Eigen::Index m = 0; m < gradient.size(); ++m) {
      // Nats for adding 1 % of the whole spectrum in this form: stationary to 1e-2 of a nat.
      const double one_percent =
          0.01 / dictionary.spectra().col(m).cwiseQuotient(fit.spectrum).maxCoeff();
      EXPECT_LT(gradient(m) * one_percent, 1e-2) << seed << ' ' << m;
      EXPECT_NEAR(gradient(m) * fit.squares(m), 0.0, 2e-2) << seed << ' ' << m;
    }
  }
}

TEST(NoiseFitLaws, TheOptimumDoesNotDependOnWhereTheFitStarts) {
  const SpectralBands bands(6000, 900);
  const RowSystem rows = rows_of(bands, test::coloured_noise(6000, 3.0, {1.0, 0.2, 1e-3}, 9));
  const NoiseDictionary dictionary(bands, 3.0, {});
  const NoiseFit fit = fit_noise(rows, dictionary);
  for (const double factor : {0.01, 100.0}) {
    const Eigen::VectorXd start =
        factor * fit.squares.array() + 0.1 / dictionary.spectra().row(0).transpose().array();
    const NoiseFit again = fit_noise(rows, dictionary, {}, start);
    EXPECT_EQ(again.status, NoiseFitStatus::kConverged);
    // settled_nats bounds what a quadratic model leaves; the likelihood is close to one.
    EXPECT_NEAR(again.log_likelihood, fit.log_likelihood, 1e-2);
  }
}

TEST(NoiseFitLaws, ScalingTheSeriesScalesTheSquares) {
  const SpectralBands bands(3000, 900);
  Series y = test::coloured_noise(3000, 6.0, {1.0, 0.2, 1e-3}, 3);
  const NoiseDictionary dictionary(bands, 6.0, {});
  const NoiseFit once = fit_noise(rows_of(bands, y), dictionary);
  for (double& v : y) v *= 1e-6;
  const NoiseFit scaled = fit_noise(rows_of(bands, y), dictionary);
  for (Eigen::Index r = 0; r < bands.rows(); ++r) {
    // The optimum is flat: 1e-4 nats of 3000 coefficients leave 1e-2 of a level undecided.
    EXPECT_NEAR(scaled.spectrum(r) * 1e12 / once.spectrum(r), 1.0, 1e-2) << r;
  }
}

TEST(NoiseFit, RecoversKnownSpectraWithinTheSamplingError) {
  const NoiseLevels truth{1.0, 0.3, 2e-3};
  NoisePrior prior = three_terms(truth, 10.0);  // practically free: 0.02 degrees of freedom
  const SpectralBands bands(18000, 900);
  const NoiseDictionary dictionary(bands, 1.0, prior);
  double flicker = 0.0;
  double walk = 0.0;
  constexpr int kRecords = 12;
  for (std::uint64_t seed = 0; seed < kRecords; ++seed) {
    const NoiseFit fit =
        fit_noise(rows_of(bands, test::coloured_noise(18000, 1.0, truth, 50 + seed)), dictionary);
    ASSERT_EQ(fit.status, NoiseFitStatus::kConverged);
    // Variance of white noise from 17000 coefficients: 5 sigma = 5 sqrt(2 / 17000).
    EXPECT_NEAR(square_of(dictionary, fit, NoiseKind::kWhite), 1.0, 0.055);
    flicker += square_of(dictionary, fit, NoiseKind::kFlicker) / (0.09 * kRecords);
    walk += square_of(dictionary, fit, NoiseKind::kRandomWalk) / (4e-6 * kRecords);
  }
  // Flicker leads over some 50 and the walk over some 15 coefficients a record, shared with each
  // other: relative errors of sqrt(2 / 50) and sqrt(2 / 10), over sqrt(12) records, 4 sigma.
  EXPECT_NEAR(flicker, 1.0, 0.25);
  EXPECT_NEAR(walk, 1.0, 0.55);
}

TEST(NoiseFit, ATightPriorHoldsACoefficientAndALooseOneLetsItGo) {
  const SpectralBands bands(6000, 900);
  const RowSystem rows = rows_of(bands, test::coloured_noise(6000, 1.0, {1.0, 0.01, 1e-5}, 4));
  NoisePrior prior;
  prior.known = {{{NoiseKind::kWhite, 0.0}, 2.0, 1e-4}};
  prior.unlisted = UnlistedNoise::kExcluded;
  const NoiseDictionary tight(bands, 1.0, prior);
  // 2e8 degrees of freedom against 6000.
  EXPECT_NEAR(fit_noise(rows, tight).squares(0), 2.0, 1e-3);
  prior.known[0].relative_sigma = 1.0;
  const NoiseDictionary loose(bands, 1.0, prior);
  EXPECT_NEAR(fit_noise(rows, loose).squares(0), 1.0, 0.1);  // 5 sigma = 5 sqrt(2 / 6000)
}

TEST(PowerByOctave, NoiseAsExpectedIsWithinChiSquareAndAnExcessShowsInItsOctave) {
  const NoiseLevels truth{1.0, 0.05, 3e-4};
  const std::size_t n = 18000;
  const SpectralBands bands(n, 900);
  Series y = test::coloured_noise(n, 1.0, truth, 77);
  const NoiseDictionary dictionary(bands, 1.0, three_terms(truth, 0.1));
  const Eigen::VectorXd spectrum = dictionary.spectra() * dictionary.prior_square();
  const auto quiet = power_by_octave(rows_of(bands, y), bands, spectrum, 1.0);
  ASSERT_GT(quiet.size(), 10u);
  double freedom = 0.0;
  for (const OctavePower& o : quiet) {
    EXPECT_GT(o.excess_probability, 1e-4) << o.lowest_hz;
    EXPECT_GT(o.deficit_probability, 1e-4) << o.lowest_hz;
    freedom += o.degrees_of_freedom;
  }
  EXPECT_EQ(freedom, static_cast<double>(n - 1));
  EXPECT_DOUBLE_EQ(quiet.front().highest_hz, 0.5);
  for (std::size_t i = 0; i < n; ++i) y[i] += 0.2 * std::sin(0.0126 * static_cast<double>(i));
  const auto loud = power_by_octave(rows_of(bands, y), bands, spectrum, 1.0);
  for (std::size_t i = 0; i < loud.size(); ++i) {  // 0.0126 rad/s is 2.005 mHz
    if (loud[i].lowest_hz < 2.0053e-3 && loud[i].highest_hz > 2.0053e-3) {
      EXPECT_LT(loud[i].excess_probability, 1e-9);
    } else if (loud[i].lowest_hz > 8e-3) {
      EXPECT_NEAR(loud[i].ratio, quiet[i].ratio, 0.05);
    }
  }
}

TEST(NoiseFitAbuse, NothingToFitIsSaidAndNotDividedBy) {
  const SpectralBands bands(500, 100);
  const NoiseDictionary dictionary(bands, 1.0, {});
  const NoiseFit fit = fit_noise(rows_of(bands, Series(500, 3.0)), dictionary);
  EXPECT_EQ(fit.status, NoiseFitStatus::kNoPower);
}

TEST(NoiseFitAbuse, WrongPriorsAndOptionsAreNamed) {
  const SpectralBands bands(500, 100);
  NoisePrior prior;
  prior.known = {{{NoiseKind::kFlicker, 0.0}, -1.0, 0.3}};
  ASSERT_TRUE(prior.validate().has_value());
  EXPECT_NE(prior.validate()->find("flicker"), std::string::npos);
  EXPECT_THROW(NoiseDictionary(bands, 1.0, prior), std::invalid_argument);
  prior.known.clear();
  prior.unlisted = UnlistedNoise::kExcluded;
  EXPECT_TRUE(prior.validate().has_value());
  NoiseFitOptions options;
  options.max_iterations = 0;
  EXPECT_TRUE(options.validate().has_value());
}

}  // namespace
}  // namespace zerodrift::diagnosis
