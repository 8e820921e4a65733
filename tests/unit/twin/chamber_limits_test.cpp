// SPDX-License-Identifier: Apache-2.0
#include "common/twin/chamber_limits.h"

#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "common/core/units.h"

namespace zerodrift::twin {
namespace {

ChamberLimits everything() {
  return {.duration_s = 7200.0,
          .low_degc = 0.0,
          .high_degc = 40.0,
          .ramp_degc_per_s = 2.0 / 60.0,
          .rate_radps = 10.0 * core::kRadPerDeg,
          .magnetic_ut = 100.0,
          .tilt_rad = 30.0 * core::kRadPerDeg,
          .vibration_g = 2.0,
          .source_current_ma = 5.0,
          .supply_v = 0.25,
          .off_s = 300.0};
}

// All channels at the limit.
Profile at_the_limits() {
  using enum ExcitedQuantity;
  Profile profile;
  profile.duration_s = 7200.0;
  profile.initial_temperature_degc = 0.0;
  profile.chamber = {{0.0, 0.0}, {1200.0, 40.0}};
  profile.power_cycles = {{3000.0, 3300.0}};
  profile.turns = {{100.0, 300.0, core::Axis::kZ, -10.0 * core::kRadPerDeg, 5.0}};
  profile.excitations = {{0.0, 7200.0, kAccelerationMps2, core::Axis::kZ, 9.80665, 0.0},
                         {100.0, 300.0, kAccelerationMps2, core::Axis::kX, -4.903325, 5.0},
                         {100.0, 300.0, kMagneticUt, core::Axis::kY, 60.0, 5.0},
                         {200.0, 300.0, kMagneticUt, core::Axis::kY, 40.0, 5.0},
                         {100.0, 300.0, kVibrationG, core::Axis::kX, 2.0, 5.0},
                         {100.0, 300.0, kSourceCurrentMa, core::Axis::kX, -5.0, 5.0},
                         {100.0, 300.0, kSupplyV, core::Axis::kX, 0.25, 5.0}};
  return profile;
}

TEST(ChamberLimitsLaws, AProfileAtEveryLimitFits) {
  EXPECT_EQ(find_excess(at_the_limits(), everything()), std::nullopt);
}

TEST(ChamberLimitsLaws, WhatIsAboveALimitIsToldByItsKeyInTheFile) {
  struct Case {
    const char* key;
    std::function<void(ChamberLimits&)> lower;
    std::string expected;
  };
  for (const Case& one : std::vector<Case>{
           {"duration_s", [](auto& l) { l.duration_s = 7000.0; }, "expected at most 7000"},
           {"temperature.low_degc", [](auto& l) { l.low_degc = 5.0; }, "expected at least 5"},
           {"temperature.high_degc", [](auto& l) { l.high_degc = 35.0; }, "expected at most 35"},
           {"temperature.ramp_degc_per_min", [](auto& l) { l.ramp_degc_per_s = 1.0 / 60.0; },
            "found 2, expected at most 1"},
           {"rate_table.largest_deg_s", [](auto& l) { l.rate_radps = 5.0 * core::kRadPerDeg; },
            "found 10, expected at most 5"},
           {"magnetic.largest_ut", [](auto& l) { l.magnetic_ut = 90.0; }, "found 100"},
           {"tilt.largest_deg", [](auto& l) { l.tilt_rad = 20.0 * core::kRadPerDeg; }, "found 30"},
           {"vibration.largest_g", [](auto& l) { l.vibration_g.reset(); }, "expected none"},
           {"source_current.change_ma", [](auto& l) { l.source_current_ma = 1.0; }, "found 5"},
           {"supply.change_v", [](auto& l) { l.supply_v = 0.1; }, "found 0.25"},
           {"power.off_s", [](auto& l) { l.off_s.reset(); }, "expected none"}}) {
    ChamberLimits limits = everything();
    one.lower(limits);
    const auto found = find_excess(at_the_limits(), limits);
    ASSERT_TRUE(found) << one.key;
    EXPECT_EQ(found->rfind(std::string(one.key) + ": ", 0), 0U) << *found;
    EXPECT_NE(found->find(one.expected), std::string::npos) << *found;
  }
}

TEST(ChamberLimitsAbuse, BoundsThatContradictEachOtherAreRefused) {
  ChamberLimits limits = everything();
  EXPECT_EQ(limits.find_problem(), std::nullopt);
  limits.high_degc = -10.0;
  ASSERT_TRUE(limits.find_problem());
  EXPECT_EQ(limits.find_problem()->key, "temperature.high_degc");
  limits.high_degc.reset();
  ASSERT_TRUE(limits.find_problem());
  EXPECT_NE(limits.find_problem()->what.find("found no high_degc"), std::string::npos);
}

// A step takes no time: no chamber follows it.
TEST(ChamberLimitsAbuse, AStepOfTheTemperatureIsTooFast) {
  Profile profile = at_the_limits();
  profile.chamber = {{1000.0, 0.0}, {1000.0, 10.0}};
  const auto found = find_excess(profile, everything());
  ASSERT_TRUE(found);
  EXPECT_EQ(found->rfind("temperature.ramp_degc_per_min: ", 0), 0U) << *found;
}

}  // namespace
}  // namespace zerodrift::twin
