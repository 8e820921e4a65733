// SPDX-License-Identifier: Apache-2.0
#include "common/navigation/attitude_filter.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <cstdio>
#include <random>
#include <stdexcept>

#include "common/core/units.h"
#include "common/navigation/gyrocompass.h"

namespace zerodrift::navigation {
namespace {

using core::deg_h_from_radps;
using core::kRadPerDeg;
using core::radps_from_deg_h;

constexpr double kLatitude = 48.0 * kRadPerDeg;
constexpr double kInterval = 0.1;

AttitudeFilterOptions options() {
  AttitudeFilterOptions o;
  o.latitude_rad = kLatitude;
  o.tilt_sigma_rad = o.heading_sigma_rad = 0.1 * kRadPerDeg;
  o.claim_factor = 1.0;
  o.drift_walk_radps_sqrt_s = 0.0;
  return o;
}

void expect_sound(const Matrix6& p) {
  EXPECT_EQ((p - p.transpose()).cwiseAbs().maxCoeff(), 0.0);
  // Scaled to correlations: angles and rates differ by five orders of magnitude.
  const Vector6 scale = p.diagonal().cwiseSqrt().cwiseInverse();
  const Matrix6 correlation = scale.asDiagonal() * p * scale.asDiagonal();
  EXPECT_GT(Eigen::SelfAdjointEigenSolver<Matrix6>(correlation).eigenvalues().minCoeff(), 0.0);
}

TEST(AttitudeFilterLaws, CovarianceStaysSymmetricAndPositiveDefiniteWhateverComes) {
  constexpr std::uint64_t kSeed = 17;
  SCOPED_TRACE(kSeed);
  std::mt19937_64 random(kSeed);
  std::normal_distribution<double> normal;
  for (const Gyrocompassing compassing : {Gyrocompassing::kOff, Gyrocompassing::kOn}) {
    AttitudeFilterOptions o = options();
    o.gyrocompassing = compassing;
    AttitudeFilter filter(o);
    filter.start(n_from_b({0.2, -0.1, 1.0}), 1e-3, 1e-2, AttitudeFilter::Drift::kForget);
    for (int k = 0; k < 20000; ++k) {
      RateInterval interval;
      interval.interval_s = kInterval;
      interval.rate_radps = Vector3(normal(random), normal(random), normal(random)) * 0.2;
      interval.noise_variance.setConstant(1e-14);
      interval.drift_variance.setConstant(k % 5000 < 2500 ? 1e-14 * (1 + k % 100) : -1.0);
      filter.turn(interval);
      if (k % 50 == 0) {
        RestMean mean;
        mean.measured = {true, k % 100 == 0, true};
        mean.rate_radps = filter.earth_rate_b() + filter.drift_radps() +
                          1e-7 * Vector3(normal(random), normal(random), normal(random)) *
                              (k % 1000 == 0 ? 100.0 : 1.0);
        filter.rest(mean);
      }
      if (k % 700 == 0) filter.take_claim(static_cast<std::size_t>(k / 700 % 3), 1e-15);
      if (k % 900 == 0) filter.level_to(0.0, 0.0, 1e-3);
      if (k % 1100 == 0) filter.lose_b({1e-4, 0.0, 0.0});
    }
    expect_sound(filter.covariance());
  }
}

// Of a time without updates the variance of the angle is that of its parts: white noise (r h)² a
// sample, drift as an integral. With d constant, V t²; for white noise it would be V h t.
TEST(AttitudeFilterGolden, PublishedDriftVarianceIsTakenForWhatLasts) {
  const double drift_sigma = radps_from_deg_h(0.1);
  AttitudeFilterOptions o = options();
  o.latitude_rad.reset();
  o.tilt_sigma_rad = o.heading_sigma_rad = 0.0;
  o.drift_correlation_s = 1e9;
  AttitudeFilter filter(o);
  filter.take_claim(2, drift_sigma * drift_sigma);
  RateInterval interval;
  interval.interval_s = kInterval;
  interval.noise_variance.setZero();
  interval.drift_variance.setConstant(drift_sigma * drift_sigma);
  for (int k = 0; k < 36000; ++k) filter.turn(interval);
  const double sigma_deg = std::sqrt(filter.covariance()(2, 2)) / kRadPerDeg;
  // 0.1 deg/h for an hour; the correlation time of 1e9 s takes 1e-6 of it.
  EXPECT_NEAR(sigma_deg, 0.1, 1e-5);
}

// Gauss-Markov: the variance of the integral is 2 V tau² (t/tau - 1 + exp(-t/tau)).
TEST(AttitudeFilterGolden, ADriftThatForgetsSpreadsAsGaussMarkovDoes) {
  const double variance = std::pow(radps_from_deg_h(0.1), 2);
  AttitudeFilterOptions o = options();
  o.latitude_rad.reset();
  o.tilt_sigma_rad = o.heading_sigma_rad = 0.0;
  o.drift_correlation_s = 600.0;
  AttitudeFilter filter(o);
  for (std::size_t i = 0; i < 3; ++i) filter.take_claim(i, variance);
  RateInterval interval;
  interval.interval_s = kInterval;
  interval.noise_variance.setZero();
  interval.drift_variance.setConstant(variance);
  for (int k = 0; k < 36000; ++k) filter.turn(interval);
  const double expected = 2.0 * variance * 600.0 * 600.0 * (6.0 - 1.0 + std::exp(-6.0));
  // The discrete sum differs by h / tau.
  EXPECT_NEAR(filter.covariance()(2, 2) / expected, 1.0, 5e-4);
}

TEST(AttitudeFilterScenario, RestFindsTheDriftAndUndoesItsTurning) {
  AttitudeFilterOptions o = options();
  AttitudeFilter filter(o);
  const Quaternion truth = n_from_b({0.0, 0.0, 0.7});
  filter.start(truth, 1e-4, 1e-4, AttitudeFilter::Drift::kForget);
  const Vector3 drift(0.0, 0.0, radps_from_deg_h(3.0));
  RateInterval interval;
  interval.interval_s = kInterval;
  interval.rate_radps = truth.conjugate() * earth_rate_radps_n(kLatitude) + drift;
  interval.noise_variance.setConstant(1e-16);
  for (int k = 0; k < 3000; ++k) filter.turn(interval);  // 300 s: 0.25 degrees
  EXPECT_NEAR(rotation_vector(truth * filter.n_from_b().conjugate()).norm(), 0.25 * kRadPerDeg,
              1e-5);
  RestMean mean;
  mean.rate_radps = interval.rate_radps;
  mean.measured = {true, true, true};
  EXPECT_EQ(filter.rest(mean).innovation, Innovation::kAccepted);
  // All of the error came from the drift; what the random walk and Earth's part leave open is 1 %.
  EXPECT_NEAR(deg_h_from_radps(filter.drift_radps().z()), 3.0, 0.03);
  EXPECT_LT(rotation_vector(truth * filter.n_from_b().conjugate()).norm(), 0.01 * kRadPerDeg);
}

TEST(AttitudeFilterScenario, ATurnIsNeverTakenForDrift) {
  AttitudeFilter filter(options());
  RestMean mean;
  mean.measured = {true, true, true};
  mean.rate_radps = filter.earth_rate_b();
  for (int k = 0; k < 20; ++k) filter.rest(mean);
  const Matrix6 before = filter.covariance();
  mean.rate_radps.z() += radps_from_deg_h(20.0);
  EXPECT_EQ(filter.rest(mean).innovation, Innovation::kTurning);
  EXPECT_EQ(filter.covariance(), before);
  EXPECT_NEAR(deg_h_from_radps(filter.drift_radps().z()), 0.0, 1e-6);
}

TEST(AttitudeFilterScenario, AFilterTooSureOfItselfOpensAgain) {
  AttitudeFilter filter(options());
  RestMean mean;
  mean.measured = {true, true, true};
  mean.rate_radps = filter.earth_rate_b();
  for (int k = 0; k < 100; ++k) filter.rest(mean);
  mean.rate_radps.z() += radps_from_deg_h(0.5);
  int rejected = 0;
  while (filter.rest(mean).innovation == Innovation::kRejected && rejected < 20) ++rejected;
  EXPECT_GT(rejected, 0);
  EXPECT_LT(rejected, 8);  // 0.5 deg/h is 2^5 times the sigma of Earth's rate by tilt, 0.0176 deg/h
  for (int k = 0; k < 60; ++k) filter.rest(mean);
  EXPECT_NEAR(deg_h_from_radps(filter.drift_radps().z()), 0.5, 0.02);
}

// Two estimates from the same samples: the better one counts, never both.
TEST(AttitudeFilterLaws, AClaimReplacesTheOwnEstimateOnlyWhereItIsBetter) {
  AttitudeFilter filter(options());
  const double own = filter.covariance()(5, 5);
  filter.take_claim(2, 4.0 * own);
  EXPECT_EQ(filter.covariance()(5, 5), own);
  filter.take_claim(2, 0.25 * own);
  EXPECT_EQ(filter.covariance()(5, 5), 0.25 * own);
  filter.shift_drift({0.0, 0.0, 1e-7});
  EXPECT_EQ(filter.drift_radps().z(), -1e-7);
  filter.take_claim(2, 0.25 * own);  // as good: kept
  filter.take_claim(2, 0.2 * own);
  EXPECT_EQ(filter.drift_radps().z(), 0.0);
}

// Truth drawn from what the filter assumes, in everything: attitude, Gauss-Markov drift, noise of
// samples and at rest. NEES and NIS are then chi².
struct Consistency {
  double nees = 0.0;  // mean of 6 degrees of freedom
  double nis = 0.0;   // mean per degree of freedom
  int runs = 0;
};

Consistency monte_carlo(int runs, double claimed_share) {
  const double drift_sigma = radps_from_deg_h(0.2);
  const double noise_sigma = radps_from_deg_h(1.0);
  AttitudeFilterOptions o = options();
  o.gyrocompassing = Gyrocompassing::kOn;
  o.rest_rate_sigma_radps = radps_from_deg_h(0.02);
  Consistency result{.runs = runs};
  double nis_sum = 0.0;
  int nis_degrees = 0;
  for (int run = 0; run < runs; ++run) {
    std::mt19937_64 random(static_cast<std::uint64_t>(run) + 1000);
    std::normal_distribution<double> normal;
    const auto draw = [&](double sigma) {
      return Vector3(sigma * normal(random), sigma * normal(random), sigma * normal(random));
    };
    AttitudeFilter filter(o);
    const Quaternion estimate = n_from_b({0.02, -0.01, 0.5});
    filter.start(estimate, o.tilt_sigma_rad, o.heading_sigma_rad, AttitudeFilter::Drift::kForget);
    for (std::size_t i = 0; i < 3; ++i)
      filter.take_claim(i, claimed_share * drift_sigma * drift_sigma);
    Quaternion truth = quaternion_of(draw(o.tilt_sigma_rad)) * estimate;
    Vector3 drift = draw(drift_sigma);
    Strapdown exact(earth_rate_radps_n(kLatitude));
    exact.set(truth);
    const double kept = std::exp(-kInterval / o.drift_correlation_s);
    for (int k = 0; k < 6000; ++k) {
      const bool turns = k % 2000 < 1200;
      const Vector3 turning(0.0, 0.0, turns ? 0.1 * std::sin(0.01 * k) : 0.0);
      const Vector3 rate = turning + exact.n_from_b().conjugate() * earth_rate_radps_n(kLatitude);
      RateInterval interval;
      interval.interval_s = kInterval;
      interval.rate_radps = rate + drift + draw(noise_sigma);
      interval.noise_variance.setConstant(noise_sigma * noise_sigma);
      interval.drift_variance.setConstant(claimed_share * drift_sigma * drift_sigma);
      filter.turn(interval);
      exact.advance(rate * kInterval, kInterval);
      drift = kept * drift + draw(drift_sigma * std::sqrt(1.0 - kept * kept));
      if (turns || k % 10 != 9) continue;
      RestMean mean;
      mean.rate_radps = exact.n_from_b().conjugate() * earth_rate_radps_n(kLatitude) + drift +
                        draw(o.rest_rate_sigma_radps);
      mean.measured = {true, true, true};
      const InnovationReport report = filter.rest(mean);
      nis_sum += report.nis;
      nis_degrees += report.degrees;
    }
    Vector6 error;
    error << rotation_vector(exact.n_from_b() * filter.n_from_b().conjugate()),
        drift - filter.drift_radps();
    result.nees += error.dot(filter.covariance().ldlt().solve(error)) / runs;
  }
  result.nis = nis_sum / nis_degrees;
  return result;
}

TEST(AttitudeFilterScenario, IsConsistentWithWhatItAssumes) {
  const Consistency c = monte_carlo(60, 1.0);
  std::printf("NEES %.2f of 6, NIS %.3f of 1, %d runs\n", c.nees, c.nis, c.runs);
  // Chi² with 6 x 60 degrees of freedom: sigma sqrt(2 / 360) = 7.5 % of the mean; 4 sigma.
  EXPECT_NEAR(c.nees, 6.0, 6.0 * 4.0 * std::sqrt(2.0 / 360.0));
  // 60 runs x 240 updates x 3: sigma 0.7 %, white by the filter's own property; 4 sigma and the
  // 1 in 1e4 that the gate cuts off.
  EXPECT_NEAR(c.nis, 1.0, 0.03);
}

TEST(AttitudeFilterScenario, AnOptimisticClaimIsSeenInTheInnovations) {
  const Consistency c = monte_carlo(5, 0.04);  // a fifth of the true sigma
  EXPECT_GT(c.nis, 1.3);
}

// ----------------------------------------------------------------------------------- gyrocompass

CompassInput standing(double latitude, double heading, const Vector3& drift) {
  CompassInput input;
  input.latitude_rad = latitude;
  input.roll_rad = 0.03;
  input.pitch_rad = -0.05;
  input.measured = {true, true, true};
  const Quaternion q = n_from_b({0.03, -0.05, heading});
  input.rate_radps = q.conjugate() * earth_rate_radps_n(latitude) + drift;
  return input;
}

// Rule: what is stated of Earth's rate in b holds for any heading and however far it is lost, also
// where an axis lies along north. Before: there an error of a rad counted as none.
TEST(AttitudeFilterLaws, TheEarthsRateIsNoBetterKnownThanTheHeadingAlongNorthToo) {
  constexpr double kLatitudeRad = 0.8;
  AttitudeFilterOptions options;
  options.latitude_rad = kLatitudeRad;
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  for (const double heading_rad : {0.0, 0.02, 0.7, 1.5707963, 3.0}) {
    for (const double sigma_rad : {0.002, 0.1, 0.4, 0.8}) {
      AttitudeFilter filter(options);
      filter.start(n_from_b({0.0, 0.0, heading_rad}), 0.0, sigma_rad,
                   AttitudeFilter::Drift::kForget);
      const Vector3 stated =
          filter.earth_rate_variance_b(filter.covariance().topLeftCorner<3, 3>());
      Vector3 squares = Vector3::Zero();
      constexpr int kDraws = 4000;
      for (int k = 0; k < kDraws; ++k) {
        const double other_rad = heading_rad + sigma_rad * normal(random);
        const Vector3 there =
            n_from_b({0.0, 0.0, other_rad}).conjugate() * earth_rate_radps_n(kLatitudeRad);
        squares += (there - filter.earth_rate_b()).cwiseAbs2();
      }
      for (Eigen::Index i = 0; i < 2; ++i) {
        EXPECT_LT(squares[i] / kDraws, 1.1 * stated[i] + 1e-16)
            << heading_rad << ' ' << sigma_rad << ' ' << i;
      }
    }
  }
}

TEST(GyrocompassLaws, AnyHeadingIsFoundExactlyWithoutDrift) {
  for (double heading = -3.1; heading < 3.1; heading += 0.2) {
    for (const double latitude : {-1.3, 0.0, 0.84}) {
      const CompassResult found = gyrocompass(standing(latitude, heading, Vector3::Zero()));
      EXPECT_EQ(found.verdict, CompassVerdict::kFound);
      EXPECT_NEAR(wrapped(found.heading_rad - heading), 0.0, 1e-12);
    }
  }
}

TEST(GyrocompassScenario, AccuracyIsDriftAcrossNorthOverTheHorizontalEarthRate) {
  const double sigma = radps_from_deg_h(0.1);
  std::mt19937_64 random(23);
  std::normal_distribution<double> normal(0.0, sigma);
  double square = 0.0;
  constexpr int kDraws = 4000;
  double stated = 0.0;
  for (int k = 0; k < kDraws; ++k) {
    CompassInput input = standing(kLatitude, 1.0, {normal(random), normal(random), normal(random)});
    input.drift_sigma_radps.setConstant(sigma);
    const CompassResult found = gyrocompass(input);
    stated = found.sigma_rad;
    square += std::pow(wrapped(found.heading_rad - 1.0), 2);
  }
  EXPECT_NEAR(stated, sigma / (core::kEarthRateRadps * std::cos(kLatitude)), 1e-5);
  // A variance of n draws is known to sqrt(2 / n) = 2.2 %; 5 sigma.
  EXPECT_NEAR(square / kDraws / (stated * stated), 1.0, 0.11);
}

TEST(GyrocompassScenario, ItSaysWhereNorthCannotBeFound) {
  CompassInput input = standing(kLatitude, 0.3, Vector3::Zero());
  input.measured = {false, false, true};
  EXPECT_EQ(gyrocompass(input).verdict, CompassVerdict::kAxisMissing);
  EXPECT_EQ(gyrocompass(standing(1.57, 0.3, Vector3::Zero())).verdict, CompassVerdict::kNearPole);
  input = standing(kLatitude, 0.3, Vector3::Zero());
  input.drift_sigma_radps.setConstant(radps_from_deg_h(5.0));
  EXPECT_EQ(gyrocompass(input).verdict, CompassVerdict::kDriftTooLarge);
}

TEST(AttitudeFilterScenario, GyrocompassingWithinTheFilterReachesTheDriftsLimit) {
  AttitudeFilterOptions o = options();
  o.gyrocompassing = Gyrocompassing::kOn;
  o.heading_sigma_rad = 2.0 * kRadPerDeg;
  o.drift_sigma_radps = radps_from_deg_h(0.05);
  o.drift_walk_radps_sqrt_s = 0.0;
  AttitudeFilter filter(o);
  filter.start(n_from_b({0.0, 0.0, 0.51}), 1e-5, o.heading_sigma_rad,
               AttitudeFilter::Drift::kForget);
  RestMean mean;
  mean.measured = {true, true, true};
  mean.rate_radps = n_from_b({0.0, 0.0, 0.5}).conjugate() * earth_rate_radps_n(kLatitude);
  for (int k = 0; k < 600; ++k) filter.rest(mean);
  const double limit = radps_from_deg_h(0.05) / (core::kEarthRateRadps * std::cos(kLatitude));
  EXPECT_NEAR(std::sqrt(filter.covariance()(2, 2)) / limit, 1.0, 0.05);
  EXPECT_NEAR(attitude_of(filter.n_from_b()).heading_rad, 0.5, limit);
}

TEST(AttitudeFilterAbuse, WrongOptionsAreRefusedWithTheirKey) {
  AttitudeFilterOptions o;
  o.latitude_rad = 48.0;
  EXPECT_EQ(o.validate()->substr(0, 12), "latitude_rad");
  EXPECT_THROW(AttitudeFilter{o}, std::invalid_argument);
  o = {};
  o.gate = std::nan("");
  EXPECT_EQ(o.validate()->substr(0, 4), "gate");
}

}  // namespace
}  // namespace zerodrift::navigation
