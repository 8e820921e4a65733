// SPDX-License-Identifier: Apache-2.0
#include "common/config/chamber_limits_config.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "common/config/twin_config.h"
#include "common/config/whole_file.h"
#include "common/core/units.h"
#include "tests/unit/config/error_after.h"

namespace zerodrift::config {
namespace {

class LimitsFile : public testing::Test {
 protected:
  LimitsFile()
      : path_(std::filesystem::temp_directory_path() /
              ("limits_" + std::to_string(getpid()) + ".yaml")) {}
  ~LimitsFile() override { std::filesystem::remove(path_); }

  [[nodiscard]] twin::ChamberLimits loaded(const std::string& text) const {
    write_whole(path_, text);
    return load_chamber_limits(path_);
  }
  // What follows the file's name in the error of loading this text.
  [[nodiscard]] std::string error(const std::string& text) const {
    return error_after(path_.string() + ':', [&] { (void)loaded(text); });
  }

  std::filesystem::path path_;
};

TEST_F(LimitsFile, WhatIsLeftOutCantBeMoved) {
  const auto limits = loaded("duration_s: 7200\nrate_table: {largest_deg_s: 20}\n");
  EXPECT_EQ(limits.duration_s, 7200.0);
  ASSERT_TRUE(limits.rate_radps);
  EXPECT_EQ(*limits.rate_radps, 20.0 * core::kRadPerDeg);
  EXPECT_FALSE(limits.moves_temperature());
  EXPECT_FALSE(limits.magnetic_ut || limits.tilt_rad || limits.vibration_g);
}

TEST_F(LimitsFile, TheShippedLaboratoryMovesEverything) {
  const auto limits = load_chamber_limits(std::filesystem::path(ZERODRIFT_SOURCE_DIR) /
                                          "config/chambers/laboratory.yaml");
  EXPECT_TRUE(limits.moves_temperature());
  EXPECT_TRUE(limits.rate_radps && limits.magnetic_ut && limits.tilt_rad && limits.vibration_g &&
              limits.source_current_ma && limits.supply_v && limits.off_s);
  // The shipped experiment for a diagnosis is one for this laboratory.
  const auto profile = load_profile(std::filesystem::path(ZERODRIFT_SOURCE_DIR) /
                                    "config/profiles/diagnosis_chamber.yaml");
  EXPECT_EQ(twin::find_excess(profile, limits).value_or("fits"), "fits");
}

TEST_F(LimitsFile, WhatIsWrongIsToldInOneLineWithItsKey) {
  EXPECT_EQ(error("rate_table: {largest_deg_s: 20}\n"),
            "1: duration_s: must be given: how long an experiment may last");
  EXPECT_EQ(error("duration_s: 5\n"), "1: duration_s: found 5, expected 600 to 604800");
  EXPECT_EQ(error("duration_s: 7200\ntemprature: {low_degc: 0}\n"),
            "2: temprature: unknown key; did you mean 'temperature'?");
  EXPECT_EQ(error("duration_s: 7200\ntemperature: {low_degc: 0}\n"),
            "2: temperature: found no high_degc, expected low_degc, high_degc and "
            "ramp_degc_per_min together, or none of them");
  EXPECT_EQ(error("duration_s: 7200\nmagnetic: 5\n"),
            "2: magnetic: expected keys and values, found '5'");
  EXPECT_NE(error("duration_s: .nan\n").find("duration_s"), std::string::npos);
  EXPECT_NE(error("[1, 2]\n").find("expected keys and values"), std::string::npos);
}

TEST_F(LimitsFile, ThePageOfTheKeysIsTheProgramsOwn) {
  std::ifstream page(std::filesystem::path(ZERODRIFT_SOURCE_DIR) / "docs/diagnosis.md");
  std::stringstream text;
  text << page.rdbuf();
  EXPECT_NE(text.str().find(chamber_limits_reference()), std::string::npos)
      << chamber_limits_reference();
}

TEST_F(LimitsFile, AProfileThatWasWrittenIsReadAgain) {
  const auto profile = load_profile(std::filesystem::path(ZERODRIFT_SOURCE_DIR) /
                                    "config/profiles/diagnosis_chamber.yaml");
  save_profile(profile, {"why it is there"}, path_);
  const auto again = load_profile(path_);
  EXPECT_EQ(again.name, profile.name);
  EXPECT_EQ(again.duration_s, profile.duration_s);
  ASSERT_EQ(again.chamber.size(), profile.chamber.size());
  ASSERT_EQ(again.turns.size(), profile.turns.size());
  for (std::size_t i = 0; i < profile.turns.size(); ++i) {
    EXPECT_EQ(again.turns[i].start_s, profile.turns[i].start_s);
    EXPECT_EQ(again.turns[i].axis, profile.turns[i].axis);
    // To degrees and back: two roundings.
    EXPECT_NEAR(again.turns[i].rate_radps, profile.turns[i].rate_radps,
                4e-16 * std::abs(profile.turns[i].rate_radps));
  }
  ASSERT_EQ(again.excitations.size(), profile.excitations.size());
  for (std::size_t i = 0; i < profile.excitations.size(); ++i) {
    EXPECT_EQ(again.excitations[i].quantity, profile.excitations[i].quantity);
    EXPECT_EQ(again.excitations[i].value, profile.excitations[i].value);
  }
  ASSERT_EQ(again.power_cycles.size(), 1U);
  EXPECT_EQ(again.power_cycles[0].on_s, profile.power_cycles[0].on_s);
}

}  // namespace
}  // namespace zerodrift::config
