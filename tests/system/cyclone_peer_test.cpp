// SPDX-License-Identifier: Apache-2.0
// Another vendor's subscriber, generated from the same IDL, hears what ours hears, to the bit.
#include <gtest/gtest.h>

#include <array>
#include <cinttypes>
#include <cstdio>
#include <string>

#include "tests/support/cyclone_loopback.h"
#include "tests/system/peer_lines.h"
#include "tests/system/pipeline.h"

namespace zerodrift::system_test {
namespace {

using namespace std::chrono_literals;

template <typename Values>
void append_values(std::string& line, const Values& values) {
  std::array<char, 64> text{};
  for (const double value : values) {
    std::snprintf(text.data(), text.size(), " %a", value);
    line += text.data();
  }
}

void append_octets(std::string& line, const std::array<std::uint8_t, 3>& values) {
  for (const std::uint8_t value : values) line += " " + std::to_string(value);
}

// The line that cyclone_peer prints for a sample.
std::string line_of(const msg::CompensatedRate& sample) {
  std::string line =
      std::to_string(sample.gyro_id()) + " " + std::to_string(sample.sequence_number()) + " " +
      std::to_string(sample.sensor_time_ns()) + " " + std::to_string(sample.validity());
  append_values(line, sample.rate_radps());
  append_values(line, sample.delta_angle_rad());
  append_values(line, std::array{sample.interval_s()});
  append_values(line, sample.applied_drift_radps());
  append_values(line, sample.drift_variance_radps2());
  append_values(line, sample.rate_covariance_radps2());
  line += " " + std::to_string(sample.model_epoch());
  append_octets(line, sample.mode());
  append_octets(line, sample.reason());
  append_octets(line, sample.rung());
  line += " " + std::to_string(sample.order()) + " " + std::to_string(sample.frame()) + " " +
          std::to_string(sample.clock_source()) + " " + std::to_string(sample.instance()) + " " +
          std::to_string(sample.publish_time_ns()) + " " +
          std::to_string(sample.ingress_time_ns()) + " " + std::to_string(sample.egress_time_ns());
  return line;
}

// Rule: every sample, every field. 200 s, so that an estimate is at work in the last ones. A replay
// does not keep pace with this reader (it reports no progress), so it runs at 20 times real time:
// 2000 samples a second, a fiftieth of what Cyclone DDS takes.
TEST(CycloneDdsPeer, ReceivesEverySampleThatOurReaderReceivesToTheBit) {
  SystemUnderTest system(Domain::kCyclonePeer);
  constexpr std::uint64_t kSamples = 20000;  // 200 s at 100 Hz
  const Simulation simulation{.profile = write_ramp_profile(system, 200)};
  const Arguments source =
      Arguments{"--source", "simulation", "--speed", "20"} + simulation.arguments();

  dds::Participant participant("test", system.network());
  Collector<msg::CompensatedRate> ours(participant);
  ChildProcess& peer = system.start_foreign(
      "cyclone_peer", {std::to_string(system.network().domain), std::to_string(kSamples)},
      {{"CYCLONEDDS_URI", kLoopbackOnly}});
  system.start("compensation", {"--await-subscribers", "2"});
  system.start("thermal_publisher", source);
  system.start("gyro_publisher", source + Arguments{"--rate", "100"});

  ASSERT_EQ(peer.wait(40s), 0) << peer.err();
  ASSERT_TRUE(eventually([&] { return ours.size() == kSamples; }));
  expect_lines(peer.out(), ours.all(), line_of);
  EXPECT_GE(ours.newest().rung()[0], 2) << "an estimate must be at work";
}

}  // namespace
}  // namespace zerodrift::system_test
