// SPDX-License-Identifier: Apache-2.0
#include "common/replay/record_source.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <optional>
#include <stdexcept>
#include <string>
#include <variant>
#include <vector>

#include "common/files/file_error.h"
#include "tests/unit/record/recording.h"

namespace zerodrift::replay {
namespace {

// Five seconds at 1 Hz; the case is read every other second.
constexpr const char* kRecord =
    "time_s,rate_x_rad_s,reference_x_rad_s,temperature_case_degC,temperature_coil_degC\n"
    "10,1,0.5,20,30\n"
    "11,2,0.5,,31\n"
    "12,3,0.5,22,32\n"
    "13,4,0.5,,33\n"
    "14,5,0.5,24,34\n";

class RecordSource : public ::testing::Test {
 protected:
  RecordSource() { std::ofstream(file_) << kRecord; }
  ~RecordSource() override { std::filesystem::remove(file_); }

  [[nodiscard]] std::vector<double> rates(RecordSourceOptions options) {
    options.record.file = file_.string();
    const GyroSource source = open_gyro_record(options, [](const std::string&) {});
    std::vector<double> all;
    while (const auto reading = source()) {
      if (reading->rate) all.push_back(reading->rate->rate_radps[0]);
    }
    return all;
  }

  std::filesystem::path file_ = std::filesystem::temp_directory_path() /
                                ("record_source_" + std::to_string(::getpid()) + ".csv");
};

TEST_F(RecordSource, GivesEveryRateInOrder) {
  EXPECT_EQ(rates({}), (std::vector<double>{1, 2, 3, 4, 5}));
}

TEST_F(RecordSource, ARangeCountsFromTheRecordsFirstRateItsEndNotIncluded) {
  EXPECT_EQ(rates({.from_s = 1.0, .to_s = 3.0}), (std::vector<double>{2, 3}));
  EXPECT_EQ(rates({.from_s = 4.0}), (std::vector<double>{5}));
  EXPECT_TRUE(rates({.from_s = 100.0}).empty());
}

TEST_F(RecordSource, ARateComesWithWhatTheRecordKnowsOfTheTrueOne) {
  const GyroSource source =
      open_gyro_record({.record = {.file = file_.string()}}, [](const std::string&) {});
  const auto first = source();
  ASSERT_TRUE(first && first->rate && first->reference);
  EXPECT_EQ(first->reference->rate_radps[0], 0.5);
  EXPECT_EQ(first->reference->time, first->rate->time);
  EXPECT_EQ(first->rate->clock, core::ClockSource::kReplay);
}

TEST_F(RecordSource, TemperaturesOfAllProbesComeInOrderOfTime) {
  const ThermalSource source =
      open_thermal_record({.record = {.file = file_.string()}}, [](const std::string&) {});
  core::SensorTime before{0};
  std::vector<double> coil;
  int cases = 0;
  while (const auto next = source.next()) {
    const auto& reading = std::get<core::TemperatureSample>(*next);
    EXPECT_GE(reading.time, before);
    before = reading.time;
    if (reading.probe == "coil") coil.push_back(reading.temperature_degc);
    if (reading.probe == "case" && reading.measured) ++cases;
  }
  EXPECT_EQ(coil, (std::vector<double>{30, 31, 32, 33, 34}));
  EXPECT_EQ(cases, 3);
}

TEST_F(RecordSource, TheEnvironmentComesWithTheTemperaturesItsBlanksOnceASecond) {
  std::ofstream(file_) << "time_s,rate_x_rad_s,temperature_coil_degC,supply_V\n"
                          "0,1,20,5\n0.5,2,,\n1,3,,\n1.5,4,,\n2,5,,\n2.5,6,21,5.5\n";
  const ThermalSource source =
      open_thermal_record({.record = {.file = file_.string()}}, [](const std::string&) {});
  EXPECT_EQ(source.environment, 1U << 8U);
  std::vector<double> times_s;
  core::SensorTime before{0};
  while (const auto next = source.next()) {
    const auto time = std::visit([](const auto& sample) { return sample.time; }, *next);
    EXPECT_GE(time, before);
    before = time;
    const auto* environment = std::get_if<core::EnvironmentSample>(&*next);
    if (environment == nullptr) continue;
    times_s.push_back(core::seconds(environment->time));
    EXPECT_EQ(environment->channels, 1U << 8U);
    EXPECT_EQ(environment->clock, core::ClockSource::kReplay);
  }
  EXPECT_EQ(times_s, (std::vector<double>{0.0, 1.0, 2.0, 2.5}));
}

// Rule: of a recording of several gyros, what one of them lacks is said of that one.
TEST_F(RecordSource, AGyroWithoutTemperaturesIsNamed) {
  const std::filesystem::path recorded = file_.string() + ".mcap";
  record::Recording recording;
  recording.add(1, record::reading_at(0.5, "coil", 20.0));
  for (const std::uint32_t gyro : {1U, 5U}) {
    for (std::uint64_t k = 0; k < 3; ++k)
      recording.add(gyro, record::rate_at(1.0 + 0.01 * static_cast<double>(k), k));
  }
  recording.write_to(recorded);
  const auto warnings = [](const std::filesystem::path& file, std::optional<std::uint32_t> gyro) {
    std::vector<std::string> all;
    (void)open_thermal_record({.record = {.file = file.string(), .gyro_id = gyro}},
                              [&](const std::string& line) { all.push_back(line); });
    return all;
  };
  EXPECT_EQ(warnings(recorded, 5),
            std::vector<std::string>{recorded.string() + ": has no temperature of gyro 5"});
  EXPECT_EQ(warnings(recorded, 1), std::vector<std::string>{});
  std::filesystem::remove(recorded);
  std::ofstream(file_) << "time_s,rate_x_rad_s\n10,1\n11,2\n";
  EXPECT_EQ(warnings(file_, {}),
            std::vector<std::string>{file_.string() + ": has no temperature column"});
}

TEST_F(RecordSource, WhatCannotBeReadIsOneLine) {
  const auto ignore = [](const std::string&) {};
  EXPECT_THROW(open_gyro_record({}, ignore), std::invalid_argument);
  EXPECT_THROW(open_gyro_record({.record = {.file = "/nowhere/a.csv"}}, ignore), files::FileError);
  EXPECT_THROW(open_thermal_record({.record = {.file = "/nowhere/a.mcap"}}, ignore),
               std::runtime_error);
}

}  // namespace
}  // namespace zerodrift::replay
