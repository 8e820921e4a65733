// SPDX-License-Identifier: Apache-2.0
// thermal_publisher on thermometers that Linux shows as files, here on a tree made by the test.
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <optional>
#include <string>

#include "tests/system/files.h"
#include "tests/system/system_under_test.h"

namespace zerodrift::system_test {
namespace {

using namespace std::chrono_literals;

std::optional<msg::Temperature> newest(const Collector<msg::Temperature>& temperatures,
                                       const std::string& probe) {
  const auto all = temperatures.all();
  const auto found = std::find_if(all.rbegin(), all.rend(), [&](const auto& reading) {
    return probe == reading.probe().c_str();
  });
  return found == all.rend() ? std::nullopt : std::optional(*found);
}

TEST(SysfsThermometer, TemperaturesArriveAndAFileThatVanishesIsToldAndComesBack) {
  SystemUnderTest system(Domain::kSysfsThermometer);
  const auto hwmon = system.path("sys/class/hwmon/hwmon0");
  write(hwmon / "name", "fog\n");
  write(hwmon / "temp1_label", "coil\n");
  write(hwmon / "temp1_input", "21500\n");
  write(hwmon / "temp2_input", "-3250\n");
  dds::Participant participant("test", system.network());
  Collector<msg::Temperature> temperatures(participant);
  Collector<msg::Event> events(participant);
  ChildProcess& publisher = system.start(
      "thermal_publisher",
      {"--source", "sysfs", "--sysfs-root", system.path("sys"), "--rate", "20", "--gyro-id", "5"});

  const auto reads = [&](const std::string& probe, double degc) {
    return eventually([&] {
      const auto reading = newest(temperatures, probe);
      return reading && reading->measured() == 1 && reading->temperature_degc() == degc &&
             reading->gyro_id() == 5;
    });
  };
  EXPECT_TRUE(reads("coil", 21.5));
  EXPECT_TRUE(reads("fog_temp2", -3.25));

  std::filesystem::rename(hwmon / "temp1_input", hwmon / "gone");
  EXPECT_TRUE(eventually([&] { return newest(temperatures, "coil")->measured() == 0; }));
  EXPECT_TRUE(eventually([&] { return told(events, "no_temperature", "temp1_input"); }));
  write(hwmon / "temp2_input", "nonsense\n");
  EXPECT_TRUE(eventually([&] { return newest(temperatures, "fog_temp2")->measured() == 0; }));

  write(hwmon / "temp2_input", "-3000\n");
  EXPECT_TRUE(reads("fog_temp2", -3.0));
  std::filesystem::rename(hwmon / "gone", hwmon / "temp1_input");
  EXPECT_TRUE(reads("coil", 21.5));
  publisher.send(SIGTERM);
  EXPECT_EQ(publisher.wait(2s), 0);
}

}  // namespace
}  // namespace zerodrift::system_test
