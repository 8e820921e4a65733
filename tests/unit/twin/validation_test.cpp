// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "common/twin/simulation.h"
#include "tests/unit/twin/examples.h"

namespace zerodrift::twin {
namespace {

using examples::effect;
using examples::model_of;

void expect_problem(const std::optional<std::string>& problem, const std::string& expected_part) {
  ASSERT_TRUE(problem) << "expected: " << expected_part;
  EXPECT_NE(problem->find(expected_part), std::string::npos) << *problem;
  EXPECT_EQ(problem->find('\n'), std::string::npos) << *problem;
}

TEST(ModelAbuse, AnUnknownEffectIsNamedWithTheClosestKnownOne) {
  expect_problem(model_of({effect("shuppe", {})}).validate(),
                 "effects[0].kind: the catalogue has no effect 'shuppe'; did you mean 'shupe'?");
}

TEST(ModelAbuse, AnUnknownParameterIsNamedWithTheClosestKnownOne) {
  expect_problem(model_of({effect("bias", {{"bias_rad_s", 0.1}})}).validate(),
                 "effects[0].parameters.bias_rad_s: 'bias' has no such parameter; did you mean "
                 "'bias_deg_h'?");
}

TEST(ModelAbuse, ParametersOutOfRangeOrNotFiniteAreRefused) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  expect_problem(model_of({effect("warm_up", {{"tau_s", -1.0}})}).validate(),
                 "tau_s: must be within");
  expect_problem(model_of({effect("bias", {{"bias_deg_h", nan}})}).validate(), "bias_deg_h");
  expect_problem(model_of({effect("bias", {{"bias_deg_h", infinity}})}).validate(), "bias_deg_h");
}

TEST(ModelAbuse, WrongInputsAreRefused) {
  EffectSpec spec = effect("gradient", {});
  spec.inputs = {"coil_outer"};
  expect_problem(model_of({spec}).validate(),
                 "effects[0].inputs: 'gradient' reads 2 temperature(s)");
  spec.inputs = {"coil_outer", "coil_iner"};
  expect_problem(model_of({spec}).validate(), "did you mean 'coil_inner'?");
}

TEST(ModelAbuse, WrongProbesAreRefused) {
  Model model = model_of({});
  model.probes[1].rate_hz = -4.0;
  expect_problem(model.validate(), "probes[1].rate_hz: must be above 0");
  model = model_of({});
  model.probes[1].name = "coil";
  expect_problem(model.validate(), "probes[1].name: two probes are called 'coil'");
  model.probes[1].name = "Coil 2";
  expect_problem(model.validate(), "probes[1].name: must be 1 to 31 characters");
}

TEST(ModelAbuse, AnImpossiblePlantIsRefused) {
  Model model = model_of({});
  model.thermal_plant.case_capacity_j_per_k = 0.0;
  expect_problem(model.validate(), "thermal_plant.case_capacity_j_per_k: must be above 0");
  model.thermal_plant.case_capacity_j_per_k = 0.1;
  expect_problem(model.validate(), "time constant");
}

TEST(ModelLaws, ANewerModelMayNameEffectsThatAreNotKnownHere) {
  Model model = model_of({effect("of_tomorrow", {{"size", 1.0}})});
  ASSERT_TRUE(model.validate());
  model.format_version = kModelFormatVersion + 1;
  EXPECT_FALSE(model.validate());
  GyroSimulation gyro(model, examples::still(1.0), 1, 10.0);
  EXPECT_EQ(gyro.next()->rate_radps[0], 0.0);
}

TEST(ProfileAbuse, WrongTimesTemperaturesAndTurnsAreRefused) {
  Profile profile = examples::still(0.0);
  expect_problem(profile.validate(), "duration_s: must be within");
  profile = examples::still(100.0);
  profile.chamber = {{10.0, 20.0}, {5.0, 20.0}};
  expect_problem(profile.validate(), "chamber[1].time_s");
  profile.chamber = {{10.0, -300.0}};
  expect_problem(profile.validate(), "chamber[0].temperature_degc");
  profile.chamber.clear();
  profile.turns = {{.start_s = 1.0, .duration_s = 3.0, .rate_radps = 1.0, .ramp_s = 2.0}};
  expect_problem(profile.validate(), "turns[0].ramp_s");
  profile.turns.clear();
  profile.earth_rate = {.latitude_rad = 2.0};
  expect_problem(profile.validate(), "earth_rate.latitude_deg");
}

TEST(SimulationAbuse, AWrongRateModelOrProbeThrowsOneClearLine) {
  const Model model = model_of({});
  const Profile profile = examples::still(1.0);
  EXPECT_THROW(GyroSimulation(model, profile, 1, -200.0), std::invalid_argument);
  EXPECT_THROW(GyroSimulation(model, profile, 1, 0.0), std::invalid_argument);
  EXPECT_THROW(GyroSimulation(model_of({effect("no", {})}), profile, 1, 200.0),
               std::invalid_argument);
  try {
    ThermometerSimulation(model, profile, 1, "coill");
    FAIL() << "no exception";
  } catch (const std::invalid_argument& error) {
    EXPECT_STREQ(error.what(), "probe: the model has no 'coill'; did you mean 'coil'?");
  }
}

}  // namespace
}  // namespace zerodrift::twin
