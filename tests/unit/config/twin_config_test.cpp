// SPDX-License-Identifier: Apache-2.0
#include "common/config/twin_config.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <string>

#include "common/config/proto_to_yaml.h"
#include "common/config/whole_file.h"
#include "common/core/units.h"
#include "common/twin/simulation.h"
#include "tests/unit/config/error_after.h"

namespace zerodrift::config {
namespace {

class TwinFile : public testing::Test {
 protected:
  TwinFile() { std::filesystem::create_directories(folder_); }
  ~TwinFile() override { std::filesystem::remove_all(folder_); }

  [[nodiscard]] std::filesystem::path written(const std::string& text) const {
    const auto path = folder_ / "twin.yaml";
    write_whole(path, text);
    return path;
  }

  // What follows "<folder>/twin.yaml:" in the error of loading this text as a model.
  [[nodiscard]] std::string model_error(const std::string& text) const {
    return error_after((folder_ / "twin.yaml:").string(), [&] { (void)load_model(written(text)); });
  }

  [[nodiscard]] std::string profile_error(const std::string& text) const {
    return error_after((folder_ / "twin.yaml:").string(),
                       [&] { (void)load_profile(written(text)); });
  }

  std::filesystem::path folder_ = std::filesystem::temp_directory_path() /
                                  ("zerodrift_twin_file_" + std::to_string(::getpid()));
};

using TwinFileLaws = TwinFile;
using TwinFileAbuse = TwinFile;

TEST_F(TwinFileLaws, AFormulaIsReadAndWrittenAsItIs) {
  const std::string text =
      "format_version: 1\neffects:\n  - kind: formula\n    axis: y\n"
      "    formula: \"k * lag(T_coil - 18, tau) * B_x\"\n"
      "    parameters: {k: 0.01, tau: 300}\n    standard_errors: {k: 0.001}\n";
  const twin::Model model = load_model(written(text)).model;
  save_model(model, folder_ / "copy.yaml");
  const twin::Model copy = load_model(folder_ / "copy.yaml").model;
  ASSERT_EQ(copy.effects.size(), 1U);
  EXPECT_EQ(copy.effects[0].formula, "k * lag(T_coil - 18, tau) * B_x");
  EXPECT_EQ(copy.effects[0].parameters, model.effects[0].parameters);
  EXPECT_EQ(copy.effects[0].standard_errors, model.effects[0].standard_errors);
}

TEST_F(TwinFileAbuse, AWrongFormulaIsNamedByLineKeyAndCharacter) {
  EXPECT_EQ(model_error("format_version: 1\neffects:\n  - kind: formula\n    axis: y\n"
                        "    formula: \"k * T_coli\"\n"),
            "5: effects[0].formula: at character 5: no input is called 'T_coli'; did you mean "
            "'T_coil'?");
}

TEST_F(TwinFileLaws, AModelThatIsSavedAndLoadedIsTheSameToTheBit) {
  const auto original =
      load_model(std::filesystem::path(ZERODRIFT_SOURCE_DIR) / "config/models/paper_fog.yaml")
          .model;
  const auto path = folder_ / "copy.yaml";
  save_model(original, path);
  const auto copy = load_model(path);
  EXPECT_TRUE(copy.warnings.empty());
  EXPECT_EQ(to_yaml(to_proto(copy.model)), to_yaml(to_proto(original)));
  twin::Profile profile;
  profile.duration_s = 5.0;
  twin::GyroSimulation one(original, profile, 1, 200.0);
  twin::GyroSimulation two(copy.model, profile, 1, 200.0);
  while (const auto sample = one.next()) EXPECT_EQ(sample->rate_radps, two.next()->rate_radps);
}

TEST_F(TwinFileLaws, ANewerVersionsKeysAndEffectsAreKeptWarnedAboutAndWrittenBack) {
  const auto path = written(
      "format_version: 2\n"
      "gyro_id: a\n"
      "calibration: {lab: \"B 12\", steps: [1, 2.50, true]}\n"
      "thermal_plant: {fan_w: 2}\n"
      "effects:\n"
      "  - kind: bias\n"
      "    axis: x\n"
      "    parameters: {bias_deg_h: 0.5}\n"
      "    colour: blue\n"
      "  - kind: effect_of_tomorrow\n"
      "    axis: y\n"
      "    parameters: {size: 3}\n");
  const LoadedModel loaded = load_model(path);
  ASSERT_EQ(loaded.warnings.size(), 4U);
  EXPECT_NE(loaded.warnings[0].find(":3: calibration: unknown key"), std::string::npos);
  EXPECT_NE(
      loaded.warnings[3].find(":10: effects[1].kind: effect 'effect_of_tomorrow' is not known"),
      std::string::npos);
  EXPECT_EQ(loaded.model.effects[0].parameters.at("bias_deg_h"), 0.5);

  twin::Model changed = loaded.model;
  changed.effects.insert(changed.effects.begin(), twin::EffectSpec{.kind = "shupe"});
  save_model(changed, path);
  const LoadedModel again = load_model(path);
  EXPECT_EQ(again.model.format_version, 2U);
  EXPECT_EQ(again.model.unknown_keys.at("calibration"),
            R"({"lab": "B 12", "steps": [1, 2.50, true]})");
  EXPECT_EQ(again.model.thermal_plant.unknown_keys.at("fan_w"), "2");
  EXPECT_EQ(again.model.effects[1].unknown_keys.at("colour"), "\"blue\"");
  EXPECT_EQ(again.model.effects[2].kind, "effect_of_tomorrow");
  EXPECT_EQ(again.model.effects[2].parameters.at("size"), 3.0);
}

TEST_F(TwinFileLaws, AProfileConvertsDegreesAndKeepsWhatItSays) {
  const auto path = written(
      "name: p\n"
      "duration_s: 100\n"
      "initial_temperature_degc: -15\n"
      "power_on_s: -5\n"
      "chamber: [{time_s: 10, temperature_degc: 50}]\n"
      "turns: [{start_s: 1, duration_s: 9, axis: z, rate_deg_s: 10, ramp_s: 2}]\n"
      "earth_rate: {latitude_deg: 45, heading_deg: 90}\n");
  const twin::Profile profile = load_profile(path);
  EXPECT_EQ(profile.name, "p");
  EXPECT_EQ(profile.power_on_s, -5.0);
  EXPECT_EQ(profile.chamber.at(0).temperature_degc, 50.0);
  EXPECT_EQ(profile.turns.at(0).axis, core::Axis::kZ);
  EXPECT_DOUBLE_EQ(profile.turns.at(0).rate_radps, 10.0 * core::kRadPerDeg);
  ASSERT_TRUE(profile.earth_rate);
  EXPECT_DOUBLE_EQ(profile.earth_rate->latitude_rad, 45.0 * core::kRadPerDeg);
}

TEST_F(TwinFileLaws, AProfileKeepsItsPowerCyclesAndExcitations) {
  const twin::Profile profile = load_profile(written(
      "duration_s: 100\n"
      "initial_temperature_degc: 20\n"
      "power_cycles: [{off_s: 40, on_s: 50}]\n"
      "excitations:\n"
      "  - {start_s: 1, duration_s: 9, quantity: magnetic_ut, axis: y, value: -50, ramp_s: 2}\n"
      "  - {start_s: 2, duration_s: 8, quantity: supply_v, value: 0.5}\n"));
  ASSERT_EQ(profile.power_cycles.size(), 1U);
  EXPECT_EQ(profile.power_cycles[0].off_s, 40.0);
  EXPECT_EQ(profile.power_cycles[0].on_s, 50.0);
  ASSERT_EQ(profile.excitations.size(), 2U);
  const twin::Excitation& field = profile.excitations[0];
  EXPECT_EQ(field.start_s, 1.0);
  EXPECT_EQ(field.duration_s, 9.0);
  EXPECT_EQ(field.quantity, twin::ExcitedQuantity::kMagneticUt);
  EXPECT_EQ(field.axis, core::Axis::kY);
  EXPECT_EQ(field.value, -50.0);
  EXPECT_EQ(field.ramp_s, 2.0);
  EXPECT_EQ(profile.excitations[1].quantity, twin::ExcitedQuantity::kSupplyV);
}

TEST_F(TwinFileLaws, AProbeSitsWhereItsNameSaysUnlessToldOtherwise) {
  const auto model =
      load_model(written("probes: [{name: board}, {name: lid, node: case}]\n")).model;
  EXPECT_EQ(model.probes.at(0).node, twin::TemperaturePoint::kBoard);
  EXPECT_EQ(model.probes.at(1).node, twin::TemperaturePoint::kCase);
  EXPECT_EQ(model.format_version, 1U);
}

TEST_F(TwinFileAbuse, AnUnknownKeyInAFileOfThisVersionIsAnErrorWithItsLine) {
  EXPECT_EQ(model_error("gyro_id: a\neffects:\n  - kind: bias\n    axes: x\n"),
            "4: effects[0].axes: unknown key; did you mean 'axis'?");
}

TEST_F(TwinFileAbuse, AnUnknownEffectIsAnErrorWithItsLine) {
  EXPECT_EQ(
      model_error("effects:\n  - {kind: bias, axis: x}\n  - {kind: coil_lagg, axis: x}\n"),
      "3: effects[1].kind: the catalogue has no effect 'coil_lagg'; did you mean 'coil_lag'?");
}

TEST_F(TwinFileAbuse, AWrongParameterUnitOrRangeIsAnErrorWithItsLine) {
  EXPECT_EQ(model_error("effects:\n  - kind: bias\n    axis: x\n    parameters:\n"
                        "      bias_rad_s: 1\n"),
            "5: effects[0].parameters.bias_rad_s: 'bias' has no such parameter; did you mean "
            "'bias_deg_h'?");
  EXPECT_EQ(model_error("effects:\n  - {kind: bias, axis: x, parameters: {bias_deg_h: 1 deg/h}}\n"),
            "2: effects[0].parameters.bias_deg_h: expected a plain number in deg/h, found "
            "'1 deg/h'");
  EXPECT_EQ(model_error("effects:\n  - {kind: warm_up, axis: x, parameters: {exponent: 9}}\n"),
            "2: effects[0].parameters.exponent: must be within 0.05 and 5, found 9");
}

TEST_F(TwinFileAbuse, WrongAxesRatesNodesAndOriginsAreErrorsWithTheirLines) {
  EXPECT_EQ(model_error("effects:\n  - kind: bias\n    axis: w\n"),
            "3: effects[0].axis: must be x, y or z, found 'w'");
  EXPECT_EQ(model_error("effects:\n  - kind: bias\n"),
            "2: effects[0].axis: must be x, y or z, found ''");
  EXPECT_EQ(model_error("\nnominal_rate_hz: -200\n"),
            "2: nominal_rate_hz: must be above 0 and at most 1e5 Hz, found -200");
  EXPECT_EQ(model_error("probes: [{name: lid}]\n").rfind("1: probes[0].node: no temperature", 0),
            0U);
  EXPECT_EQ(model_error("effects:\n  - {kind: bias, axis: x, origin: {by: me}}\n"),
            "2: effects[0].origin.by: must be factory or diagnose, found 'me'");
}

TEST_F(TwinFileAbuse, AProfileWithoutDurationOrWithATurnOfUnknownRateIsRefused) {
  EXPECT_EQ(profile_error("initial_temperature_degc: 1\n"), "1: duration_s: must be given");
  EXPECT_EQ(profile_error("duration_s: 1\ninitial_temperature_degc: 1\nturns:\n"
                          "  - {start_s: 0, duration_s: 1, axis: x}\n"),
            "4: turns[0].rate_deg_s: must be given");
  EXPECT_EQ(profile_error("duration_s: -1\ninitial_temperature_degc: 1\n"),
            "1: duration_s: must be within 0 and 1e8 s, found -1.000000");
}

TEST_F(TwinFileAbuse, WrongExcitationsAndPowerCyclesAreErrorsWithTheirLines) {
  const auto error_of = [this](const std::string& rest) {
    return profile_error("duration_s: 9\ninitial_temperature_degc: 1\n" + rest);
  };
  const std::string at = "excitations:\n  - {start_s: 0, duration_s: 1, ";
  EXPECT_EQ(error_of(at + "quantity: magnetic, axis: x, value: 1}\n"),
            "4: excitations[0].quantity: no quantity is called 'magnetic'; did you mean "
            "'magnetic_ut'?");
  EXPECT_EQ(error_of(at + "quantity: magnetic_ut, value: 1}\n"),
            "4: excitations[0].axis: must be x, y or z, found ''");
  EXPECT_EQ(error_of(at + "quantity: vibration_g, axis: x, value: 1}\n"),
            "4: excitations[0].axis: vibration_g has no axis, found 'x'");
  EXPECT_EQ(error_of(at + "quantity: vibration_g}\n"), "4: excitations[0].value: must be given");
  EXPECT_EQ(error_of(at + "quantity: vibration_g, value: 1, ramp_s: 1}\n"),
            "4: excitations[0].ramp_s: must be within 0 and half of duration_s, found 1.000000");
  EXPECT_EQ(error_of("power_cycles:\n  - {off_s: 5}\n"), "4: power_cycles[0].on_s: must be given");
  EXPECT_EQ(error_of("power_cycles:\n  - {off_s: 5, on_s: 4}\n"),
            "4: power_cycles[0].on_s: must be after off_s, found 4.000000");
}

TEST_F(TwinFileAbuse, AFileThatCannotBeWrittenThrowsAndLeavesNothing) {
  EXPECT_THROW(save_model({}, folder_ / "missing" / "model.yaml"), ConfigError);
  std::filesystem::create_directory(folder_ / "taken");
  EXPECT_THROW(save_model({}, folder_ / "taken"), ConfigError);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder_), {}), 1);
}

}  // namespace
}  // namespace zerodrift::config
