// SPDX-License-Identifier: Apache-2.0
// A tool of ROS 2 sees on /diagnostics how gyros and services are, without a bridge.
#include <gtest/gtest.h>

#include <csignal>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include "common/dds/conversions.h"
#include "tests/support/cyclone_loopback.h"
#include "tests/system/pipeline.h"

namespace zerodrift::system_test {
namespace {

using namespace std::chrono_literals;

constexpr const char* kOk = "0";
constexpr const char* kError = "2";
constexpr const char* kStale = "3";

class Ros2Diagnostics : public ::testing::Test {
 protected:
  // The whole messages that came, the newest last.
  [[nodiscard]] std::vector<std::string> messages() const {
    std::vector<std::string> all;
    std::istringstream lines(tool_.out());
    std::string message;
    for (std::string line; std::getline(lines, line);) {
      message += line + "\n";
      if (!line.starts_with("end ")) continue;
      all.push_back(message);
      message.clear();
    }
    return all;
  }
  // The newest message says so: "LEVEL | NAME | ".
  [[nodiscard]] bool says(const std::string& level, const std::string& name) const {
    const auto all = messages();
    return !all.empty() &&
           ("\n" + all.back()).find("\n" + level + " | " + name + " | ") != std::string::npos;
  }

  SystemUnderTest system_{Domain::kRos2Diagnostics};
  ChildProcess& tool_ =
      system_.start_foreign("ros2_diagnostics_peer", {std::to_string(system_.network().domain)},
                            {{"CYCLONEDDS_URI", kLoopbackOnly}});
};

TEST_F(Ros2Diagnostics, AToolOfAnotherVendorSeesHowGyrosAndServicesAreOnceASecond) {
  const Simulation simulation{.profile = write_ramp_profile(system_, 3600)};
  Arguments source{"--source", "simulation", "--speed", "20"};
  for (const auto& argument : simulation.arguments()) source.push_back(argument);
  Arguments gyro_source = source;
  gyro_source.insert(gyro_source.end(), {"--rate", "100"});
  system_.start("compensation", {"--ros2-imu", "1=imu/data"});
  ChildProcess& thermal = system_.start("thermal_publisher", source);
  ChildProcess& gyro = system_.start("gyro_publisher", gyro_source);

  // It learns, and all three services are well.
  ASSERT_TRUE(eventually(
      [&] {
        return says(kOk, "zerodrift: compensation gyro 1") &&
               says(kOk, "zerodrift: compensation") && says(kOk, "zerodrift: gyro_publisher") &&
               says(kOk, "zerodrift: thermal_publisher") &&
               messages().back().find(" | gyro_1 | x, y, z: learning") != std::string::npos;
      },
      60s))
      << tool_.out();
  EXPECT_NE(messages().back().find(" | drift x [deg/h]="), std::string::npos);

  // A service that stops in order is not missed; one that is killed is, and so are its samples.
  thermal.send(SIGTERM);
  ASSERT_TRUE(eventually(
      [&] { return tool_.running() && messages().back().find("thermal") == std::string::npos; },
      30s));
  gyro.send(SIGKILL);
  ASSERT_TRUE(eventually(
      [&] {
        return says(kStale, "zerodrift: compensation gyro 1") &&
               (says(kStale, "zerodrift: gyro_publisher") ||
                says(kError, "zerodrift: gyro_publisher"));
      },
      30s))
      << tool_.out();

  // A second apart, by the clock of this host.
  std::vector<double> stamps;
  for (const std::string& message : messages()) {
    std::istringstream end(message.substr(message.rfind("end ") + 4));
    double sec = 0.0;
    double nanosec = 0.0;
    end >> sec >> nanosec;
    stamps.push_back(sec + 1e-9 * nanosec);
  }
  ASSERT_GT(stamps.size(), 2U);
  for (std::size_t i = 1; i < stamps.size(); ++i) EXPECT_GT(stamps[i] - stamps[i - 1], 0.5);
}

// Before: a fault that came every so many samples fell between the reports, each of which looked at
// one sample.
TEST_F(Ros2Diagnostics, AnInvalidSampleBetweenTwoReportsIsAnErrorThoughTheNewestOneIsValid) {
  system_.start("compensation", {"--ros2-imu", "1=imu/data"});
  dds::Participant participant("test", system_.network());
  dds::Writer<msg::AngularRate> rates(participant);
  core::AngularRateSample sample;
  sample.interval_s = 0.01;
  sample.clock = core::ClockSource::kHardware;
  const auto send = [&](bool is_x_valid) {
    ++sample.sequence;
    sample.time += core::from_seconds(sample.interval_s);
    sample.valid = {is_x_valid, true, true};
    auto message = dds::to_message(sample, 1, 0);
    ASSERT_TRUE(rates.write(message));
  };
  const std::regex error(
      R"(2 \| zerodrift: compensation gyro 1 \| gyro_1 \| y, z: passthrough [^;]*; x: passthrough )"
      R"(\([a-z_]+\), \d+ samples? with invalid_input since the report before \|)");
  EXPECT_TRUE(eventually([&] {
    for (const bool is_x_valid : {true, false, true}) send(is_x_valid);
    return std::regex_search(tool_.out(), error);
  })) << tool_.out();
}

}  // namespace
}  // namespace zerodrift::system_test
