// SPDX-License-Identifier: Apache-2.0
#include "common/twin/simulation.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <vector>

#include "common/core/units.h"
#include "common/twin/sample_clock.h"
#include "tests/unit/twin/examples.h"

namespace zerodrift::twin {
namespace {

using examples::effect;
using examples::model_of;

Model noisy_model() {
  std::vector<EffectSpec> effects;
  for (const core::Axis axis : core::kAxes) {
    effects.push_back(effect("bias", {{"bias_deg_h", 0.3}}, axis));
    effects.push_back(effect("shupe", {{"coefficient_deg_h_min_per_degc", 1.5}}, axis));
    effects.push_back(effect("angle_random_walk", {{"coefficient_deg_per_sqrt_h", 1e-3}}, axis));
    effects.push_back(effect("bias_instability", {{"coefficient_deg_h", 0.02}}, axis));
    effects.push_back(effect("rate_random_walk", {{"coefficient_deg_per_h_1_5", 0.05}}, axis));
  }
  return model_of(effects);
}

std::vector<std::uint64_t> bits_of(const core::AngularRateSample& sample) {
  return {sample.sequence, std::bit_cast<std::uint64_t>(sample.time.count()),
          std::bit_cast<std::uint64_t>(sample.rate_radps[0]),
          std::bit_cast<std::uint64_t>(sample.rate_radps[1]),
          std::bit_cast<std::uint64_t>(sample.rate_radps[2])};
}

std::vector<double> readings(ThermometerSimulation& thermometer, std::size_t count) {
  std::vector<double> values;
  while (values.size() < count) {
    const auto sample = thermometer.next();
    if (!sample) break;
    values.push_back(sample->temperature_degc);
  }
  return values;
}

TEST(GyroSimulationLaws, TwoInstancesAgreeToTheBit) {
  const Profile profile = examples::heating_and_cooling();
  GyroSimulation one(noisy_model(), profile, 11, 200.0);
  GyroSimulation two(noisy_model(), profile, 11, 200.0);
  for (int i = 0; i < 200'000; ++i) {
    const auto a = one.next();
    const auto b = two.next();
    ASSERT_TRUE(a && b);
    ASSERT_EQ(bits_of(*a), bits_of(*b)) << "sample " << i << ", seed 11";
  }
}

TEST(GyroSimulationLaws, AnotherSeedGivesAnotherNoiseAndTheSameTemperatures) {
  const Profile profile = examples::heating_and_cooling();
  GyroSimulation one(noisy_model(), profile, 11, 10.0);
  GyroSimulation two(noisy_model(), profile, 12, 10.0);
  for (int i = 0; i < 1000; ++i) {
    const auto a = one.next();
    const auto b = two.next();
    ASSERT_TRUE(a && b);
    ASSERT_NE(a->rate_radps, b->rate_radps);
    ASSERT_EQ(one.thermal_state().temperature_degc, two.thermal_state().temperature_degc);
  }
}

TEST(ThermometerSimulationLaws, ReadingsAgreeToTheBitInAnyOrderOfProbes) {
  const Profile profile = examples::heating_and_cooling();
  const Model model = noisy_model();
  ThermometerSimulation coil_first(model, profile, 5, "coil");
  const auto coil_alone = readings(coil_first, 20'000);
  ThermometerSimulation board(model, profile, 5, "board");
  ThermometerSimulation coil(model, profile, 5, "coil");
  std::vector<double> coil_interleaved;
  for (int i = 0; i < 20'000; ++i) {
    (void)board.next();
    coil_interleaved.push_back(coil.next()->temperature_degc);
  }
  EXPECT_EQ(coil_alone, coil_interleaved);
}

TEST(ThermometerSimulationLaws, GyroAndThermometerShareOneThermalTruth) {
  const Profile profile = examples::heating_and_cooling();
  GyroSimulation gyro(noisy_model(), profile, 5, 200.0);
  ThermometerSimulation board(noisy_model(), profile, 5, "board");  // 4 Hz: every 50th sample
  for (int i = 0; i < 2000; ++i) {
    const auto reading = board.next();
    auto sample = gyro.next();
    while (sample && sample->time < reading->time) sample = gyro.next();
    ASSERT_TRUE(sample);
    ASSERT_EQ(sample->time, reading->time);
    ASSERT_EQ(board.true_temperature_degc(),
              gyro.thermal_state().temperature_degc[index(TemperaturePoint::kBoard)]);
  }
}

TEST(ThermometerSimulationLaws, ReadsTheNodeBehindItsLagWithinNoiseAndQuantisation) {
  Profile profile = examples::heating_and_cooling();
  profile.duration_s = 3900.0;
  ThermometerSimulation coil(noisy_model(), profile, 5, "coil");
  ThermalPlant plant({}, profile);
  const double lag_s = 5.0;
  double squares = 0.0;
  int count = 0;
  while (const auto reading = coil.next()) {
    const double steps = reading->temperature_degc / 0.01;
    ASSERT_NEAR(steps, std::round(steps), 1e-6);
    EXPECT_EQ(reading->probe, "coil");
    EXPECT_EQ(reading->clock, core::ClockSource::kSimulation);
    // On a slow ramp a lag of tau reads what was tau seconds ago, up to tau² T''/2 < 5e-5 K.
    const ThermalState state = plant.at(reading->time);
    const std::size_t node = index(TemperaturePoint::kCoil);
    const double expected =
        state.temperature_degc[node] - lag_s * state.temperature_rate_degc_per_s[node];
    squares += std::pow(reading->temperature_degc - expected, 2.0);
    ++count;
  }
  // Noise 0.005 and the uniform error of a 0.01 step, 0.01/√12: together 0.00577 °C. n = 39000:
  // sampling error 0.4 %, and the dependence of the two adds less than 5 %.
  EXPECT_EQ(count, 39'000);
  EXPECT_NEAR(std::sqrt(squares / count), 0.00577, 0.06 * 0.00577);
}

TEST(SampleClockLaws, TimesAreTheNearestNanosecondsAndNeverDrift) {
  EXPECT_EQ(sample_time(3'599'999, 200.0).count(), 17'999'995'000'000);
  EXPECT_EQ(sample_time(3, 3.0).count(), 1'000'000'000);
  EXPECT_EQ(sample_time(1, 3.0).count(), 333'333'333);
  EXPECT_EQ(sample_time(2, 3.0).count(), 666'666'667);
  EXPECT_EQ(sample_time(864'000'000, 1000.0).count(), 864'000'000'000'000);
}

TEST(GyroSimulationLaws, GivesEverySampleOfTheProfileOnce) {
  GyroSimulation gyro(noisy_model(), examples::still(10.0), 1, 200.0);
  std::uint64_t count = 0;
  while (const auto sample = gyro.next()) {
    ASSERT_EQ(sample->sequence, count);
    ASSERT_EQ(sample->time, sample_time(count, 200.0));
    ASSERT_EQ(sample->interval_s, 0.005);
    ASSERT_EQ(sample->clock, core::ClockSource::kSimulation);
    ++count;
  }
  EXPECT_EQ(count, 2000U);
  EXPECT_FALSE(gyro.next());
}

TEST(GyroSimulationLaws, SamplesBeforePowerOnAreInvalidAndNaN) {
  Profile profile = examples::still(10.0);
  profile.power_on_s = 4.0;
  GyroSimulation gyro(noisy_model(), profile, 1, 10.0);
  while (const auto sample = gyro.next()) {
    const bool powered = sample->time >= std::chrono::seconds(4);
    for (const core::Axis axis : core::kAxes) {
      ASSERT_EQ(sample->valid[core::index(axis)], powered);
      ASSERT_EQ(std::isfinite(sample->rate_radps[core::index(axis)]), powered);
    }
  }
}

TEST(GyroSimulationLaws, MeasuredRateIsTrueRatePlusTrueDriftPlusWhiteNoise) {
  Model model = noisy_model();
  std::erase_if(model.effects, [](const auto& e) { return e.kind == "angle_random_walk"; });
  Profile profile = examples::heating_and_cooling();
  profile.turns = {{.start_s = 50.0,
                    .duration_s = 20.0,
                    .axis = core::Axis::kY,
                    .rate_radps = 0.17,
                    .ramp_s = 2.0}};
  GyroSimulation gyro(model, profile, 3, 50.0);
  while (const auto sample = gyro.next()) {
    for (const core::Axis axis : core::kAxes) {
      const std::size_t i = core::index(axis);
      ASSERT_EQ(sample->rate_radps[i], gyro.true_rate_radps()[i] + gyro.true_drift_radps()[i]);
    }
  }
}

TEST(TrueMotionLaws, ATurnTurnsThroughItsWholeAngleAtItsRate) {
  Profile profile = examples::still(400.0);
  const double rate = 10.0 * core::kRadPerDeg;
  profile.turns = {{.start_s = 50.0031,
                    .duration_s = 300.0,
                    .axis = core::Axis::kZ,
                    .rate_radps = rate,
                    .ramp_s = 2.0}};
  GyroSimulation gyro(model_of({}), profile, 1, 200.0);
  double angle = 0.0;
  while (const auto sample = gyro.next()) {
    const double true_rate = gyro.true_rate_radps()[2];
    angle += true_rate * sample->interval_s;
    const double t = core::seconds(sample->time);
    // Difference of angles of up to 52 rad over 5 ms: 2 * 7e-15 / 5e-3 = 3e-12 rad/s.
    if (t > 60.0 && t < 340.0) {
      ASSERT_NEAR(true_rate, rate, 3e-12);
    }
    if (t <= 50.0 || t > 350.01) {
      ASSERT_EQ(true_rate, 0.0);
    }
    ASSERT_EQ(gyro.true_rate_radps()[0], 0.0);
  }
  // 8e4 additions of 1e-3 rad: rounding below 1e-10.
  EXPECT_NEAR(angle, rate * (300.0 - 2.0), 1e-10);
}

TEST(TrueMotionLaws, EarthRateAtRestIsThatOfLatitudeAndAttitude) {
  Profile profile = examples::still(1.0);
  const double latitude = 45.0 * core::kRadPerDeg;
  profile.earth_rate = {.latitude_rad = latitude};
  GyroSimulation level_north(model_of({}), profile, 1, 10.0);
  (void)level_north.next();
  // Facing north and level: forward W cos L, left 0, up W sin L.
  EXPECT_NEAR(level_north.true_rate_radps()[0], core::kEarthRateRadps * std::cos(latitude), 1e-18);
  EXPECT_NEAR(level_north.true_rate_radps()[1], 0.0, 1e-18);
  EXPECT_NEAR(level_north.true_rate_radps()[2], core::kEarthRateRadps * std::sin(latitude), 1e-18);
  profile.earth_rate->heading_rad = 90.0 * core::kRadPerDeg;
  GyroSimulation level_east(model_of({}), profile, 1, 10.0);
  (void)level_east.next();
  // Facing east, north is to the left.
  EXPECT_NEAR(level_east.true_rate_radps()[0], 0.0, 1e-18);
  EXPECT_NEAR(level_east.true_rate_radps()[1], core::kEarthRateRadps * std::cos(latitude), 1e-18);
  profile.earth_rate = {.latitude_rad = latitude, .pitch_rad = latitude};
  GyroSimulation along_axis(model_of({}), profile, 1, 10.0);
  (void)along_axis.next();
  // Nose up by the latitude: forward points to the celestial pole.
  EXPECT_NEAR(along_axis.true_rate_radps()[0], core::kEarthRateRadps, 1e-18);
}

TEST(TrueMotionLaws, EarthRateTurnsWithTheBody) {
  Profile profile = examples::still(100.0);
  profile.earth_rate = EarthRateSetup{};  // equator, facing north: all of it along x
  profile.turns = {{.start_s = 10.0,
                    .duration_s = 9.0,
                    .axis = core::Axis::kZ,
                    .rate_radps = 10.0 * core::kRadPerDeg}};
  GyroSimulation gyro(model_of({}), profile, 1, 100.0);
  while (const auto sample = gyro.next()) {
  }
  // Turned left by 90°: north is now to the right. 900 rotations: rounding only.
  EXPECT_NEAR(gyro.true_rate_radps()[0], 0.0, 1e-16);
  EXPECT_NEAR(gyro.true_rate_radps()[1], -core::kEarthRateRadps, 1e-16);
}

}  // namespace
}  // namespace zerodrift::twin
