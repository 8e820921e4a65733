// SPDX-License-Identifier: Apache-2.0
// thermal_publisher on what Linux shows as files, here on a tree made by the test.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tests/support/sanitized.h"
#include "tests/system/files.h"
#include "tests/system/pipeline.h"
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

// A chip of two thermometers; its folder.
std::filesystem::path make_fog(const SystemUnderTest& system) {
  auto hwmon = system.path("sys/class/hwmon/hwmon0");
  write(hwmon / "name", "fog\n");
  write(hwmon / "temp1_input", "21500\n");
  write(hwmon / "temp2_input", "-3250\n");
  return hwmon;
}

TEST(SysfsThermometer, TemperaturesArriveAndAFileThatVanishesIsToldAndComesBack) {
  SystemUnderTest system(Domain::kSysfsThermometer);
  const auto hwmon = make_fog(system);
  write(hwmon / "temp1_label", "coil\n");
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
  // Before: two shared a tally, and of two that fail one was named, twenty times a second.
  for (const char* file : {"temp1_input: cannot read", "temp2_input: found 'nonsense'"}) {
    EXPECT_TRUE(eventually([&] { return told(events, "no_temperature", file); })) << file;
    EXPECT_TRUE(eventually([&] { return publisher.err().find(file) != std::string::npos; }))
        << publisher.err();
  }

  write(hwmon / "temp2_input", "-3000\n");
  EXPECT_TRUE(reads("fog_temp2", -3.0));
  std::filesystem::rename(hwmon / "gone", hwmon / "temp1_input");
  EXPECT_TRUE(reads("coil", 21.5));
  publisher.send(SIGTERM);
  EXPECT_EQ(publisher.wait(2s), 0);
}

// Before: one that hung in the kernel took all the others with it, without a word.
TEST(SysfsThermometer, OneThatHangsIsToldAndKeepsNobodyElse) {
  SystemUnderTest system(Domain::kSysfsThermometer);
  const auto hwmon = make_fog(system);
  dds::Participant participant("test", system.network());
  Collector<msg::Temperature> temperatures(participant);
  Collector<msg::Event> events(participant);
  ChildProcess& publisher = system.start("thermal_publisher", {"--source", "sysfs", "--sysfs-root",
                                                               system.path("sys"), "--rate", "20"});
  ASSERT_TRUE(eventually([&] { return newest(temperatures, "fog_temp1").has_value(); }));
  std::filesystem::remove(hwmon / "temp1_input");
  ASSERT_EQ(mkfifo((hwmon / "temp1_input").c_str(), 0600), 0);  // whoever opens it waits
  ASSERT_TRUE(
      eventually([&] { return told(events, "no_temperature", "temp1_input: it was asked "); }));
  write(hwmon / "temp2_input", "40000\n");
  EXPECT_TRUE(
      eventually([&] { return newest(temperatures, "fog_temp2")->temperature_degc() == 40.0; }));
  publisher.send(SIGTERM);
  EXPECT_EQ(publisher.wait(3s), 0);
}

// Rule: where a thread for each can't be had it ends with a line. Its address space holds the
// stacks of some twenty. Before: std::terminate.
TEST(SysfsThermometer, MoreThanThereAreThreadsForEndWithALineAndCodeTwo) {
  if (kIsSanitized) GTEST_SKIP() << "a sanitizer takes an address space without bounds";
  SystemUnderTest system(Domain::kSysfsThermometer);
  const auto hwmon = make_fog(system);
  for (int k = 3; k <= 80; ++k) write(hwmon / ("temp" + std::to_string(k) + "_input"), "20000\n");
  const std::string program = std::string(ZERODRIFT_BIN_DIR) + "/thermal_publisher";
  const std::string limits = "ulimit -s 524288 && ulimit -v 16777216 && exec \"$@\"";  // in kB
  ChildProcess& publisher =
      system.start_foreign("/bin/bash", {"-c", limits, "bash", program, "--domain",
                                         std::to_string(system.network().domain), "--source",
                                         "sysfs", "--sysfs-root", system.path("sys")});
  EXPECT_EQ(publisher.wait(30s), 2);
  const std::string said = publisher.err();
  for (const char* part : {"80 thermometers found, each read by a thread of its own, of which ",
                           " could be started: ", "; name those wanted with --probe NAME=FILE"})
    EXPECT_NE(said.find(part), std::string::npos) << said;
}

TEST(SysfsEnvironment, ReadingsArriveAndAFileThatVanishesCostsItsChannelAlone) {
  SystemUnderTest system(Domain::kSysfsEnvironment);
  const auto hwmon = system.path("sys/class/hwmon/hwmon0");
  const auto imu = system.path("sys/bus/iio/devices/iio:device0");
  write(hwmon / "in1_input", "5000\n");
  write(imu / "in_magn_x_raw", "200\n");
  write(imu / "in_magn_scale", "0.001\n");
  dds::Participant participant("test", system.network());
  Collector<msg::Environment> environment(participant);
  Collector<msg::Event> events(participant);
  ChildProcess& publisher =
      system.start("thermal_publisher",
                   {"--source", "sysfs", "--sysfs-root", system.path("sys"), "--rate", "20",
                    "--gyro-id", "5", "--channel", "supply=" + (hwmon / "in1_input").string(),
                    "--channel", "magnetic_x=-" + (imu / "in_magn_x_raw").string()});
  constexpr std::uint32_t kSupply = 1U << 8U;
  constexpr std::uint32_t kMagneticX = 1U;
  const auto comes = [&](const std::function<bool(const msg::Environment&)>& is_so) {
    return eventually([&] { return environment.size() > 0 && is_so(environment.newest()); });
  };
  EXPECT_TRUE(comes([](const auto& m) {
    return m.gyro_id() == 5 && m.channels() == (kSupply | kMagneticX) &&
           m.measured() == m.channels() && m.supply_v() == 5.0 &&
           std::abs(m.magnetic_ut()[0] + 20.0) < 1e-12;
  }));
  std::filesystem::rename(hwmon / "in1_input", hwmon / "gone");
  EXPECT_TRUE(comes([](const auto& m) {
    return m.channels() == (kSupply | kMagneticX) && m.measured() == kMagneticX;
  }));
  EXPECT_TRUE(eventually([&] { return told(events, "no_environment", "in1_input"); }));
  write(hwmon / "in1_input", "4500\n");
  EXPECT_TRUE(comes([](const auto& m) { return m.supply_v() == 4.5; }));
  publisher.send(SIGTERM);
  EXPECT_EQ(publisher.wait(2s), 0);

  const auto refused = [&](const Arguments& more) {
    Arguments arguments{"--source", "sysfs", "--sysfs-root", system.path("sys")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Finished end = system.run("thermal_publisher", arguments);
    EXPECT_EQ(end.exit_code, 2) << end.err;
    return end.err;
  };
  EXPECT_NE(refused({"--channel", "voltage=/x"}).find("--channel: found 'voltage=/x'"),
            std::string::npos);
  EXPECT_NE(refused({"--channel", "supply=" + (imu / "in_magn_x_raw").string()})
                .find("no file of this channel"),
            std::string::npos);
}

ChildProcess& start_recorder(SystemUnderTest& system, const std::filesystem::path& out) {
  ChildProcess& recorder = system.start("zerodrift", {"record", "--out", out});
  EXPECT_TRUE(eventually([&] { return recorder.out().find("recording to") != std::string::npos; }));
  return recorder;
}

// Ends a recorder; the lines of its recording's export with a field.
std::vector<std::string> fields_of(SystemUnderTest& system, ChildProcess& recorder,
                                   const std::filesystem::path& recording) {
  recorder.send(SIGINT);
  EXPECT_EQ(recorder.wait(30s), 0) << recorder.err();
  const auto csv = recording.string() + ".csv";
  const Finished exported = system.run("zerodrift", {"export", recording, "--out", csv});
  EXPECT_EQ(exported.exit_code, 0) << exported.err;
  const Table table = read_table(csv);
  std::vector<std::string> fields;
  for (const auto& row : table.rows) {
    const std::string& field = row[table.column("magnetic_x_uT")];
    if (!field.empty()) fields.push_back(row[table.column("time_s")] + " " + field);
  }
  return fields;
}

// Rule: what was published of the environment is in the recording, its export and its replay,
// however fast that is. The recorder alone keeps the rates and what goes beside them in step.
TEST(Environment, OfASimulationIsRecordedExportedAndReplayed) {
  SystemUnderTest system(Domain::kEnvironment);
  const std::filesystem::path source = ZERODRIFT_SOURCE_DIR;
  Arguments simulation{"--source",   "simulation",
                       "--model",    source / "config/models/lab_fog.yaml",
                       "--profile",  source / "config/profiles/diagnosis_chamber.yaml",
                       "--duration", "60",
                       "--speed",    "20",
                       "--wait-for", "recorder"};
  const auto live = system.path("live.mcap");
  ChildProcess& recorder = start_recorder(system, live);
  dds::Participant participant("test", system.network());
  Collector<msg::Environment> environment(participant);
  ChildProcess& thermal = system.start("thermal_publisher", simulation);
  ChildProcess& gyro = system.start("gyro_publisher", simulation + Arguments{"--rate", "10"});
  EXPECT_EQ(gyro.wait(60s), 0) << gyro.err();
  EXPECT_EQ(thermal.wait(60s), 0) << thermal.err();
  ASSERT_TRUE(eventually([&] { return environment.size() >= 600; }));
  const auto fields = fields_of(system, recorder, live);
  EXPECT_EQ(fields.size(), 600U) << "ten a second";

  const auto again = system.path("again.mcap");
  ChildProcess& second = start_recorder(system, again);
  ChildProcess& replay =
      system.start("zerodrift", {"replay", live, "--speed", "max", "--wait-for", "recorder"});
  EXPECT_EQ(replay.wait(60s), 0) << replay.err();
  EXPECT_EQ(fields_of(system, second, again), fields);
}

}  // namespace
}  // namespace zerodrift::system_test
