// SPDX-License-Identifier: Apache-2.0
#include "common/navigation/rest_detector.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>

#include "common/core/units.h"

namespace zerodrift::navigation {
namespace {

constexpr double kRateHz = 100.0;

// Feeds white noise of `sigma` about `rate` for a while.
class Feeder {
 public:
  Standing run(double duration_s, const Vector3& rate, double sigma) {
    Standing last = detector.standing();
    for (int k = 0; k < static_cast<int>(duration_s * kRateHz); ++k) {
      ++sample;
      const Vector3 noise(normal(random), normal(random), normal(random));
      last = detector.add(core::from_seconds(sample / kRateHz), rate + sigma * noise);
    }
    return last;
  }
  RestDetector detector{RestDetectorOptions{}};
  std::mt19937_64 random{5};
  std::normal_distribution<double> normal;
  int sample = 0;
};

TEST(RestDetectorScenario, StandingIsSeenAfterWindowAndDwellAndDrivingOffWithinAWindow) {
  Feeder feeder;
  const double noise = core::radps_from_deg_h(1.0);
  feeder.run(1.4, Vector3::Zero(), noise);
  EXPECT_EQ(feeder.detector.standing(), Standing::kSettling);
  feeder.run(0.2, Vector3::Zero(), noise);  // 0.5 s of window and 1 s of dwell are over
  EXPECT_EQ(feeder.detector.standing(), Standing::kAtRest);
  EXPECT_NEAR(core::seconds(feeder.detector.since()), 0.5, 0.02);
  // 0.05 deg/s is five sigma: T passes 2 once 8 % of the window hold it.
  feeder.run(0.05, {0.0, 0.0, 0.05 * core::kRadPerDeg}, noise);
  EXPECT_EQ(feeder.detector.standing(), Standing::kMoving);
  EXPECT_EQ(feeder.detector.since(), core::kNever);
  feeder.run(2.2, Vector3::Zero(), noise);
  EXPECT_EQ(feeder.detector.standing(), Standing::kAtRest);
}

TEST(RestDetectorScenario, BetweenTheThresholdsTheStateStays) {
  // T = 1.5: above `enter`, below `leave`.
  const Vector3 between(std::sqrt(1.5) * RestDetectorOptions{}.rate_sigma_radps, 0.0, 0.0);
  Feeder moving;
  EXPECT_EQ(moving.run(5.0, between, 0.0), Standing::kMoving);
  Feeder resting;
  resting.run(5.0, Vector3::Zero(), 0.0);
  EXPECT_EQ(resting.run(5.0, between, 0.0), Standing::kAtRest);
}

// Rotation below sigma can't be told from drift by this detector; the filters' innovations can.
TEST(RestDetectorScenario, VibrationAroundZeroIsNoRest) {
  Feeder feeder;
  EXPECT_EQ(feeder.run(5.0, Vector3::Zero(), 0.05 * core::kRadPerDeg), Standing::kMoving);
}

TEST(RestDetectorScenario, SpecificForceTellsAccelerationThatTheGyroCannotSee) {
  RestDetector detector{RestDetectorOptions{}};
  for (int k = 1; k <= 300; ++k) {
    detector.add(core::from_seconds(k * 0.01), Vector3::Zero(), Vector3(0.0, 0.0, -9.80665));
  }
  EXPECT_EQ(detector.standing(), Standing::kAtRest);
  for (int k = 301; k <= 350; ++k) {
    detector.add(core::from_seconds(k * 0.01), Vector3::Zero(), Vector3(2.0, 0.0, -9.80665));
  }
  EXPECT_EQ(detector.standing(), Standing::kMoving);
}

// The sums are running ones: a thousand times a fast turn must leave nothing in them.
TEST(RestDetectorLaws, WhatPassedThroughTheWindowLeavesNothing) {
  Feeder feeder;
  for (int k = 0; k < 50; ++k) {
    feeder.run(0.5, {20.0, -15.0, 10.0}, 1.0);
    feeder.run(0.6, Vector3::Zero(), 0.0);
  }
  // The square of 27 rad/s is 700; 1e5 roundings of it are 1e-8 at most, against sigma² n = 1.5e-6.
  EXPECT_LT(feeder.detector.statistic(), 0.01);
}

TEST(RestDetectorAbuse, GapsDisorderAndNonsenseNeverLookLikeRest) {
  Feeder feeder;
  feeder.run(3.0, Vector3::Zero(), 0.0);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(feeder.detector.add(core::from_seconds(3.01), {nan, 0.0, 0.0}), Standing::kMoving);
  feeder.sample = 1000;
  EXPECT_EQ(feeder.run(3.0, Vector3::Zero(), 0.0), Standing::kAtRest);
  EXPECT_EQ(feeder.detector.add(core::from_seconds(100.0), Vector3::Zero()), Standing::kUnknown);
  EXPECT_EQ(feeder.detector.add(core::from_seconds(1.0), Vector3::Zero()), Standing::kUnknown);
  EXPECT_EQ(feeder.detector.moving(), Standing::kMoving);
  EXPECT_THROW(RestDetector({.enter = 3.0, .leave = 2.0}), std::invalid_argument);
  EXPECT_THROW(RestDetector({.window_s = nan}), std::invalid_argument);
}

}  // namespace
}  // namespace zerodrift::navigation
