// SPDX-License-Identifier: Apache-2.0
#include "common/navigation/earth_rate.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <stdexcept>

namespace zerodrift::navigation {
namespace {

constexpr double kPi = std::numbers::pi;
// Three plane rotations, each a few roundings of numbers below the Earth rate: 20 ulp of it.
constexpr double kRounding = 20.0 * 2.2e-16 * core::kEarthRateRadps;

void expect_rate(const core::PerAxis<double>& rate, const core::PerAxis<double>& expected) {
  for (std::size_t i = 0; i < core::kAxisCount; ++i) EXPECT_NEAR(rate[i], expected[i], kRounding);
}

double norm(const core::PerAxis<double>& v) {
  return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

TEST(EarthRateLaws, MagnitudeIsTheEarthRateForAnyLatitudeAndAttitude) {
  constexpr std::uint64_t kSeed = 7;
  SCOPED_TRACE(kSeed);
  std::mt19937_64 random(kSeed);
  std::uniform_real_distribution<double> angle(-kPi, kPi);
  for (int i = 0; i < 10000; ++i) {
    const Attitude attitude{angle(random), angle(random), angle(random)};
    EXPECT_NEAR(norm(earth_rate_radps_b(angle(random) / 2.0, attitude)), core::kEarthRateRadps,
                kRounding);
  }
}

TEST(EarthRateLaws, TheTwoBodyFramesDifferInTheSignsOfYAndZ) {
  const Attitude attitude{0.3, -0.5, 2.0};
  const auto flu = earth_rate_radps_b(0.7, attitude, BodyFrame::kForwardLeftUp);
  const auto frd = earth_rate_radps_b(0.7, attitude, BodyFrame::kForwardRightDown);
  EXPECT_EQ(flu[0], frd[0]);
  EXPECT_EQ(flu[1], -frd[1]);
  EXPECT_EQ(flu[2], -frd[2]);
}

TEST(EarthRateGolden, AgreesWithRotationMatricesOfAnIndependentLibrary) {
  constexpr std::uint64_t kSeed = 11;
  SCOPED_TRACE(kSeed);
  std::mt19937_64 random(kSeed);
  std::uniform_real_distribution<double> angle(-kPi, kPi);
  for (int i = 0; i < 1000; ++i) {
    const Attitude a{angle(random), angle(random), angle(random)};
    const double latitude = angle(random) / 2.0;
    const Eigen::Vector3d ned =
        core::kEarthRateRadps * Eigen::Vector3d(std::cos(latitude), 0.0, -std::sin(latitude));
    const Eigen::Quaterniond ned_from_body =
        Eigen::AngleAxisd(a.heading_rad, Eigen::Vector3d::UnitZ()) *
        Eigen::AngleAxisd(a.pitch_rad, Eigen::Vector3d::UnitY()) *
        Eigen::AngleAxisd(a.roll_rad, Eigen::Vector3d::UnitX());
    const Eigen::Vector3d expected = ned_from_body.conjugate() * ned;
    expect_rate(earth_rate_radps_b(latitude, a, BodyFrame::kForwardRightDown),
                {expected.x(), expected.y(), expected.z()});
  }
}

TEST(EarthRateScenario, LevelGyroSeesNorthAndUpComponents) {
  const double w = core::kEarthRateRadps;
  expect_rate(earth_rate_radps_b(0.0, {}), {w, 0.0, 0.0});          // equator, facing north
  expect_rate(earth_rate_radps_b(kPi / 2.0, {}), {0.0, 0.0, w});    // north pole
  expect_rate(earth_rate_radps_b(-kPi / 2.0, {}), {0.0, 0.0, -w});  // south pole
  const double north = w * std::sqrt(3.0) / 2.0;
  expect_rate(earth_rate_radps_b(kPi / 6.0, {}), {north, 0.0, w / 2.0});
  // Facing east, north is to the left; facing south, behind.
  expect_rate(earth_rate_radps_b(kPi / 6.0, {0.0, 0.0, kPi / 2.0}), {0.0, north, w / 2.0});
  expect_rate(earth_rate_radps_b(kPi / 6.0, {0.0, 0.0, kPi}), {-north, 0.0, w / 2.0});
}

TEST(EarthRateScenario, NoseUpAndRightSideDownTurnTheAxesAsNamed) {
  const double w = core::kEarthRateRadps;
  // At the north pole the rate points up. Nose straight up: all on forward. Right side down: up is
  // to the left.
  expect_rate(earth_rate_radps_b(kPi / 2.0, {0.0, kPi / 2.0, 0.0}), {w, 0.0, 0.0});
  expect_rate(earth_rate_radps_b(kPi / 2.0, {kPi / 2.0, 0.0, 0.0}), {0.0, w, 0.0});
}

TEST(EarthRateScenario, UnknownAttitudeIsZeroRateAndFifteenDegPerHour) {
  for (const EarthRateOptions& options :
       {EarthRateOptions{}, EarthRateOptions{.latitude_rad = 0.8}}) {
    const EarthRate rate = earth_rate(options);
    for (std::size_t i = 0; i < core::kAxisCount; ++i) {
      EXPECT_EQ(rate.rate_radps_b[i], 0.0);
      // 15.041 deg/h to its printed digits.
      EXPECT_NEAR(core::deg_h_from_radps(std::sqrt(rate.variance[i])), 15.041, 5e-4);
    }
  }
}

TEST(EarthRateScenario, AttitudeUncertaintyMatchesRandomlyTiltedGyros) {
  constexpr std::uint64_t kSeed = 13;
  SCOPED_TRACE(kSeed);
  constexpr double kSigma = 0.01;
  constexpr int kDraws = 20000;
  const EarthRateOptions options{.latitude_rad = 0.6,
                                 .attitude = Attitude{0.2, -0.4, 1.1},
                                 .attitude_sigma_rad = kSigma,
                                 .frame = BodyFrame::kForwardLeftUp};
  const EarthRate rate = earth_rate(options);
  const Eigen::Vector3d w(rate.rate_radps_b.data());
  std::mt19937_64 random(kSeed);
  std::normal_distribution<double> normal(0.0, kSigma);
  Eigen::Vector3d square_sum = Eigen::Vector3d::Zero();
  for (int i = 0; i < kDraws; ++i) {
    const Eigen::Vector3d tilt(normal(random), normal(random), normal(random));
    const Eigen::Vector3d error = Eigen::AngleAxisd(tilt.norm(), tilt.normalized()) * w - w;
    square_sum += error.cwiseAbs2();
  }
  for (Eigen::Index i = 0; i < 3; ++i) {
    const double variance = rate.variance[static_cast<std::size_t>(i)];
    // A variance from n draws has relative sigma sqrt(2 / n) = 1 %; 5 sigma, and second-order terms
    // sigma² = 1e-4.
    EXPECT_NEAR(square_sum[i] / kDraws, variance, 0.05 * variance + 1e-4 * variance);
  }
}

TEST(EarthRateLaws, KnownAttitudeIsNeverLessCertainThanNone) {
  for (const double sigma : {0.0, 0.01, 1.0, 3.0}) {
    const EarthRate rate = earth_rate({.latitude_rad = 0.5,
                                       .attitude = Attitude{0.1, 0.2, 0.3},
                                       .attitude_sigma_rad = sigma,
                                       .frame = BodyFrame::kForwardLeftUp});
    for (const double variance : rate.variance) {
      EXPECT_GE(variance, 0.0);
      EXPECT_LE(variance, kUnknownAttitudeSigmaRadps * kUnknownAttitudeSigmaRadps);
      EXPECT_EQ(variance == 0.0, sigma == 0.0);
    }
  }
}

TEST(EarthRateAbuse, WrongOptionsAreRefusedWithTheirKey) {
  const auto key_of = [](const EarthRateOptions& options) {
    const auto problem = options.validate();
    EXPECT_THROW((void)earth_rate(options), std::invalid_argument);
    return problem ? problem->substr(0, problem->find(' ')) : "";
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(key_of({.latitude_rad = 45.0}), "latitude_rad");  // degrees given for radians
  EXPECT_EQ(key_of({.latitude_rad = nan}), "latitude_rad");
  EXPECT_EQ(key_of({.attitude = Attitude{}}), "latitude_rad");
  EXPECT_EQ(key_of({.latitude_rad = 0.5, .attitude = Attitude{0.0, nan, 0.0}}), "attitude");
  EXPECT_EQ(key_of({.attitude_sigma_rad = -1.0}), "attitude_sigma_rad");
  EXPECT_EQ(key_of({.attitude_sigma_rad = nan}), "attitude_sigma_rad");
}

}  // namespace
}  // namespace zerodrift::navigation
