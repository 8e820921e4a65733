// SPDX-License-Identifier: Apache-2.0
#include "common/twin/thermal_plant.h"

#include <gtest/gtest.h>

#include "tests/unit/twin/examples.h"

namespace zerodrift::twin {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

double at_point(const ThermalState& state, TemperaturePoint point) {
  return state.temperature_degc[index(point)];
}

TEST(ThermalPlantLaws, SteadyStateIsTheResistorNetworks) {
  const ThermalParameters parameters;
  Profile profile = examples::still(1e5);
  profile.chamber = {{0.0, 50.0}};
  ThermalPlant plant(parameters, profile);
  const ThermalState state = plant.at(seconds(100'000));
  // All board power leaves through case_board and chamber_case. The slowest time constant is about
  // 2000 s, so 1e5 s leave exp(-50) of the transient; 1e-9 K is rounding.
  const double case_degc = 50.0 + parameters.board_power_w / parameters.chamber_case_w_per_k;
  const double board_degc = case_degc + parameters.board_power_w / parameters.case_board_w_per_k;
  EXPECT_NEAR(at_point(state, TemperaturePoint::kChamber), 50.0, 1e-12);
  EXPECT_NEAR(at_point(state, TemperaturePoint::kCase), case_degc, 1e-9);
  EXPECT_NEAR(at_point(state, TemperaturePoint::kCoilOuter), case_degc, 1e-9);
  EXPECT_NEAR(at_point(state, TemperaturePoint::kCoilInner), case_degc, 1e-9);
  EXPECT_NEAR(at_point(state, TemperaturePoint::kCoil), case_degc, 1e-9);
  EXPECT_NEAR(at_point(state, TemperaturePoint::kBoard), board_degc, 1e-9);
}

TEST(ThermalPlantLaws, StoredHeatIsWhatFlowedIn) {
  const ThermalParameters p;
  ThermalPlant plant(p, examples::heating_and_cooling());
  const auto stored_j = [&p](const ThermalState& s) {
    return p.case_capacity_j_per_k * at_point(s, TemperaturePoint::kCase) +
           p.coil_outer_capacity_j_per_k * at_point(s, TemperaturePoint::kCoilOuter) +
           p.coil_inner_capacity_j_per_k * at_point(s, TemperaturePoint::kCoilInner) +
           p.board_capacity_j_per_k * at_point(s, TemperaturePoint::kBoard);
  };
  const auto inflow_w = [&p](const ThermalState& s) {
    return p.board_power_w + p.chamber_case_w_per_k * (at_point(s, TemperaturePoint::kChamber) -
                                                       at_point(s, TemperaturePoint::kCase));
  };
  const ThermalState start = plant.at(seconds(0));
  ThermalState previous = start;
  double flowed_j = 0.0;
  for (int step = 1; step <= 60'000; ++step) {
    const ThermalState state = plant.at(step * ThermalPlant::kStep);
    flowed_j += 0.1 * 0.5 * (inflow_w(previous) + inflow_w(state));
    previous = state;
  }
  // Some 4e4 J flow. Trapezoid error: h²/12 * [change of the flow's slope, < 1 W/s] < 1e-3 J.
  EXPECT_GT(flowed_j, 1e4);
  EXPECT_NEAR(stored_j(previous) - stored_j(start), flowed_j, 1e-3);
}

TEST(ThermalPlantLaws, ReadingAtOtherTimesChangesNoBit) {
  const Profile profile = examples::heating_and_cooling();
  ThermalPlant often({}, profile);
  ThermalPlant rarely({}, profile);
  for (int ms = 0; ms <= 7'000'000; ms += 5) {
    const ThermalState state = often.at(milliseconds(ms));
    if (ms % 350'005 != 0) continue;
    const ThermalState other = rarely.at(milliseconds(ms));
    EXPECT_EQ(state.temperature_degc, other.temperature_degc) << ms;
    EXPECT_EQ(state.temperature_rate_degc_per_s, other.temperature_rate_degc_per_s) << ms;
  }
}

TEST(ThermalPlantLaws, RatesAreTheSlopesOfTheTemperatures) {
  ThermalPlant plant({}, examples::heating_and_cooling());
  const ThermalState before = plant.at(milliseconds(2'999'900));
  const ThermalState now = plant.at(seconds(3000));
  const ThermalState after = plant.at(milliseconds(3'000'100));
  for (std::size_t i = 0; i < kTemperaturePointCount; ++i) {
    const double slope = (after.temperature_degc[i] - before.temperature_degc[i]) / 0.2;
    // Central difference: h²/6 T''' < 1e-9, rounding 1e-14/0.2.
    EXPECT_NEAR(now.temperature_rate_degc_per_s[i], slope, 1e-9) << name(TemperaturePoint{i});
  }
}

TEST(ThermalPlantLaws, PowerBeforeTheRecordWarmsTheBoardBeforeTheRecord) {
  Profile profile = examples::still(100.0);
  profile.power_on_s = -36000.0;
  ThermalPlant plant({}, profile);
  // Steady since ten hours: 3 W through 1.2 W/K and 0.5 W/K.
  EXPECT_NEAR(at_point(plant.at(seconds(0)), TemperaturePoint::kBoard), 20.0 + 2.5 + 6.0, 1e-6);
}

TEST(ThermalPlantLaws, InnerCoilFollowsOuterCoilFollowsCase) {
  ThermalPlant plant({}, examples::heating_and_cooling());
  const ThermalState state = plant.at(seconds(3000));
  EXPECT_LT(at_point(state, TemperaturePoint::kCoilInner),
            at_point(state, TemperaturePoint::kCoilOuter));
  EXPECT_LT(at_point(state, TemperaturePoint::kCoilOuter),
            at_point(state, TemperaturePoint::kCase));
}

}  // namespace
}  // namespace zerodrift::twin
