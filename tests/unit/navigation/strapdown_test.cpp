// SPDX-License-Identifier: Apache-2.0
#include "common/navigation/strapdown.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace zerodrift::navigation {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kEps = 2.2e-16;

double angle_between(const Quaternion& a, const Quaternion& b) {
  return rotation_vector(a * b.conjugate()).norm();
}

TEST(RotationLaws, EulerAnglesAndRotationVectorsComeBack) {
  constexpr std::uint64_t kSeed = 3;
  SCOPED_TRACE(kSeed);
  std::mt19937_64 random(kSeed);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (int k = 0; k < 5000; ++k) {
    const Attitude a{kPi * unit(random), 1.5 * unit(random), kPi * unit(random)};
    const Attitude back = attitude_of(n_from_b(a));
    // A pitch of 1.5 rad loses a factor 1 / cos = 14 of the digits in roll and heading.
    EXPECT_NEAR(wrapped(back.roll_rad - a.roll_rad), 0.0, 1e-13);
    EXPECT_NEAR(back.pitch_rad, a.pitch_rad, 1e-13);
    EXPECT_NEAR(wrapped(back.heading_rad - a.heading_rad), 0.0, 1e-13);
    const double size = std::pow(10.0, 8.0 * unit(random) - 7.6);  // 2.5e-16 to 2.5
    const Vector3 v = size * Vector3(unit(random), unit(random), unit(random)).normalized();
    EXPECT_LT((rotation_vector(quaternion_of(v)) - v).norm(), 1e-14 * std::max(1.0, v.norm()));
  }
}

TEST(RotationLaws, ABodyFrameIsTakenThereAndBack) {
  for (const BodyFrame frame : {BodyFrame::kForwardLeftUp, BodyFrame::kForwardRightDown}) {
    const core::PerAxis<double> v{1.0, -2.0, 3.0};
    EXPECT_EQ(from_forward_right_down(to_forward_right_down(v, frame), frame), v);
  }
  EXPECT_EQ(to_forward_right_down({1.0, 2.0, 3.0}, BodyFrame::kForwardLeftUp),
            Vector3(1.0, -2.0, -3.0));
}

TEST(StrapdownLaws, AConstantRateTurnsAsItsClosedForm) {
  constexpr double kInterval = 0.005;
  constexpr int kSteps = 20000;
  const Vector3 rate(0.3, -0.7, 1.1);
  const Quaternion start = n_from_b({0.1, -0.2, 2.0});
  Strapdown strapdown(Vector3::Zero());
  strapdown.set(start);
  for (int k = 0; k < kSteps; ++k) strapdown.advance(rate * kInterval, kInterval);
  const Quaternion expected = start * quaternion_of(rate * kInterval * kSteps);
  // Each step rounds a few times; the sum of kSteps roundings walks, here bounded by their sum.
  EXPECT_LT(angle_between(strapdown.n_from_b(), expected), 10.0 * kEps * kSteps);
  EXPECT_NEAR(strapdown.n_from_b().norm(), 1.0, 4.0 * kEps);
}

// A gyro at rest against the Earth, in any attitude.
TEST(StrapdownLaws, EarthRateAloneLeavesTheAttitudeWhereItIs) {
  constexpr double kInterval = 0.01;
  constexpr int kSteps = 100000;
  for (const double latitude : {-1.2, 0.0, 0.84}) {
    const Quaternion start = n_from_b({0.5, 0.3, -2.5});
    Strapdown strapdown(earth_rate_radps_n(latitude));
    strapdown.set(start);
    const Vector3 rate = start.conjugate() * earth_rate_radps_n(latitude);
    for (int k = 0; k < kSteps; ++k) strapdown.advance(rate * kInterval, kInterval);
    EXPECT_LT(angle_between(strapdown.n_from_b(), start), 10.0 * kEps * kSteps);
  }
}

// Over the Earth to the east along the equator, a level vehicle pitches with the Earth's curve; the
// transport rate is what n turns by: 20 m/s over WGS 84's equatorial radius.
TEST(StrapdownLaws, TransportRateKeepsALevelVehicleLevel) {
  constexpr double kInterval = 0.1;
  const Vector3 transport(20.0 / 6378137.0, 0.0, 0.0);
  Strapdown strapdown(earth_rate_radps_n(0.0));
  const Vector3 rate = earth_rate_radps_n(0.0) + transport;
  for (int k = 0; k < 10000; ++k) strapdown.advance(rate * kInterval, kInterval, transport);
  EXPECT_LT(angle_between(strapdown.n_from_b(), Quaternion::Identity()), 1e-11);
}

// Coning: q(t) = exp of the rotation vector a (0, cos wt, sin wt). Its body rate (Savage 1998, eq.
// 7 with a constant half-angle) is w (2 sin²(a/2), -sin a sin wt, sin a cos wt) up to the sign of
// the first; the delta-angles below are its exact integrals.
struct Coning {
  double half_angle_rad;
  double rate_radps;
  [[nodiscard]] Quaternion attitude(double t) const {
    return quaternion_of(half_angle_rad *
                         Vector3(0.0, std::cos(rate_radps * t), std::sin(rate_radps * t)));
  }
  [[nodiscard]] Vector3 delta_angle(double from, double to) const {
    const double s = std::sin(half_angle_rad / 2.0);
    return {-2.0 * s * s * rate_radps * (to - from),
            std::sin(half_angle_rad) * (std::cos(rate_radps * to) - std::cos(rate_radps * from)),
            std::sin(half_angle_rad) * (std::sin(rate_radps * to) - std::sin(rate_radps * from))};
  }
};

// What is left of a coning motion's drift about its axis after 2 s.
double coning_error(double interval_s, bool with_coning) {
  const Coning motion{.half_angle_rad = 0.02, .rate_radps = 2.0 * kPi * 5.0};
  Strapdown strapdown(Vector3::Zero());
  strapdown.set(motion.attitude(0.0));
  const auto steps = static_cast<int>(std::lround(2.0 / interval_s));
  for (int k = 0; k < steps; ++k) {
    if (!with_coning) strapdown.interrupt();
    strapdown.advance(motion.delta_angle(k * interval_s, (k + 1) * interval_s), interval_s);
  }
  return rotation_vector(motion.attitude(steps * interval_s) * strapdown.n_from_b().conjugate())
      .x();
}

TEST(StrapdownLaws, ConingDriftFallsWithTheFourthPowerOfTheInterval) {
  for (const double interval : {0.02, 0.01}) {
    const double coarse = std::abs(coning_error(interval, true));
    const double fine = std::abs(coning_error(interval / 2.0, true));
    std::printf("interval %.3f s: %.3e rad, half of it: %.3e rad, order %.2f\n", interval, coarse,
                fine, std::log2(coarse / fine));
    // The leading term is h^4; the next is relative (w h)² = 0.4 and 0.1.
    EXPECT_NEAR(std::log2(coarse / fine), 4.0, 0.5);
  }
  const double plain = std::abs(coning_error(0.01, false));
  EXPECT_NEAR(std::log2(plain / std::abs(coning_error(0.005, false))), 2.0, 0.1);
  EXPECT_GT(plain, 20.0 * std::abs(coning_error(0.01, true)));
}

TEST(StrapdownLaws, AfterAnInterruptionNoConingTermReachesBack) {
  Strapdown one(Vector3::Zero());
  one.advance({0.1, 0.0, 0.0}, 0.01);
  one.interrupt();
  one.advance({0.0, 0.1, 0.0}, 0.01);
  Strapdown other(Vector3::Zero());
  other.set(quaternion_of({0.1, 0.0, 0.0}));
  other.advance({0.0, 0.1, 0.0}, 0.01);
  EXPECT_LT(angle_between(one.n_from_b(), other.n_from_b()), 10.0 * kEps);
}

}  // namespace
}  // namespace zerodrift::navigation
