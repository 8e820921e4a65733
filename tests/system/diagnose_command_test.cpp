// SPDX-License-Identifier: Apache-2.0
// `zerodrift diagnose` as its users call it: what it answers and writes, and what it refuses.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "common/config/twin_config.h"
#include "tests/system/files.h"
#include "tests/system/system_under_test.h"

namespace zerodrift::system_test {
namespace {

using namespace std::chrono_literals;
using Json = nlohmann::ordered_json;

// A twin of axis z that knows a bias and its white noise, and a key of a newer version.
constexpr const char* kModel =
    "format_version: 2\n"
    "gyro: a gyro at test\n"
    "gyro_id: tested\n"
    "nominal_rate_hz: 1\n"
    "colour_of_the_box: green\n"
    "probes:\n"
    "  - {name: coil, node: coil, rate_hz: 1}\n"
    "effects:\n"
    "  - {kind: bias, axis: z, parameters: {bias_deg_h: 1}}\n"
    "  - {kind: angle_random_walk, axis: z, parameters: {coefficient_deg_per_sqrt_h: 0.002}}\n";

// White and uniform, with a standard deviation of 1.
class Noise {
 public:
  explicit Noise(std::uint64_t seed) : state_(seed) {}
  double next() {
    state_ = state_ * 6364136223846793005ULL + 1442695040888963407ULL;
    const double unit = static_cast<double>(state_ >> 11U) / static_cast<double>(1ULL << 53U);
    return (2.0 * unit - 1.0) * std::sqrt(3.0);
  }

 private:
  std::uint64_t state_;
};

struct Recording {
  int seconds = 14'400;
  double shupe_deg_h_min_per_degc = 0.0;  // the hidden effect
  std::uint64_t seed = 1;
  std::string header = "time_s,rate_z_deg_h,temperature_coil_degC";
};

// At 1 Hz; the chamber goes up and down by 20 °C within an hour and a half.
std::string record_of(const Recording& recording) {
  // 0.002 deg/√h in samples of a second: times 60.
  constexpr double kNoiseDegH = 0.12;
  constexpr double kOmega = 2.0 * 3.14159265358979 / 5400.0;
  Noise noise(recording.seed);
  std::string text = recording.header + "\n";
  for (int t = 0; t < recording.seconds; ++t) {
    const double temperature = 20.0 + 20.0 * std::sin(kOmega * t);
    const double degc_per_min = 60.0 * 20.0 * kOmega * std::cos(kOmega * t);
    const double rate =
        1.0 + recording.shupe_deg_h_min_per_degc * degc_per_min + kNoiseDegH * noise.next();
    char row[96];
    std::snprintf(row, sizeof row, "%d,%.9g,%.4f\n", t, rate, temperature);
    text += row;
  }
  return text;
}

class Diagnose : public ::testing::Test {
 protected:
  Diagnose() { write(system_.path("model.yaml"), kModel); }

  [[nodiscard]] std::string path(const std::string& name) const { return system_.path(name); }

  std::string record(const std::string& name, const Recording& recording) const {
    write(system_.path(name), record_of(recording));
    return path(name);
  }

  Finished run(const std::string& record, const Arguments& more) {
    Arguments arguments{"diagnose", "--model", path("model.yaml"), "--record", record};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return system_.run("zerodrift", arguments, 100s);
  }

  [[nodiscard]] Json json(const std::string& name) const {
    return Json::parse(content(system_.path(name)));
  }

  SystemUnderTest system_{Domain::kDiagnoseCommand};
};

// ------------------------------------------------------------------------------------ answers

TEST_F(Diagnose, NamesAHiddenEffectProvesItAndWritesWholeFiles) {
  const std::string fitted = record("r.csv", {.shupe_deg_h_min_per_degc = 1.0});
  const std::string unseen = record("v.csv", {.shupe_deg_h_min_per_degc = 1.0, .seed = 2});
  const Finished end =
      run(fitted, {"--validate", unseen, "--out-model", path("m.yaml"), "--json", path("d.json"),
                   "--html", path("d.html"), "--date", "2026-03-31"});
  ASSERT_EQ(end.exit_code, 0) << end.err;
  EXPECT_TRUE(end.out.starts_with("Axis z: ")) << end.out;
  const Json diagnosis = json("d.json");
  const Json& axis = diagnosis.at("axis").at("z");
  for (const auto* key : {"where", "effects", "recalibrated", "unknown", "gap", "not_testable",
                          "could_have_seen", "next_experiment"})
    EXPECT_TRUE(axis.contains(key)) << key;
  ASSERT_FALSE(axis.at("effects").empty()) << end.out;
  EXPECT_TRUE(diagnosis.at("model_changed").get<bool>());
  EXPECT_EQ(axis.at("held_out_kind"), "records");
  const Json& held_out = axis.at("gap").at("held_out");
  // 0.99 deg/h rms of the effect become 60 s means of the noise alone, 0.015 deg/h.
  EXPECT_LT(held_out.at("after_rms_deg_h").get<double>(),
            0.1 * held_out.at("before_rms_deg_h").get<double>());
  EXPECT_TRUE(content(path("d.html")).ends_with("</html>\n"));
}

// What a newer version wrote into the model survives the repair, and the origin says who and when.
TEST_F(Diagnose, TheRepairedModelKeepsUnknownKeysAndTellsItsOrigin) {
  const std::string fitted = record("r.csv", {.shupe_deg_h_min_per_degc = 1.0});
  const Finished end = run(fitted, {"--out-model", path("m.yaml"), "--date", "2026-03-31"});
  ASSERT_EQ(end.exit_code, 0) << end.err;
  EXPECT_NE(end.out.find("the repaired model"), std::string::npos) << end.out;
  EXPECT_NE(content(path("m.yaml")).find("colour_of_the_box"), std::string::npos);
  const twin::Model repaired = config::load_model(path("m.yaml")).model;
  const auto added =
      std::find_if(repaired.effects.begin(), repaired.effects.end(),
                   [](const auto& effect) { return effect.origin.by == "diagnose"; });
  ASSERT_NE(added, repaired.effects.end());
  EXPECT_EQ(added->origin.date, "2026-03-31");
  EXPECT_EQ(added->origin.record, fitted);
}

TEST_F(Diagnose, WhereNothingIsMissingItSaysSoAndWritesTheModelAsItWas) {
  const Finished end =
      run(record("r.csv", {}), {"--out-model", path("m.yaml"), "--json", path("d.json")});
  ASSERT_EQ(end.exit_code, 0) << end.err;
  const Json axis = json("d.json").at("axis").at("z");
  EXPECT_EQ(axis.at("verdict"), "consistent") << end.out;
  EXPECT_TRUE(axis.at("effects").empty());
  EXPECT_NE(end.out.find("the model as it was"), std::string::npos) << end.out;
  EXPECT_EQ(config::load_model(path("m.yaml")).model.effects.size(), 2U);
}

TEST_F(Diagnose, EqualInputGivesEqualBytes) {
  const std::string fitted = record("r.csv", {.shupe_deg_h_min_per_degc = 0.5});
  ::setenv("SOURCE_DATE_EPOCH", "1774915200", 1);  // midnight may come between the two
  const std::vector<std::string> suffixes{".json", ".html", ".yaml"};
  for (const std::string name : {"a", "b"}) {
    ASSERT_EQ(run(fitted, {"--json", path("made.json"), "--html", path("made.html"), "--out-model",
                           path("made.yaml")})
                  .exit_code,
              0);
    for (const auto& suffix : suffixes)
      std::filesystem::rename(path("made" + suffix), path(name + suffix));
  }
  ::unsetenv("SOURCE_DATE_EPOCH");
  for (const auto& suffix : suffixes)
    EXPECT_EQ(first_difference(path("a" + suffix), path("b" + suffix)), "");
}

// A record that can't tell is never a false name.
TEST_F(Diagnose, OfPoorRecordsNothingIsNamed) {
  const std::vector<std::pair<std::string, Recording>> records{
      {"no temperature", {.header = "time_s,rate_z_deg_h,something"}},
      {"ten minutes", {.seconds = 600}}};
  for (const auto& [what, recording] : records) {
    SCOPED_TRACE(what);
    const Finished end = run(record("r.csv", recording), {"--json", path("d.json")});
    ASSERT_EQ(end.exit_code, 0) << end.err;
    EXPECT_TRUE(json("d.json").at("axis").at("z").at("effects").empty()) << end.out;
  }
}

// Too short to be diagnosed is no clean bill, on the terminal, in the JSON and on the page.
TEST_F(Diagnose, OfARecordThatIsTooShortTheVerdictIsUndecidableEverywhere) {
  const Finished end =
      run(record("r.csv", {.seconds = 300}),
          {"--json", path("d.json"), "--html", path("d.html"), "--out-model", path("m.yaml")});
  ASSERT_EQ(end.exit_code, 0) << end.err;
  const std::string why = "This axis can't be diagnosed: the record is too short, 5 min";
  EXPECT_TRUE(end.out.starts_with("Axis z: " + why.substr(0, 40))) << end.out;
  const Json diagnosis = json("d.json");
  EXPECT_EQ(diagnosis.at("verdict"), "undecidable");
  const Json& axis = diagnosis.at("axis").at("z");
  EXPECT_EQ(axis.at("verdict"), "undecidable");
  EXPECT_TRUE(axis.at("sentence").get<std::string>().starts_with(why)) << axis.at("sentence");
  EXPECT_NE(axis.at("sentence").get<std::string>().find("60 min or more"), std::string::npos);
  EXPECT_TRUE(axis.at("gap").at("fit").at("before_rms_deg_h").is_null());
  const std::string page = content(path("d.html"));
  EXPECT_NE(page.find("undecidable"), std::string::npos);
  EXPECT_NE(page.find("the record is too short, 5 min"), std::string::npos);
  EXPECT_EQ(config::load_model(path("m.yaml")).model.effects.size(), 2U);
}

// A model that knows a bias and white noise on each axis, for real records.
std::string bias_and_noise(double angle_random_walk_deg_per_sqrt_h) {
  std::string text =
      "format_version: 1\ngyro: a real gyro\ngyro_id: real\nnominal_rate_hz: 1\neffects:\n";
  for (const std::string axis : {"x", "y", "z"}) {
    text += "  - {kind: bias, axis: " + axis + ", parameters: {bias_deg_h: 0}}\n";
    text += "  - {kind: angle_random_walk, axis: " + axis +
            ", parameters: {coefficient_deg_per_sqrt_h: " +
            std::to_string(angle_random_walk_deg_per_sqrt_h) + "}}\n";
  }
  return text;
}

TEST_F(Diagnose, OnARealThermalCycleTheHeldOutGapShrinksOrTheModelStays) {
  const auto file =
      std::filesystem::path(ZERODRIFT_SHARED_DIR) / "data/imu_thermal_chamber/imu_thermal.csv";
  if (!std::filesystem::exists(file)) GTEST_SKIP() << file << " is not there: nothing checked";
  write(system_.path("model.yaml"), bias_and_noise(1.0));
  const Finished finished =
      run(file, {"--columns",
                 "time=row*1.0,rate_x=gyro_x[rad/s],rate_y=gyro_y[rad/s],rate_z=gyro_z[rad/s],"
                 "temperature_coil=temp_c[degC]",
                 "--json", path("d.json")});
  ASSERT_EQ(finished.exit_code, 0) << finished.err;
  const Json axes = json("d.json").at("axis");
  for (const auto& [axis, found] : axes.items()) {
    const Json& gap = found["gap"]["held_out"];
    EXPECT_LE(gap["after_rms_deg_h"].get<double>(), 1.02 * gap["before_rms_deg_h"].get<double>())
        << axis;
  }
  // Axis y follows temperature (correlation 0.96): without it at most a tenth is left.
  const Json& y = axes["y"];
  EXPECT_EQ(y["effects"][0]["name"], "bias_temperature") << y.dump(1);
  EXPECT_LT(y["gap"]["held_out"]["after_rms_deg_h"].get<double>(),
            0.1 * y["gap"]["held_out"]["before_rms_deg_h"].get<double>());
}

TEST_F(Diagnose, OnARealStaticRecordNothingThermalIsNamed) {
  const auto file =
      std::filesystem::path(ZERODRIFT_SHARED_DIR) / "data/adis16405_static/adis16405_run1.csv.xz";
  if (!std::filesystem::exists(file)) GTEST_SKIP() << file << " is not there: nothing checked";
  write(system_.path("model.yaml"), bias_and_noise(2.5));
  const Finished finished =
      run(file, {"--columns",
                 "time=row*0.01,rate_x=gx_lsb*0.05[deg/s],rate_y=gy_lsb*0.05[deg/s],"
                 "rate_z=gz_lsb*0.05[deg/s]",
                 "--json", path("d.json")});
  ASSERT_EQ(finished.exit_code, 0) << finished.err;
  const Json axes = json("d.json").at("axis");
  ASSERT_EQ(axes.size(), 3U);
  for (const auto& [axis, found] : axes.items()) {
    for (const Json& effect : found["effects"]) {
      const auto name = effect["name"].get<std::string>();
      EXPECT_TRUE(name == "bias_instability" || name == "rate_random_walk" || name == "markov" ||
                  name == "telegraph" || name == "quantization")
          << axis << ": " << name;
    }
    EXPECT_TRUE(found["unknown"].is_null()) << axis << ": " << found["unknown"];
    const auto not_testable = found["not_testable"].dump();
    EXPECT_NE(not_testable.find("no temperature in the record"), std::string::npos);
  }
}

TEST_F(Diagnose, ATemperatureInTheWrongUnitIsPointedOutInOneLine) {
  const std::string kelvin = record("r.csv", {.header = "time_s,rate_z_deg_h,temperature_coil_K"});
  const Finished end = run(kelvin, {"--json", path("d.json")});
  ASSERT_EQ(end.exit_code, 0) << end.err;
  const std::string first = end.out.substr(0, end.out.find('\n'));
  EXPECT_NE(first.find("temperature_coil_K"), std::string::npos) << first;
  EXPECT_NE(first.find("[degC]"), std::string::npos) << first;
  EXPECT_TRUE(json("d.json").at("axis").at("z").at("effects").empty()) << end.out;
}

// ----------------------------------------------------------------------------------- refusals

TEST_F(Diagnose, RefusesBadInputWithCodeTwoOneLineAndNoFile) {
  const std::string good = record("good.csv", {.seconds = 1200});
  const std::string brief = record("short.csv", {.seconds = 300});
  const std::string stuck = path("stuck.csv");
  std::string text = "time_s,rate_z_deg_h\n";
  for (int t = 0; t < 1200; ++t) text += std::to_string(t) + ",1\n";
  write(stuck, text);
  write(path("bad.yaml"), "format_version: 1\ngyro: 7\neffects:\n  - {kind: magic, axis: z}\n");
  struct Case {
    std::string what;
    std::string record;
    Arguments arguments;
    std::vector<std::string> named;
  };
  const std::vector<Case> cases{
      {"no record", path("none.csv"), {}, {"none.csv"}},
      {"too short to prove on", good, {"--validate", brief}, {"short.csv", "10 min"}},
      {"a rate that never moves", stuck, {}, {"stuck.csv"}},
      {"an axis that is not there", good, {"--axis", "x"}, {"good.csv", "axis x"}},
      {"no such axis", good, {"--axis", "w"}, {"--axis", "w"}},
      {"no date", good, {"--date", "31.3.2026"}, {"--date", "31.3.2026"}},
      {"no day of the calendar", good, {"--date", "2026-02-30"}, {"--date", "2026-02-30"}},
      {"a day before all records", good, {"--date", "0000-01-01"}, {"--date", "0000-01-01"}},
      {"a time to listen for, of a file", good, {"--duration", "1h"}, {"--duration", "--live"}},
      {"proved on itself", good, {"--validate", good}, {"--validate", "good.csv"}},
      {"no record to prove on", good, {"--validate", path("none.csv")}, {"none.csv"}},
      {"a column that is not there", good, {"--columns", "rate_z=gz[deg/s]"}, {"gz"}},
      {"writes over the record", good, {"--html", good}, {"--html", "good.csv"}},
      {"two files of one name", good, {"--html", path("out.json")}, {"out.json"}},
      {"a folder that is not there", good, {"--out-model", path("nowhere/m.yaml")}, {"nowhere"}}};
  const std::string before = content(good);
  for (const Case& bad : cases) {
    SCOPED_TRACE(bad.what);
    Arguments arguments{"--json", path("out.json")};
    arguments.insert(arguments.end(), bad.arguments.begin(), bad.arguments.end());
    const Finished end = run(bad.record, arguments);
    EXPECT_EQ(end.exit_code, 2) << end.out << end.err;
    EXPECT_EQ(std::count(end.err.begin(), end.err.end(), '\n'), 1) << end.err;
    EXPECT_EQ(end.out, "");
    for (const auto& name : bad.named)
      EXPECT_NE(end.err.find(name), std::string::npos) << name << " is not named in: " << end.err;
  }
  EXPECT_EQ(content(good), before);
  EXPECT_FALSE(std::filesystem::exists(path("out.json")));
  const Finished end =
      system_.run("zerodrift", {"diagnose", "--model", path("bad.yaml"), "--record", good}, 20s);
  EXPECT_EQ(end.exit_code, 2);
  EXPECT_NE(end.err.find("bad.yaml"), std::string::npos) << end.err;
}

// ---------------------------------------------------------------------------------- calibrate

class Calibrate : public Diagnose {
 protected:
  Finished calibrate(const std::string& record, const std::string& effects, const Arguments& more) {
    Arguments arguments{"calibrate", "--record", record, "--effects", effects};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return system_.run("zerodrift", arguments, 100s);
  }
};

// The record's own formula says what is right: bias 1 deg/h, Shupe 1 deg/h per °C/min, 0.002
// deg/√h.
TEST_F(Calibrate, AFirstModelHasTheRecordsCoefficientsAndNothingIsMissingOnAnother) {
  const std::string fitted = record("r.csv", {.shupe_deg_h_min_per_degc = 1.0});
  const std::string unseen = record("v.csv", {.shupe_deg_h_min_per_degc = 1.0, .seed = 2});
  const Finished end = calibrate(fitted, "bias,shupe,angle_random_walk",
                                 {"--gyro", "unit 17", "--out-model", path("model.yaml")});
  ASSERT_EQ(end.exit_code, 0) << end.err;
  const auto model = config::load_model(path("model.yaml")).model;
  EXPECT_EQ(model.gyro, "unit 17");
  ASSERT_EQ(model.effects.size(), 3U) << end.out;
  const auto value = [&](std::size_t i, const char* key) {
    return model.effects[i].parameters.at(key);
  };
  // 14 400 samples of 0.12 deg/h: the mean is known to 0.001 deg/h, the Shupe coefficient, whose
  // input has 0.99 °C/min rms, to as much, their noise to 0.6 %: five standard errors.
  EXPECT_NEAR(value(0, "bias_deg_h"), 1.0, 0.005);
  EXPECT_NEAR(value(1, "coefficient_deg_h_min_per_degc"), 1.0, 0.005);
  EXPECT_NEAR(value(2, "coefficient_deg_per_sqrt_h"), 0.002, 0.03 * 0.002);
  const double error = model.effects[1].standard_errors.at("coefficient_deg_h_min_per_degc");
  EXPECT_GT(error, 0.0005);
  EXPECT_LT(error, 0.002);
  const double error_of_bias = model.effects[0].standard_errors.at("bias_deg_h");
  EXPECT_GT(error_of_bias, 0.0005);
  EXPECT_LT(error_of_bias, 0.002);
  const Finished after = run(unseen, {"--json", path("d.json")});
  ASSERT_EQ(after.exit_code, 0) << after.err;
  EXPECT_EQ(json("d.json").at("verdict"), "consistent") << after.out;
}

// A record that proves nothing makes a model that claims nothing: ten minutes and no temperature.
TEST_F(Calibrate, WhereNothingCanBeProvedTheModelListsAndClaimsNothing) {
  write(path("short.csv"), [] {
    std::string text = "time_s,rate_z_deg_h\n";
    Noise noise(3);
    for (int t = 0; t < 700; ++t)
      text += std::to_string(t) + "," + std::to_string(noise.next()) + "\n";
    return text;
  }());
  const Finished end = calibrate(path("short.csv"), "shupe", {"--out-model", path("m.yaml")});
  ASSERT_EQ(end.exit_code, 0) << end.err;
  const auto model = config::load_model(path("m.yaml")).model;
  for (const auto& effect : model.effects) {
    EXPECT_TRUE(effect.kind != "shupe" || effect.parameters.empty()) << end.out;
  }
}

TEST_F(Calibrate, AnEffectThatIsNoneIsRefusedWithTheOneThatWasMeant) {
  const Finished end =
      calibrate(record("r.csv", {.seconds = 700}), "bias,shup", {"--out-model", path("m.yaml")});
  EXPECT_EQ(end.exit_code, 2);
  EXPECT_NE(end.err.find("--effects: the catalogue has no effect 'shup'; did you mean 'shupe'?"),
            std::string::npos)
      << end.err;
  EXPECT_FALSE(std::filesystem::exists(path("m.yaml")));
}

TEST_F(Calibrate, WhatIsNamedTwiceOrNotAtAllIsRefused) {
  const std::string file = record("r.csv", {.seconds = 700});
  const Finished twice = calibrate(file, "bias,shupe,bias", {"--out-model", path("m.yaml")});
  EXPECT_EQ(twice.exit_code, 2);
  EXPECT_NE(twice.err.find("--effects: found bias twice"), std::string::npos) << twice.err;
  const Finished nameless = calibrate(file, "bias", {"--gyro", "", "--out-model", path("m.yaml")});
  EXPECT_EQ(nameless.exit_code, 2);
  EXPECT_NE(nameless.err.find("--gyro"), std::string::npos) << nameless.err;
  EXPECT_FALSE(std::filesystem::exists(path("m.yaml")));
}

// A real gyro's owner knows what it has, not how much: the model that comes of it holds on blocks
// that took no part, on every axis.
TEST_F(Calibrate, OfARealThermalCycleTheModelHoldsOnWhatItDidNotSee) {
  const auto file =
      std::filesystem::path(ZERODRIFT_SHARED_DIR) / "data/imu_thermal_chamber/imu_thermal.csv";
  if (!std::filesystem::exists(file)) GTEST_SKIP() << file << " is not there: nothing checked";
  const Finished end = calibrate(
      file, "bias,bias_temperature,shupe,angle_random_walk,bias_instability,rate_random_walk",
      {"--columns",
       "time=row*1.0,rate_x=gyro_x[rad/s],rate_y=gyro_y[rad/s],rate_z=gyro_z[rad/s],"
       "temperature_coil=temp_c[degC]",
       "--out-model", path("m.yaml"), "--json", path("c.json")});
  ASSERT_EQ(end.exit_code, 0) << end.err;
  const Json found = json("c.json");
  for (const auto& [axis, one] : found.at("axis").items()) {
    // Where names were added, the sentence says that the listed effects' sizes did it too.
    if (!one["effects"].empty()) {
      EXPECT_NE(one["sentence"].get<std::string>().find("new parameters of "), std::string::npos)
          << one["sentence"];
      EXPECT_NE(one["sentence"].get<std::string>().find("bias_temperature"), std::string::npos)
          << one["sentence"];
    }
    const Json& gap = one["gap"]["held_out"];
    EXPECT_LT(gap["after_rms_deg_h"].get<double>(), 0.1 * gap["before_rms_deg_h"].get<double>())
        << axis;
    // What isn't known is null: nothing is known to 0.
    for (const Json& change : one["recalibrated"]) {
      const Json& error = change["standard_error"];
      EXPECT_TRUE(error.is_null() || error.get<double>() > 0.0) << axis << ": " << change.dump();
    }
  }
  EXPECT_FALSE(config::load_model(path("m.yaml")).model.validate());
}

}  // namespace
}  // namespace zerodrift::system_test
