// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/playback.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/twin/effect_catalogue.h"
#include "tests/unit/diagnosis/simulated_series.h"

namespace zerodrift::diagnosis {
namespace {

using twin::TemperaturePoint;

MeasuredSeries series_with(const std::vector<std::string>& probes) {
  MeasuredSeries series;
  series.interval_s = 1.0;
  series.size = 4;
  for (std::size_t p = 0; p < probes.size(); ++p) {
    series.probes.push_back(
        {.name = probes[p],
         .temperature_degc = std::vector<double>(4, 10.0 * (1.0 + static_cast<double>(p))),
         .rate_degc_per_s = std::vector<double>(4, 0.1)});
  }
  for (auto& reference : series.reference_radps) reference.assign(4, 0.0);
  series.since_power_on_s = {1.0, 2.0, 3.0, 4.0};
  return series;
}

double at(const Playback& playback, TemperaturePoint point) {
  return playback.inputs().front().thermal.temperature_degc[twin::index(point)];
}

TEST(Playback, TheCoilIsTheMeanOfItsLayersAndNobodysPlaceBorrowsTheNearest) {
  const Playback playback(series_with({"coil_outer", "coil_inner"}));
  EXPECT_TRUE(playback.measures(TemperaturePoint::kCoil));
  EXPECT_EQ(at(playback, TemperaturePoint::kCoil), 15.0);
  EXPECT_FALSE(playback.measures(TemperaturePoint::kCase));
  EXPECT_EQ(at(playback, TemperaturePoint::kCase), 10.0);
  EXPECT_EQ(playback.source_of(TemperaturePoint::kBoard), TemperaturePoint::kCoilOuter);
}

TEST(Playback, AProbeOfAnotherNameStandsForTheCoil) {
  const Playback playback(series_with({"pt100_a"}));
  EXPECT_TRUE(playback.measures(TemperaturePoint::kCoil));
  EXPECT_EQ(playback.measured_points().size(), 1U);
}

TEST(PlaybackAbuse, WithoutThermometersEverythingIsAtRoomTemperature) {
  const Playback playback(series_with({}));
  EXPECT_TRUE(playback.measured_points().empty());
  EXPECT_EQ(at(playback, TemperaturePoint::kCoil), 25.0);
  EXPECT_FALSE(playback.source_of(TemperaturePoint::kCoil).has_value());
}

// The deterministic drift of the simulation, from what its thermometers say.
TEST(PlaybackScenario, RepeatsTheDriftOfTheSimulatedRecord) {
  twin::Model model = test::lab_model();
  for (const char* noise : {"angle_random_walk", "bias_instability", "rate_random_walk"})
    model = test::without(model, noise);
  const MeasuredSeries series = test::simulated(model, test::chamber_profile(), 1);
  const auto drift = Playback(series).drift(model, core::Axis::kX);
  double squares = 0.0;
  double count = 0.0;
  for (std::size_t i = 0; i < series.size; ++i) {
    if (series.valid[0][i] == 0) continue;
    const double left = series.rate_radps[0][i] - series.reference_radps[0][i] - drift[i];
    squares += left * left;
    count += 1.0;
  }
  // Thermometers: lag of 5 s (5 s * 2 °C/min * .012 deg/h/°C = .002 deg/h, and on the Shupe rate at
  // corners), steps of 0.01 °C: a hundredth of the drift's 1 deg/h.
  EXPECT_LT(core::deg_h_from_radps(std::sqrt(squares / count)), 0.01);
}

}  // namespace
}  // namespace zerodrift::diagnosis
