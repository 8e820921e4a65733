// SPDX-License-Identifier: Apache-2.0
#include "common/allan/coefficients.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>
#include <vector>

#include "common/allan/noise_units.h"
#include "common/allan/rolling_allan.h"
#include "common/core/units.h"
#include "tests/unit/allan/noise_sources.h"

namespace zerodrift::allan {
namespace {

// The curve of given coefficients, without noise, 0.01 s to 2^20 times that.
std::vector<AllanPoint> curve(const PerNoiseTerm<double>& coefficients) {
  std::vector<AllanPoint> points;
  for (double tau = 0.01; tau < 1e4; tau *= 2.0) {
    AllanPoint p;
    p.tau_s = tau;
    p.deviation_radps = std::sqrt(model_variance(coefficients, tau));
    p.degrees_of_freedom = 1e5 / tau;
    points.push_back(p);
  }
  return points;
}

TEST(CoefficientLaws, AnExactCurveGivesItsCoefficientsBack) {
  const PerNoiseTerm<double> truth{2e-9, 3e-7, 8e-8, 1e-9, 1e-11};
  CoefficientOptions options;
  options.fitted = {true, true, true, true, true};
  const CoefficientReport report = fit_coefficients(curve(truth), options);
  EXPECT_EQ(report.status, FitStatus::kConverged);
  for (const NoiseTerm term : kNoiseTerms) {
    // Normal equations of condition up to 1e6 in double.
    EXPECT_NEAR(report[term].value / truth[index(term)], 1.0, 1e-6) << symbol(term);
    EXPECT_LE(report[term].lower, report[term].value);
    EXPECT_GE(report[term].upper, report[term].value);
  }
}

TEST(CoefficientLaws, ScalingTheCurveScalesTheCoefficients) {
  auto points = curve({0.0, 3e-7, 8e-8, 1e-9, 0.0});
  points[7].deviation_radps *= 1.005;  // two sigma: the fit is not exact, and explains it
  const CoefficientReport once = fit_coefficients(points);
  for (AllanPoint& p : points) p.deviation_radps *= 1000.0;
  const CoefficientReport thousandfold = fit_coefficients(points);
  for (const NoiseTerm term :
       {NoiseTerm::kAngleRandomWalk, NoiseTerm::kBiasInstability, NoiseTerm::kRateRandomWalk}) {
    EXPECT_NEAR(thousandfold[term].value / once[term].value, 1000.0, 1e-5) << symbol(term);
    EXPECT_NEAR(thousandfold[term].upper / once[term].upper, 1000.0, 1e-5) << symbol(term);
  }
}

TEST(CoefficientLaws, ATermThatIsNotThereGetsAnUpperBound) {
  const CoefficientReport report = fit_coefficients(curve({0.0, 3e-7, 8e-8, 0.0, 0.0}));
  EXPECT_EQ(report[NoiseTerm::kRateRandomWalk].identification, Identification::kUpperBound);
  EXPECT_EQ(report[NoiseTerm::kRateRandomWalk].lower, 0.0);
  EXPECT_GT(report[NoiseTerm::kRateRandomWalk].upper, 0.0);
  EXPECT_EQ(report[NoiseTerm::kAngleRandomWalk].identification, Identification::kInterval);
  EXPECT_EQ(report[NoiseTerm::kQuantization].identification, Identification::kNotFitted);
}

// The first three of 20 octaves are half of what the rest says; one more goes for good measure.
TEST(CoefficientLaws, OnlyTheOctavesThatDoNotFitAreLeftOutAndOnlyWhereThatHelps) {
  const PerNoiseTerm<double> truth{0.0, 3e-7, 8e-8, 1e-9, 0.0};
  auto points = curve(truth);
  const CoefficientOptions options{.most_octaves_left_out = kMostOctavesLeftOut};
  EXPECT_EQ(fit_coefficients(points, options).shortest_tau_s, points.front().tau_s);
  for (std::size_t i = 0; i < 3; ++i) points[i].deviation_radps *= 0.5;
  const CoefficientReport report = fit_coefficients(points, options);
  EXPECT_EQ(report.shortest_tau_s, points[4].tau_s);
  EXPECT_EQ(report.points, points.size() - 4);
  EXPECT_NEAR(report[NoiseTerm::kAngleRandomWalk].value / 3e-7, 1.0, 1e-6);
  // Nothing explains a dip in the middle, with the first octaves or without.
  points = curve(truth);
  points[8].deviation_radps *= 0.5;
  EXPECT_EQ(fit_coefficients(points, options).points, points.size());
}

// The integral behind the table, by a Riemann sum with a step of a 32nd of the shorter tau.
double integrated_correlation(int alpha, double ratio) {
  const auto s = [alpha](double t) {
    const double u = std::abs(t);
    if (alpha == 0) return u;
    if (alpha == -1) return u == 0.0 ? 0.0 : u * u * std::log(u);
    return u * u * u;
  };
  const auto covariance = [&](double t, double a, double b) {
    constexpr double kWeights[] = {1.0, -2.0, 1.0};
    double sum = 0.0;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) sum += kWeights[i] * kWeights[j] * s(t - i * a + j * b);
    }
    return sum;
  };
  const auto integral = [&](double a, double b) {
    double sum = 0.0;
    const double extent = 20.0 * (a + b);
    for (double t = -extent; t <= extent; t += 1.0 / 32.0) {
      const double c = covariance(t, a, b);
      sum += c * c;
    }
    return sum;
  };
  return integral(1.0, ratio) / std::sqrt(integral(1.0, 1.0) * integral(ratio, ratio));
}

TEST(CoefficientLaws, TabulatedCorrelationsEqualTheirIntegral) {
  for (const double ratio : {1.0, std::exp2(0.25), 2.0, std::exp2(2.75), 16.0}) {
    // Half a unit of the table's last digit + the step of the sum.
    EXPECT_NEAR(variance_correlation(NoiseTerm::kAngleRandomWalk, ratio),
                integrated_correlation(0, ratio), 1e-3);
    EXPECT_NEAR(variance_correlation(NoiseTerm::kBiasInstability, ratio),
                integrated_correlation(-1, ratio), 1e-3);
    EXPECT_NEAR(variance_correlation(NoiseTerm::kRateRandomWalk, ratio),
                integrated_correlation(-2, ratio), 1e-3);
  }
  EXPECT_EQ(variance_correlation(NoiseTerm::kBiasInstability, 4.0),
            variance_correlation(NoiseTerm::kBiasInstability, 0.25));
}

// One run: truth within the 99.9 % interval of each coefficient (fixed seed), and the widths are
// those the data allow.
TEST(CoefficientScenario, SimulatedNoiseIsRecovered) {
  constexpr std::uint64_t kSeed = 31;
  constexpr double kInterval = 0.05;
  const double n = angle_random_walk_rad_rts(9.33e-4);
  const double b = core::radps_from_deg_h(1.57e-2);
  const double k = rate_random_walk_radps_rts(4.49e-2);
  test::WhiteNoise white(n, kInterval, kSeed);
  test::Flicker flicker(b, kInterval, 0.05, 20, kSeed + 1);
  test::RandomWalk walk(k, kInterval, kSeed + 2);
  RollingAllan allan(
      {.sample_interval_s = kInterval, .grid = TauGrid::kQuarterOctave, .longest_tau_s = 1e4});
  for (int i = 0; i < 5 * 3600 * 20; ++i) allan.add(white.next() + flicker.next() + walk.next());
  CoefficientOptions options;
  options.confidence = 0.999;
  const CoefficientReport report = fit_coefficients(allan.points(Span::kSinceStart), options);
  EXPECT_EQ(report.status, FitStatus::kConverged);
  const auto covers = [&](NoiseTerm term, double truth) {
    const Coefficient& c = report[term];
    EXPECT_LE(c.lower, truth) << symbol(term) << ", seed " << kSeed;
    EXPECT_GE(c.upper, truth) << symbol(term) << ", seed " << kSeed;
  };
  covers(NoiseTerm::kAngleRandomWalk, n);
  covers(NoiseTerm::kBiasInstability, b);
  covers(NoiseTerm::kRateRandomWalk, k);
  EXPECT_EQ(report[NoiseTerm::kAngleRandomWalk].identification, Identification::kInterval);
  EXPECT_LT(report[NoiseTerm::kAngleRandomWalk].upper / report[NoiseTerm::kAngleRandomWalk].lower,
            1.05);
}

TEST(SlopeReading, ReadsPureNoisesExactly) {
  for (const NoiseTerm term : kNoiseTerms) {
    PerNoiseTerm<double> truth{};
    truth[index(term)] = 3.3e-7;
    const auto read = read_slopes(curve(truth));
    ASSERT_TRUE(read[index(term)].has_value()) << symbol(term);
    EXPECT_NEAR(*read[index(term)] / 3.3e-7, 1.0, 1e-12) << symbol(term);
    for (const NoiseTerm other : kNoiseTerms) {
      if (other != term && other != NoiseTerm::kBiasInstability) {
        EXPECT_FALSE(read[index(other)].has_value()) << symbol(other);
      }
    }
  }
}

TEST(NoiseUnits, FollowTheDefinitions) {
  // y in deg/h, t in s: N[deg/√h] = N/60, K[deg/h^1.5] = 60 K.
  const double one_deg_h = core::radps_from_deg_h(1.0);
  EXPECT_NEAR(angle_random_walk_deg_rth(one_deg_h), 1.0 / 60.0, 1e-15);
  EXPECT_NEAR(rate_random_walk_deg_h_rth(one_deg_h), 60.0, 1e-12);
  EXPECT_NEAR(angle_random_walk_rad_rts(angle_random_walk_deg_rth(0.7)), 0.7, 1e-15);
  EXPECT_NEAR(rate_random_walk_radps_rts(rate_random_walk_deg_h_rth(0.7)), 0.7, 1e-15);
}

TEST(CoefficientAbuse, TooFewOrUselessPointsFitNothing) {
  EXPECT_EQ(fit_coefficients({}).status, FitStatus::kTooFewPoints);
  auto points = curve({0.0, 1.0, 0.0, 0.0, 0.0});
  for (AllanPoint& p : points) p.deviation_radps = std::nan("");
  EXPECT_EQ(fit_coefficients(points).status, FitStatus::kTooFewPoints);
  for (AllanPoint& p : points) p.deviation_radps = 0.0;
  const CoefficientReport stuck = fit_coefficients(points);
  EXPECT_EQ(stuck.status, FitStatus::kTooFewPoints);
  EXPECT_EQ(stuck[NoiseTerm::kAngleRandomWalk].identification, Identification::kNotFitted);
  EXPECT_FALSE(read_slopes({})[0].has_value());
}

TEST(CoefficientAbuse, WrongOptionsAreNamed) {
  CoefficientOptions options;
  options.fitted = {};
  EXPECT_NE(options.validate()->find("fitted"), std::string::npos);
  EXPECT_THROW((void)fit_coefficients({}, options), std::invalid_argument);
  EXPECT_NE(CoefficientOptions{.confidence = 1.0}.validate()->find("confidence"),
            std::string::npos);
  EXPECT_NE(CoefficientOptions{.min_degrees_of_freedom = 0.0}.validate()->find("min_degrees"),
            std::string::npos);
  EXPECT_NE(CoefficientOptions{.max_iterations = 0}.validate()->find("max_iterations"),
            std::string::npos);
  EXPECT_NE(CoefficientOptions{.most_octaves_left_out = -1}.validate()->find("most_octaves"),
            std::string::npos);
}

}  // namespace
}  // namespace zerodrift::allan
