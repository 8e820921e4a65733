// SPDX-License-Identifier: Apache-2.0
#include "common/drivers/sysfs_environment.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string_view>

#include "common/drivers/driver_error.h"
#include "tests/support/scratch_folder.h"

namespace zerodrift::drivers {
namespace {

constexpr std::size_t kMagneticX = 0;
constexpr std::size_t kAccelerationZ = 5;
constexpr std::size_t kVibration = 6;
constexpr std::size_t kSourceCurrent = 7;
constexpr std::size_t kSupply = 8;

class SysfsEnvironments : public ScratchFolder {
 protected:
  [[nodiscard]] static double read_once(std::size_t channel, const std::filesystem::path& path,
                                        bool is_reversed = false) {
    SysfsEnvironment environment({{channel, path, is_reversed}});
    return core::channel(environment.read(core::SensorTime{0}).sample.values, channel);
  }
  [[nodiscard]] std::string refusal(std::size_t channel, const std::filesystem::path& path) const {
    try {
      SysfsEnvironment environment({{channel, path}});
    } catch (const DriverError& error) {
      return std::string(error.what()).substr(folder_.string().size() + 1);
    }
    return "no error";
  }
  [[nodiscard]] const std::filesystem::path& root() const { return folder_; }
};

TEST_F(SysfsEnvironments, EachKindReadsInTheUnitOfItsChannel) {
  EXPECT_DOUBLE_EQ(read_once(kSupply, write("hwmon0/in1_input", "5020\n")), 5.02);
  EXPECT_DOUBLE_EQ(read_once(kSourceCurrent, write("hwmon0/curr1_input", "104\n")), 104.0);
  write("imu/in_magn_scale", "0.001\n");
  const auto field = write("imu/in_magn_x_raw", "-250\n");
  EXPECT_DOUBLE_EQ(read_once(kMagneticX, field), -25.0) << "0.25 G";
  EXPECT_DOUBLE_EQ(read_once(kMagneticX, field, true), 25.0);
  write("imu/in_accel_z_scale", "0.01\n");
  write("imu/in_accel_z_offset", "-19\n");
  EXPECT_DOUBLE_EQ(read_once(kAccelerationZ, write("imu/in_accel_z_raw", "1000\n")), 9.81);
  write("adc/in_voltage_scale", "2.5\n");
  EXPECT_DOUBLE_EQ(read_once(kSupply, write("adc/in_voltage3_raw", "2000\n")), 5.0);
  EXPECT_DOUBLE_EQ(read_once(kSourceCurrent, write("adc/in_current0_input", "98.5\n")), 98.5);
}

TEST_F(SysfsEnvironments, RefusedAtStartWithOneLine) {
  EXPECT_EQ(refusal(kSupply, root() / "in1_input"),
            "in1_input: cannot read the sensor: No such file or directory");
  EXPECT_EQ(refusal(kSupply, write("in2_input", "much\n")),
            "in2_input: found 'much', expected a number");
  EXPECT_EQ(refusal(kMagneticX, write("a/in_magn_x_raw", "1")),
            "a/in_magn_x_raw: has neither in_magn_x_scale nor in_magn_scale beside it, without "
            "which counts mean nothing");
  EXPECT_EQ(refusal(kMagneticX, write("curr1_input", "1")),
            "curr1_input: no file of this channel, expected in_magn_*_input or in_magn_*_raw");
  EXPECT_EQ(refusal(kSupply, write("in_temp_input", "1")),
            "in_temp_input: no file of this channel, expected in_voltage*_input or "
            "in_voltage*_raw or in*_input");
  EXPECT_EQ(refusal(kVibration, write("in3_input", "1")),
            "in3_input: no file of this channel; Linux shows none");
  EXPECT_EQ(refusal(kSupply, write("in4_input", "1e300")),
            "in4_input: found 1e+297 V, expected -1000 to 1000 V");
}

TEST_F(SysfsEnvironments, AFileThatVanishesCostsItsOwnChannelUntilItComesBack) {
  const auto supply = write("in1_input", "5000");
  const auto current = write("curr1_input", "100");
  SysfsEnvironment environment({{kSupply, supply}, {kSourceCurrent, current}});
  std::filesystem::remove(supply);
  auto reading = environment.read(core::SensorTime{7});
  EXPECT_EQ(reading.sample.time, core::SensorTime{7});
  EXPECT_EQ(reading.sample.channels, 1U << kSupply | 1U << kSourceCurrent);
  EXPECT_TRUE(std::isnan(reading.sample.values.supply_v));
  EXPECT_EQ(reading.sample.values.source_current_ma, 100.0);
  ASSERT_EQ(reading.not_measured.size(), 1U);
  EXPECT_EQ(reading.not_measured[0].channel, kSupply);
  EXPECT_NE(reading.not_measured[0].reason.find("in1_input: cannot read"), std::string::npos);
  write("in1_input", "4000");
  reading = environment.read(core::SensorTime{8});
  EXPECT_EQ(reading.sample.sequence, 1U);
  EXPECT_EQ(reading.sample.values.supply_v, 4.0);
  EXPECT_TRUE(reading.not_measured.empty());
}

// Before: the supply of a chip that took the number of another one was published as measured.
TEST_F(SysfsEnvironments, AnotherChipBehindItsPathIsNotTheSensor) {
  const auto path = write("hwmon1/in1_input", "5012\n");
  write("hwmon1/name", "ina219\n");
  const auto current = write("hwmon2/curr1_input", "100");
  SysfsEnvironment environment({{kSupply, path}, {kSourceCurrent, current}});
  EXPECT_TRUE(environment.read(core::SensorTime{0}).not_measured.empty());
  write("hwmon1/name", "nct6775\n");
  write("hwmon1/in1_input", "12100\n");
  const EnvironmentReading other = environment.read(core::SensorTime{1});
  EXPECT_TRUE(std::isnan(other.sample.values.supply_v));
  EXPECT_EQ(other.sample.values.source_current_ma, 100.0);
  ASSERT_EQ(other.not_measured.size(), 1U);
  EXPECT_EQ(other.not_measured[0].reason, path.string() + ": is now of 'nct6775', was of 'ina219'");
  write("hwmon1/name", "ina219\n");
  EXPECT_EQ(environment.read(core::SensorTime{2}).sample.values.supply_v, 12.1);
}

// Rule: what a record's check calls not measurable is not published as measured.
TEST_F(SysfsEnvironments, WhatNoSensorOfTheQuantityGivesIsNotMeasured) {
  const auto current = write("curr1_input", "100");
  SysfsEnvironment environment({{kSourceCurrent, current}});
  for (const char* text : {"1e300", "100001", "-1"}) {
    write("curr1_input", text);
    const EnvironmentReading reading = environment.read(core::SensorTime{0});
    EXPECT_TRUE(std::isnan(reading.sample.values.source_current_ma)) << text;
    ASSERT_EQ(reading.not_measured.size(), 1U) << text;
  }
  write("curr1_input", "1e300");
  EXPECT_EQ(environment.read(core::SensorTime{0}).not_measured[0].reason,
            current.string() + ": found 1e+300 mA, expected 0 to 100 A");
  write("curr1_input", "100000");
  EXPECT_TRUE(environment.read(core::SensorTime{0}).not_measured.empty());
}

}  // namespace
}  // namespace zerodrift::drivers
