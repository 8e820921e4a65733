// SPDX-License-Identifier: Apache-2.0
// What a profile does to the gyro beside temperature and motion, and what faults do to samples.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include "common/core/units.h"
#include "common/twin/effect_catalogue.h"
#include "common/twin/simulation.h"
#include "tests/unit/twin/examples.h"

namespace zerodrift::twin {
namespace {

using examples::effect;
using examples::model_of;
using examples::still;

TEST(ExcitationLaws, ARecordHasTheChannelsThatTheProfileMovesOrTheModelNeeds) {
  Profile profile = still(10.0);
  EXPECT_EQ(environment_channels(model_of({}), profile), 0U);
  EXPECT_EQ(
      environment_channels(model_of({effect("magnetic", {{"x_deg_h_per_ut", 0.01}})}), profile),
      0b111U);
  profile.excitations = {
      {.start_s = 0.0, .duration_s = 5.0, .quantity = ExcitedQuantity::kSupplyV, .value = 0.25}};
  EXPECT_EQ(environment_channels(model_of({}), profile), 1U << 8U);
  GyroSimulation gyro(model_of({}), profile, 1, 1.0);
  ASSERT_TRUE(gyro.next());
  EXPECT_EQ(core::channel(gyro.environment(), 8), kNominalSupplyV + 0.25);
}

TEST(ExcitationLaws, RampsUpHoldsAndRampsDown) {
  const Excitation block{.start_s = 10.0,
                         .duration_s = 20.0,
                         .quantity = ExcitedQuantity::kVibrationG,
                         .value = 4.0,
                         .ramp_s = 5.0};
  EXPECT_EQ(excited_value(block, 9.9), 0.0);
  EXPECT_DOUBLE_EQ(excited_value(block, 12.5), 2.0);
  EXPECT_EQ(excited_value(block, 15.0), 4.0);
  EXPECT_EQ(excited_value(block, 24.0), 4.0);
  EXPECT_DOUBLE_EQ(excited_value(block, 29.0), 0.8);
  EXPECT_EQ(excited_value(block, 30.0), 0.0);
  const Excitation step{.start_s = 10.0, .duration_s = 20.0, .value = 4.0};
  EXPECT_EQ(excited_value(step, 10.0), 4.0);
  EXPECT_EQ(excited_value(step, 30.0), 0.0);
}

TEST(ExcitationScenario, BlocksAddUpOnWhatIsThereAndReachTheEffects) {
  Profile profile = still(100.0);
  profile.excitations = {
      {0.0, 100.0, ExcitedQuantity::kAccelerationMps2, core::Axis::kZ, 9.80665, 0.0},
      {50.0, 50.0, ExcitedQuantity::kAccelerationMps2, core::Axis::kZ, -9.80665, 0.0},
      {50.0, 50.0, ExcitedQuantity::kMagneticUt, core::Axis::kY, 100.0, 0.0},
      {50.0, 50.0, ExcitedQuantity::kVibrationG, core::Axis::kX, 2.0, 0.0},
      {50.0, 50.0, ExcitedQuantity::kSourceCurrentMa, core::Axis::kX, -5.0, 0.0},
      {50.0, 50.0, ExcitedQuantity::kSupplyV, core::Axis::kX, 0.25, 0.0}};
  ASSERT_FALSE(profile.validate());
  const Model model = model_of(
      {effect("acceleration_sensitivity", {{"x_deg_h_per_g", 0.0}, {"z_deg_h_per_g", 0.3}}),
       effect("magnetic", {{"x_deg_h_per_ut", 0.0}, {"y_deg_h_per_ut", 1e-3}}),
       effect("vibration_rectification", {{"coefficient_deg_h_per_g2", 0.02}}),
       effect("source_intensity", {{"coefficient_deg_h_per_ma", 0.01}})});
  GyroSimulation gyro(model, profile, 1, 1.0);
  for (int i = 0; i < 100; ++i) {
    const auto sample = gyro.next();
    ASSERT_TRUE(sample);
    const double expected = i < 50 ? 0.3 : 0.1 + 0.08 - 0.05;
    ASSERT_NEAR(core::deg_h_from_radps(sample->rate_radps[0]), expected, 1e-14) << i;
    ASSERT_EQ(gyro.inputs().supply_v, kNominalSupplyV + (i < 50 ? 0.0 : 0.25));
  }
}

TEST(PowerCycleScenario, SamplesAreMissingWhileOffAndWarmUpStartsAgain) {
  Profile profile = still(1000.0);
  profile.power_cycles = {{400.0, 500.0}};
  GyroSimulation gyro(model_of({effect("warm_up", {{"amplitude_deg_h", 0.5}, {"tau_s", 100.0}})}),
                      profile, 1, 1.0);
  for (int i = 0; i < 1000; ++i) {
    const auto sample = gyro.next();
    ASSERT_TRUE(sample);
    const bool off = i >= 400 && i < 500;
    ASSERT_EQ(sample->valid[0], !off) << i;
    ASSERT_EQ(std::isnan(sample->rate_radps[0]), off) << i;
    if (off) continue;
    const double since = i < 400 ? i : i - 500;
    ASSERT_NEAR(core::deg_h_from_radps(sample->rate_radps[0]), 0.5 * std::exp(-since / 100.0),
                1e-14);
  }
}

TEST(PowerCycleScenario, TheBoardCoolsWhileOff) {
  Profile once = still(20'000.0);
  Profile cycled = once;
  cycled.power_cycles = {{10'000.0, 10'600.0}};
  ThermalPlant steady({}, once);
  ThermalPlant interrupted({}, cycled);
  const std::size_t board = index(TemperaturePoint::kBoard);
  const auto difference = [&](double time_s) {
    const auto time = core::from_seconds(time_s);
    return steady.at(time).temperature_degc[board] - interrupted.at(time).temperature_degc[board];
  };
  EXPECT_EQ(difference(9'999.9), 0.0);
  // 3 W over 0.5 W/K: 6 °C above the case, with a time constant of 160 s; ten minutes take nearly
  // all of it.
  EXPECT_GT(difference(10'600.0), 5.5);
  // Ten time constants of the slowest path (case to air, about 900 s) after it: gone.
  EXPECT_LT(difference(19'600.0), 0.05);
}

TEST(RecordFaultScenario, LostSamplesAreInvalidAndClippedOnesSaySo) {
  Profile profile = still(2000.0);
  profile.turns = {
      {.start_s = 100.0, .duration_s = 100.0, .axis = core::Axis::kX, .rate_radps = 0.5}};
  const Model model = model_of({effect("dropped_samples", {{"share", 0.2}}),
                                effect("saturation", {{"limit_deg_s", 10.0}}),
                                effect("bias", {{"bias_deg_h", 0.1}})});
  GyroSimulation gyro(model, profile, 1, 1.0);
  int lost = 0;
  int clipped = 0;
  while (const auto sample = gyro.next()) {
    EXPECT_EQ(sample->valid[0], std::isfinite(sample->rate_radps[0]));
    EXPECT_TRUE(sample->valid[1] && sample->valid[2]);
    EXPECT_NEAR(core::deg_h_from_radps(gyro.true_drift_radps()[0]), 0.1, 1e-14);
    lost += sample->valid[0] ? 0 : 1;
    if (!sample->clipped[0]) continue;
    ++clipped;
    EXPECT_DOUBLE_EQ(sample->rate_radps[0], 10.0 * core::kRadPerDeg);
  }
  EXPECT_NEAR(lost, 400, 5 * 18);   // √(2000 * 0.2 * 0.8) = 18; 5 sigma
  EXPECT_NEAR(clipped, 80, 5 * 4);  // the turn's samples that weren't lost, √(100 * 0.16) = 4
}

TEST(ProfileAbuse, WrongExcitationsAndPowerCyclesAreRefusedByKey) {
  const auto problem_of = [](const Excitation& excitation) {
    Profile profile = still(100.0);
    profile.excitations = {excitation};
    const auto problem = profile.find_problem();
    return problem ? problem->key : "none";
  };
  EXPECT_EQ(problem_of({.start_s = 1.0, .duration_s = 2.0, .value = 1.0}), "none");
  EXPECT_EQ(problem_of({.start_s = -1.0, .duration_s = 2.0}), "excitations[0].start_s");
  EXPECT_EQ(problem_of({.start_s = 1.0}), "excitations[0].duration_s");
  EXPECT_EQ(problem_of({.start_s = 1.0, .duration_s = 2.0, .ramp_s = 1.5}),
            "excitations[0].ramp_s");
  EXPECT_EQ(
      problem_of(
          {.start_s = 1.0, .duration_s = 2.0, .value = std::numeric_limits<double>::quiet_NaN()}),
      "excitations[0].value");
  Profile profile = still(100.0);
  profile.power_cycles = {{10.0, 20.0}, {15.0, 30.0}};
  EXPECT_EQ(profile.find_problem()->key, "power_cycles[1].off_s");
  profile.power_cycles = {{10.0, 5.0}};
  EXPECT_EQ(profile.find_problem()->key, "power_cycles[0].on_s");
  profile.power_on_s = 50.0;
  EXPECT_EQ(profile.find_problem()->key, "power_cycles[0].off_s");
}

TEST(DependsOnLaws, OnlyEffectsThatAreSimulatedCount) {
  EXPECT_TRUE(
      depends_on(model_of({effect("magnetic", {{"x_deg_h_per_ut", 1e-3}})}), Need::kMagnetic));
  EXPECT_FALSE(depends_on(model_of({effect("magnetic", {})}), Need::kMagnetic));
  EXPECT_FALSE(depends_on(model_of({effect("bias", {{"bias_deg_h", 0.1}})}), Need::kMagnetic));
}

}  // namespace
}  // namespace zerodrift::twin
