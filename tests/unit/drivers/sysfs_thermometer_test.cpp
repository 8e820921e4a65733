// SPDX-License-Identifier: Apache-2.0
#include "common/drivers/sysfs_thermometer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <string_view>

#include "common/drivers/driver_error.h"
#include "tests/support/scratch_folder.h"

namespace zerodrift::drivers {
namespace {

class SysfsThermometers : public ScratchFolder {
 protected:
  // One line, without the folder.
  [[nodiscard]] std::string shown(std::string text) const {
    EXPECT_EQ(text.find('\n'), std::string::npos) << text;
    if (text.starts_with(folder_.string())) text.erase(0, folder_.string().size() + 1);
    return text;
  }

  [[nodiscard]] std::string refusal(const std::filesystem::path& path) const {
    try {
      SysfsThermometer thermometer{describe_thermometer("coil", path)};
    } catch (const DriverError& error) {
      return shown(error.what());
    }
    return "no error";
  }

  [[nodiscard]] static double read_once(const std::filesystem::path& path) {
    return SysfsThermometer{describe_thermometer("coil", path)}.read().sample.temperature_degc;
  }

  [[nodiscard]] const std::filesystem::path& root() const { return folder_; }

 private:
};

TEST_F(SysfsThermometers, EachKindReadsInDegreesCelsius) {
  EXPECT_DOUBLE_EQ(read_once(write("class/hwmon/hwmon0/temp1_input", "45250\n")), 45.25);
  EXPECT_DOUBLE_EQ(read_once(write("a/in_temp_input", "-1500\n")), -1.5);
  write("b/in_temp_scale", "62.5\n");
  write("b/in_temp_offset", "-80\n");
  EXPECT_DOUBLE_EQ(read_once(write("b/in_temp_raw", "400\n")), (400 - 80) * 62.5 * 1e-3);
  write("c/in_temp_scale", "10\n");
  EXPECT_DOUBLE_EQ(read_once(write("c/in_temp0_raw", "2150\n")),
                   21.5);  // no offset; the scale is shared
  write("d/in_temp_scale", "10\n");
  write("d/in_temp_offset", "50\n");
  EXPECT_DOUBLE_EQ(read_once(write("d/in_temp_ambient_raw", "2150\n")), 22.0);
  EXPECT_DOUBLE_EQ(read_once(write("d/in_temp1_object_raw", "2250\n")), 23.0);
  write("d/in_temp_object_scale", "20\n");
  EXPECT_DOUBLE_EQ(read_once(write("d/in_temp_object_raw", "1000\n")), 21.0) << "its own scale";
  EXPECT_DOUBLE_EQ(read_once(write("28-000001/temperature", "23125\n")), 23.125);
  EXPECT_DOUBLE_EQ(read_once(write("28-000002/w1_slave",
                                   "72 01 4b 46 7f ff 0e 10 57 : crc=57 YES\n"
                                   "72 01 4b 46 7f ff 0e 10 57 t=23125\n")),
                   23.125);
}

TEST_F(SysfsThermometers, DiscoverNamesThemByLabelChipAndDevice) {
  write("class/hwmon/hwmon0/name", "coretemp\n");
  write("class/hwmon/hwmon0/temp1_input", "45000\n");
  write("class/hwmon/hwmon0/temp1_label", "Package id 0\n");
  write("class/hwmon/hwmon0/temp2_input", "44000\n");
  write("class/hwmon/hwmon0/temp1_max", "90000\n");
  write("class/hwmon/hwmon0/fan1_input", "1200\n");
  write("class/hwmon/hwmon1/name", "coretemp\n");
  write("class/hwmon/hwmon1/temp2_input", "43000\n");
  write("bus/iio/devices/iio:device0/name", "adis16475\n");
  write("bus/iio/devices/iio:device0/in_temp0_raw", "250\n");
  write("bus/iio/devices/iio:device0/in_temp0_scale", "100\n");
  write("bus/w1/devices/28-0abc/w1_slave", "x");
  write("bus/w1/devices/28-0abc/temperature", "21000\n");

  const auto found = discover_thermometers(root());
  ASSERT_EQ(found.size(), 5U);
  EXPECT_EQ(found[0].probe, "package_id_0");
  EXPECT_EQ(found[1].probe, "coretemp_temp2");
  EXPECT_EQ(found[2].probe, "coretemp_temp2_2");
  EXPECT_EQ(found[3].probe, "adis16475_temp0");
  EXPECT_EQ(found[3].kind, ThermometerKind::kIioRaw);
  EXPECT_EQ(found[4].probe, "w1_28_0abc");
  EXPECT_EQ(found[4].path.filename(), "temperature");
  for (const ThermometerFile& file : found) EXPECT_NO_THROW(SysfsThermometer{file}) << file.path;
}

TEST_F(SysfsThermometers, DiscoverFindsNothingInAnEmptyOrMissingTree) {
  EXPECT_TRUE(discover_thermometers(root()).empty());
  EXPECT_TRUE(discover_thermometers(root() / "none").empty());
}

TEST_F(SysfsThermometers, RefusedAtStartWithOneLine) {
  EXPECT_EQ(refusal(root() / "temp1_input"),
            "temp1_input: cannot read the sensor: No such file or directory");
  EXPECT_EQ(refusal(write("temp2_input", "warm\n")),
            "temp2_input: found 'warm', expected a number");
  EXPECT_EQ(refusal(write("temp3_input", "")), "temp3_input: found '', expected a number");
  EXPECT_EQ(refusal(write("temp4_input", "nan")), "temp4_input: found 'nan', expected a number");
  EXPECT_EQ(refusal(write("a/in_temp_raw", "1")),
            "a/in_temp_raw: has no in_temp_scale beside it, without which counts mean nothing");
  EXPECT_EQ(refusal(write("a/in_temp_ambient_raw", "1")),
            "a/in_temp_ambient_raw: has neither in_temp_ambient_scale nor in_temp_scale beside it, "
            "without which counts mean nothing");
  EXPECT_EQ(refusal(write("b/w1_slave", "ff : crc=57 NO\nff t=85000\n")),
            "b/w1_slave: the 1-wire CRC does not say YES");
  EXPECT_EQ(refusal(write("c/w1_slave", "ff : crc=57 YES\nff\n")),
            "c/w1_slave: found 'ff : crc=57 YES ff', expected t=<m°C>");
  EXPECT_EQ(refusal(write("d/fan1_input", "1")),
            "d/fan1_input: no thermometer file; expected temp*_input, in_temp*_input, "
            "in_temp*_raw, temperature or w1_slave");
  std::filesystem::create_directories(root() / "e/temp1_input");
  EXPECT_EQ(refusal(root() / "e/temp1_input"),
            "e/temp1_input: cannot read the sensor: Is a directory");
}

TEST_F(SysfsThermometers, AFileThatVanishesWhileRunningIsNotMeasuredUntilItComesBack) {
  const auto path = write("class/hwmon/hwmon0/temp1_input", "20000\n");
  SysfsThermometer thermometer{describe_thermometer("coil", path)};

  ThermometerReading reading = thermometer.read();
  EXPECT_TRUE(reading.sample.measured);
  EXPECT_EQ(reading.sample.probe, "coil");
  EXPECT_EQ(reading.sample.sequence, 0U);
  EXPECT_EQ(reading.sample.clock, core::ClockSource::kHost);
  EXPECT_EQ(reading.reason, "");

  std::filesystem::remove(path);
  reading = thermometer.read();
  EXPECT_FALSE(reading.sample.measured);
  EXPECT_TRUE(std::isnan(reading.sample.temperature_degc));
  EXPECT_EQ(reading.sample.sequence, 1U);
  EXPECT_EQ(shown(reading.reason),
            "class/hwmon/hwmon0/temp1_input: cannot read the sensor: No such file or directory");

  write("class/hwmon/hwmon0/temp1_input", "21000\n");
  reading = thermometer.read();
  EXPECT_TRUE(reading.sample.measured);
  EXPECT_DOUBLE_EQ(reading.sample.temperature_degc, 21.0);
}

// An open diode reads as 127.875 °C, a shorted 1-wire bus as 0 °C with a CRC that fits.
TEST_F(SysfsThermometers, WhatIsNoTemperatureIsNotMeasured) {
  const auto path = write("class/hwmon/hwmon0/temp1_input", "20000\n");
  SysfsThermometer thermometer{describe_thermometer("coil", path)};
  write("class/hwmon/hwmon0/temp1_fault", "0\n");
  EXPECT_TRUE(thermometer.read().sample.measured);
  write("class/hwmon/hwmon0/temp1_fault", "1\n");
  const ThermometerReading faulty = thermometer.read();
  EXPECT_FALSE(faulty.sample.measured);
  EXPECT_EQ(shown(faulty.reason),
            "class/hwmon/hwmon0/temp1_input: its fault file says that the sensor is open or gone");
  write("class/hwmon/hwmon0/temp1_fault", "0\n");
  EXPECT_TRUE(thermometer.read().sample.measured);
  for (const char* text : {"-273151", "2147483647", "1e300"}) {
    write("class/hwmon/hwmon0/temp1_input", text);
    EXPECT_FALSE(thermometer.read().sample.measured) << text;
  }
  write("class/hwmon/hwmon0/temp1_input", "0");
  EXPECT_TRUE(thermometer.read().sample.measured);

  const char* const shorted =
      "00 00 00 00 00 00 00 00 00 : crc=00 YES\n00 00 00 00 00 00 00 00 00 t=0\n";
  EXPECT_EQ(refusal(write("a/w1_slave", shorted)),
            "a/w1_slave: all that it says is 0: the 1-wire bus is shorted to ground");
  EXPECT_EQ(refusal(write("a/temperature", "0\n")),
            "a/w1_slave: all that it says is 0: the 1-wire bus is shorted to ground");
  write("b/w1_slave", "00 00 4b 46 7f ff 10 10 cb : crc=cb YES\n00 00 4b 46 7f ff 10 10 cb t=0\n");
  EXPECT_EQ(read_once(write("b/temperature", "0\n")), 0.0);
}

// Linux gives hwmon's and IIO's numbers to who comes first.
TEST_F(SysfsThermometers, AnotherChipBehindItsPathIsNotTheThermometer) {
  const auto path = write("class/hwmon/hwmon2/temp1_input", "21500\n");
  write("class/hwmon/hwmon2/name", "lm75\n");
  SysfsThermometer thermometer{describe_thermometer("coil", path)};
  EXPECT_TRUE(thermometer.read().sample.measured);
  write("class/hwmon/hwmon2/name", "coretemp\n");
  write("class/hwmon/hwmon2/temp1_input", "64000\n");
  const ThermometerReading other = thermometer.read();
  EXPECT_FALSE(other.sample.measured);
  EXPECT_EQ(shown(other.reason),
            "class/hwmon/hwmon2/temp1_input: is now of 'coretemp', was of 'lm75'");
  write("class/hwmon/hwmon2/name", "lm75\n");
  EXPECT_TRUE(thermometer.read().sample.measured);
}

// What is cut on the wire would be one probe.
TEST_F(SysfsThermometers, LongNamesStayDifferent) {
  const std::string label(40, 'a');
  for (const char* hwmon : {"0", "1", "2"}) {
    const std::string folder = std::string("class/hwmon/hwmon") + hwmon;
    write(folder + "/temp1_input", "20000\n");
    write(folder + "/temp1_label", label + hwmon + "\n");
  }
  const auto found = discover_thermometers(root());
  ASSERT_EQ(found.size(), 3U);
  EXPECT_EQ(found[0].probe, std::string(32, 'a'));
  EXPECT_EQ(found[1].probe, std::string(30, 'a') + "_2");
  EXPECT_EQ(found[2].probe, std::string(30, 'a') + "_3");
}

}  // namespace
}  // namespace zerodrift::drivers
