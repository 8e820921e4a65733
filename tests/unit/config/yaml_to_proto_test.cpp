// SPDX-License-Identifier: Apache-2.0
#include <google/protobuf/util/message_differencer.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "common/config/proto_to_yaml.h"
#include "common/config/yaml_document.h"
#include "idl/proto/twin.pb.h"

namespace zerodrift::config {
namespace {

using google::protobuf::util::MessageDifferencer;

template <typename Message>
Message filled(const std::string& text) {
  Message message;
  const auto unknown = YamlDocument::parse(text, "test.yaml").fill(message);
  EXPECT_TRUE(unknown.empty()) << unknown.front();
  return message;
}

// The line that filling a profile with this text throws.
std::string profile_error(const std::string& text) {
  try {
    proto::TwinProfile message;
    (void)YamlDocument::parse(text, "test.yaml").fill(message);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "no error";
}

TEST(YamlToProtoLaws, EveryKindOfFieldIsFilled) {
  const auto model = filled<proto::TwinModel>(
      "format_version: 1\n"
      "gyro: \"12\"\n"
      "nominal_rate_hz: 2e2\n"
      "thermal_plant: {board_power_w: 0.25}\n"
      "probes:\n"
      "  - {name: coil, rate_hz: 10}\n"
      "effects:\n"
      "  - kind: gradient\n"
      "    parameters: {coefficient_deg_h_per_degc: -0.5}\n"
      "    inputs: [coil_outer, coil_inner]\n"
      "  - kind: bias\n"
      "    parameters:\n");
  EXPECT_EQ(model.format_version(), 1U);
  EXPECT_EQ(model.gyro(), "12");
  EXPECT_EQ(model.nominal_rate_hz(), 200.0);
  EXPECT_EQ(model.thermal_plant().board_power_w(), 0.25);
  EXPECT_FALSE(model.thermal_plant().has_case_capacity_j_per_k());
  ASSERT_EQ(model.probes_size(), 1);
  EXPECT_EQ(model.probes(0).name(), "coil");
  ASSERT_EQ(model.effects_size(), 2);
  EXPECT_EQ(model.effects(0).parameters().at("coefficient_deg_h_per_degc"), -0.5);
  EXPECT_EQ(model.effects(0).inputs(1), "coil_inner");
  EXPECT_EQ(model.effects(1).parameters_size(), 0);
}

TEST(YamlToProtoLaws, JsonIsReadAsWell) {
  const auto profile = filled<proto::TwinProfile>(
      "{\"name\": \"a \\\"b\\\"\", \"duration_s\": 10.5,\n"
      " \"chamber\": [{\"time_s\": 1, \"temperature_degc\": -15}]}");
  EXPECT_EQ(profile.name(), "a \"b\"");
  EXPECT_EQ(profile.duration_s(), 10.5);
  EXPECT_EQ(profile.chamber(0).temperature_degc(), -15.0);
}

TEST(YamlToProtoLaws, WhatIsWrittenReadsBackEqualToTheBit) {
  proto::TwinModel model;
  model.set_format_version(1);
  model.set_gyro("a: \"quoted\" # text\nwith a second line and ü");
  model.set_gyro_id("true");
  model.set_nominal_rate_hz(200.0 / 3.0);
  model.mutable_thermal_plant();
  model.add_probes()->set_name("1e3");
  auto& effect = *model.add_effects();
  effect.set_kind("bias");
  (*effect.mutable_parameters())["bias_deg_h"] = 0.1 + 0.2;
  (*effect.mutable_parameters())["b"] = 1e-300;
  effect.add_inputs("x, y");
  effect.mutable_origin()->set_by("factory");
  model.add_effects();
  const std::string text = to_yaml(model);
  EXPECT_TRUE(MessageDifferencer::Equals(filled<proto::TwinModel>(text), model)) << text;
}

TEST(YamlToProtoAbuse, AnUnknownKeyIsNamedWithFileLinePathAndTheClosestKey) {
  proto::TwinProfile message;
  const auto unknown = YamlDocument::parse(
                           "duration_s: 1\nturns:\n  - {start_s: 0}\n"
                           "  - start_s: 1\n    duratoin_s: 2\n",
                           "test.yaml")
                           .fill(message);
  ASSERT_EQ(unknown.size(), 1U);
  EXPECT_EQ(unknown.front(),
            "test.yaml:5: turns[1].duratoin_s: unknown key; did you mean 'duration_s'?");
}

TEST(YamlToProtoAbuse, AUnitThatIsNotTheKeysIsPointedOut) {
  proto::TwinProfile message;
  const auto unknown = YamlDocument::parse("duration_min: 300\n", "test.yaml").fill(message);
  ASSERT_EQ(unknown.size(), 1U);
  EXPECT_EQ(unknown.front(), "test.yaml:1: duration_min: unknown key; did you mean 'duration_s'?");
  EXPECT_EQ(profile_error("\nduration_s: 5 h\n"),
            "test.yaml:2: duration_s: expected a plain number in s, found '5 h'");
}

TEST(YamlToProtoAbuse, WrongTypesAreOneClearLine) {
  EXPECT_EQ(profile_error("duration_s: \"10\""),
            "test.yaml:1: duration_s: expected a plain number in s, found the text \"10\"");
  EXPECT_EQ(profile_error("duration_s: .nan"),
            "test.yaml:1: duration_s: expected a plain number in s, found '.nan'");
  EXPECT_EQ(profile_error("duration_s: [1]"),
            "test.yaml:1: duration_s: expected a plain number in s, found a list");
  EXPECT_EQ(profile_error("name: {a: 1}"), "test.yaml:1: name: expected a text, found a mapping");
  EXPECT_EQ(profile_error("chamber: 3"), "test.yaml:1: chamber: expected a list, found '3'");
  EXPECT_EQ(profile_error("chamber: [3]"),
            "test.yaml:1: chamber[0]: expected keys and values, found '3'");
  EXPECT_EQ(profile_error("- 1\n- 2\n"),
            "test.yaml:1: top level: expected keys and values, found a list");
  proto::TwinModel model;
  EXPECT_THROW((void)YamlDocument::parse("format_version: -1", "m").fill(model), ConfigError);
  EXPECT_THROW((void)YamlDocument::parse("format_version: 1.5", "m").fill(model), ConfigError);
}

TEST(YamlToProtoAbuse, AKeyThatStandsTwiceIsRefused) {
  EXPECT_EQ(profile_error("name: a\nduration_s: 1\nname: b\n"),
            "test.yaml:3: name: this key stands twice");
}

TEST(YamlToProtoAbuse, BrokenYamlNamesTheLine) {
  EXPECT_EQ(profile_error("name: a\nchamber: [1, 2\n").rfind("test.yaml:3: not valid YAML: ", 0),
            0U)
      << profile_error("name: a\nchamber: [1, 2\n");
  EXPECT_EQ(profile_error("name: a\n---\nname: b\n"),
            "test.yaml: expected one YAML document, found more");
  EXPECT_EQ(profile_error(""), "no error");
}

// YAML::LoadAll() takes memory without end here.
TEST(YamlToProtoAbuse, ATextThatSeemsToHoldDocumentsWithoutEndIsRefused) {
  EXPECT_EQ(profile_error("- a: b\n  c:\n    (d in (\n\"e\",\n    f\n    )  )\n    )"),
            "test.yaml: expected one YAML document, found more");
}

TEST(YamlToProtoAbuse, AnErrorIsOneLineWhateverItQuotes) {
  EXPECT_EQ(profile_error("duration_s: \"a\\nb\""),
            "test.yaml:1: duration_s: expected a plain number in s, found the text \"a b\"");
  proto::TwinModel model;
  const auto unknown = YamlDocument::parse("\"a\\nb\": 1", "m").fill(model);
  ASSERT_EQ(unknown.size(), 1U);
  EXPECT_EQ(unknown.front().rfind("m:1: a b: unknown key", 0), 0U) << unknown.front();
}

TEST(YamlToProtoAbuse, AnEndlessUnknownValueIsRefusedAndNotFollowed) {
  proto::TwinModel model;
  EXPECT_THROW((void)YamlDocument::parse("later: &a [*a]\n", "m").fill(model), ConfigError);
  // Ten lists, each of ten times the one before.
  std::ostringstream bomb;
  bomb << "a0: &a0 [x]\n";
  for (int i = 1; i <= 10; ++i) {
    bomb << 'a' << i << ": &a" << i << " [";
    for (int j = 0; j < 10; ++j) bomb << (j > 0 ? ", *a" : "*a") << i - 1;
    bomb << "]\n";
  }
  EXPECT_THROW((void)YamlDocument::parse(bomb.str(), "m").fill(model), ConfigError);
}

TEST(YamlToProtoAbuse, AliasesThatStandForTooManyValuesAreRefused) {
  std::ostringstream many;
  many << "probes:\n  - &a {";
  for (int i = 0; i < 400; ++i) many << (i > 0 ? ", k" : "k") << i << ": 1";
  many << "}\n";
  for (int i = 0; i < 400; ++i) many << "  - *a\n";
  proto::TwinModel model;
  EXPECT_THROW((void)YamlDocument::parse(many.str(), "m").fill(model), ConfigError);
}

TEST(YamlToProtoAbuse, UnknownValuesThatAreTooLargeTogetherAreRefused) {
  std::ostringstream many;
  many << "a: &a " << std::string(200000, 'x') << '\n';
  for (int i = 0; i < 4; ++i) many << 'b' << i << ": *a\n";
  proto::TwinModel model;
  EXPECT_NO_THROW((void)YamlDocument::parse(many.str(), "m").fill(model));
  many << "c: *a\n";
  model.Clear();
  EXPECT_THROW((void)YamlDocument::parse(many.str(), "m").fill(model), ConfigError);
}

// A key that is kept is written back, where YAML allows it 1024 characters, escapes included.
TEST(YamlToProtoAbuse, AKeyTooLongToBeWrittenBackIsRefused) {
  for (const bool inner : {false, true}) {
    for (const std::size_t length : {160U, 161U}) {
      const std::string key = '"' + std::string(length, '\x12') + "\": 1";
      proto::TwinModel model;
      const auto fill = [&] {
        return YamlDocument::parse(inner ? "later: {" + key + "}" : key, "m").fill(model);
      };
      if (length > 160) {
        EXPECT_THROW((void)fill(), ConfigError) << inner;
        continue;
      }
      EXPECT_EQ(fill().size(), 1U);
      proto::TwinModel again;
      EXPECT_NO_THROW((void)YamlDocument::parse(to_yaml(model), "m").fill(again));
      EXPECT_TRUE(MessageDifferencer::Equals(model, again)) << inner;
    }
  }
}

TEST(YamlToProtoAbuse, AMissingFileOrADirectoryIsNamed) {
  try {
    (void)YamlDocument::read("/nonexistent/profile.yaml");
    FAIL() << "no exception";
  } catch (const ConfigError& error) {
    EXPECT_STREQ(error.what(), "/nonexistent/profile.yaml: cannot open: No such file or directory");
  }
  EXPECT_THROW((void)YamlDocument::read(std::filesystem::temp_directory_path()), ConfigError);
}

// Neither ends by itself.
TEST(YamlToProtoAbuse, ADeviceAndAFileWithoutEndAreRefused) {
  EXPECT_THROW((void)YamlDocument::read("/dev/zero"), ConfigError);
  const auto huge = std::filesystem::temp_directory_path() /
                    ("zerodrift-huge-" + std::to_string(::getpid()) + ".yaml");
  std::ofstream(huge) << "#";
  std::filesystem::resize_file(huge, std::uintmax_t{1} << 40U);
  EXPECT_THROW((void)YamlDocument::read(huge), ConfigError);
  std::filesystem::remove(huge);
}

TEST(YamlDocumentLaws, ErrorsAboutValuesNameTheLineOfTheKeyOrItsClosestParent) {
  const auto document = YamlDocument::parse("a:\n  - b: 1\n    c:\n      d: 2\n", "f");
  EXPECT_STREQ(document.error("a[0].c.d", "wrong").what(), "f:4: a[0].c.d: wrong");
  EXPECT_STREQ(document.error("a[0].b", "wrong").what(), "f:2: a[0].b: wrong");
  EXPECT_STREQ(document.error("a[0].c.missing", "wrong").what(), "f:4: a[0].c.missing: wrong");
  EXPECT_STREQ(document.error("missing", "wrong").what(), "f:1: missing: wrong");
}

}  // namespace
}  // namespace zerodrift::config
