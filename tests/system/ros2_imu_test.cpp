// SPDX-License-Identifier: Apache-2.0
// A ROS 2 node subscribes without a bridge: same topic name, type name and wire form.
#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <string>

#include "tests/support/cyclone_loopback.h"
#include "tests/system/peer_lines.h"
#include "tests/system/pipeline.h"

namespace zerodrift::system_test {
namespace {

using namespace std::chrono_literals;

// The line that ros2_imu_peer prints for a sample, forward-left-up from forward-right-down.
std::string line_of(const msg::CompensatedRate& sample) {
  const std::int64_t ns = sample.sensor_time_ns();
  std::string line =
      "roof " + std::to_string(ns / 1'000'000'000) + " " + std::to_string(ns % 1'000'000'000);
  const std::array sign{1.0, -1.0, -1.0};
  const auto append = [&line](double value) {
    std::array<char, 64> text{};
    std::snprintf(text.data(), text.size(), " %a", value);
    line += text.data();
  };
  for (std::size_t i = 0; i < 3; ++i) append(sign[i] * sample.rate_radps()[i]);
  const bool known = sample.rate_covariance_radps2()[0] >= 0.0;
  for (std::size_t i = 0; i < 9; ++i)
    append(known ? sign[i / 3] * sign[i % 3] * sample.rate_covariance_radps2()[i] : 0.0);
  append(-1.0);
  append(-1.0);
  return line;
}

// 100 s at 20 times real time, as CycloneDdsPeer's test and for its reasons.
TEST(Ros2Imu, ANodeOfAnotherVendorReceivesEverySampleInItsFrame) {
  SystemUnderTest system(Domain::kRos2Imu);
  constexpr std::uint64_t kSamples = 10000;  // at 100 Hz
  const Simulation simulation{.profile = write_ramp_profile(system, 100)};
  const Arguments source =
      Arguments{"--source", "simulation", "--speed", "20"} + simulation.arguments();

  dds::Participant participant("test", system.network());
  Collector<msg::CompensatedRate> ours(participant);
  ChildProcess& node = system.start_foreign(
      "ros2_imu_peer",
      {std::to_string(system.network().domain), "rt/imu/data", std::to_string(kSamples)},
      {{"CYCLONEDDS_URI", kLoopbackOnly}});
  system.start("compensation", {"--await-subscribers", "2", "--ros2-imu", "1=imu/data",
                                "--gyro-frame", "frd", "--ros2-frame-id", "roof"});
  system.start("thermal_publisher", source);
  system.start("gyro_publisher", source + Arguments{"--rate", "100"});

  ASSERT_EQ(node.wait(40s), 0) << node.err();
  ASSERT_TRUE(eventually([&] { return ours.size() == kSamples; }));
  expect_lines(node.out(), ours.all(), line_of);
}

TEST(Ros2Imu, ATopicNameThatRos2WouldRefuseIsRefusedAtTheStart) {
  SystemUnderTest system(Domain::kRos2ImuBad);
  for (const char* wrong : {"1=/imu", "imu", "x=imu", "1=imu//data"}) {
    const Finished finished = system.run("compensation", {"--ros2-imu", wrong});
    EXPECT_EQ(finished.exit_code, 2) << wrong;
    EXPECT_NE(finished.err.find("--ros2-imu: found"), std::string::npos) << finished.err;
  }
}

}  // namespace
}  // namespace zerodrift::system_test
