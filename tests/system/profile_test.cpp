// SPDX-License-Identifier: Apache-2.0
// An application of others on Fast DDS joins with a file of deploy/profiles and nothing else.
#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "tests/system/files.h"
#include "tests/system/peer_lines.h"
#include "tests/system/pipeline.h"

namespace zerodrift::system_test {
namespace {

using namespace std::chrono_literals;

// The line that profile_peer prints for a sample.
std::string line_of(const msg::CompensatedRate& sample) {
  std::array<char, 96> text{};
  std::snprintf(text.data(), text.size(), "%u %llu %a", sample.gyro_id(),
                static_cast<unsigned long long>(sample.sequence_number()),
                sample.applied_drift_radps()[0]);
  return text.data();
}

struct Deployment {
  Domain domain{};
  std::string profiles{};  // of deploy/profiles
  // What the file leaves to be edited, and what stands there on this computer.
  std::vector<std::pair<std::string, std::string>> edits{};
  Arguments arguments{};  // of every service
  dds::Transport transport = dds::Transport::kUdp;
  std::vector<std::string> discovery_servers{};
};

std::filesystem::path edited(const SystemUnderTest& system, const Deployment& deployment) {
  std::string text = content(std::filesystem::path(ZERODRIFT_SOURCE_DIR) / "deploy/profiles" /
                             deployment.profiles);
  for (const auto& [from, to] : deployment.edits) {
    EXPECT_NE(text.find(from), std::string::npos) << from << " is not in " << deployment.profiles;
    for (auto at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size()))
      text.replace(at, from.size(), to);
  }
  const auto file = system.path(deployment.profiles);
  write(file, text);
  return file;
}

// 100 s at 20 times real time, as CycloneDdsPeer's test and for its reasons.
void expect_joins(const Deployment& deployment) {
  SystemUnderTest system(deployment.domain);
  constexpr std::uint64_t kSamples = 10000;  // at 100 Hz
  const Simulation simulation{.profile = write_ramp_profile(system, 100)};
  const Arguments source = Arguments{"--source", "simulation", "--speed", "20"} +
                           simulation.arguments() + deployment.arguments;
  for (std::size_t id = 0; id < deployment.discovery_servers.size(); ++id)
    system.start("discovery_server", Arguments{"--id", std::to_string(id)} + deployment.arguments);

  dds::NetworkOptions network = system.network();
  network.transport = deployment.transport;
  network.discovery_servers = deployment.discovery_servers;
  dds::Participant participant("test", network);
  Collector<msg::CompensatedRate> ours(participant);
  ChildProcess& peer = system.start_foreign(
      "profile_peer", {edited(system, deployment).string(), std::to_string(network.domain),
                       std::to_string(kSamples)});
  system.start("compensation", Arguments{"--await-subscribers", "2"} + deployment.arguments);
  system.start("thermal_publisher", source);
  system.start("gyro_publisher", Arguments{"--rate", "100"} + source);

  ASSERT_EQ(peer.wait(40s), 0) << peer.err();
  EXPECT_EQ(peer.err(), "") << "the middleware complains of the file";
  ASSERT_TRUE(eventually([&] { return ours.size() == kSamples; }));
  expect_lines(peer.out(), ours.all(), line_of);
}

TEST(Profiles, OnOneComputerTheyReceiveEverySampleOnce) {
  expect_joins({.domain = Domain::kProfileOneComputer, .profiles = "one_computer.xml"});
}

TEST(Profiles, ThroughSharedMemoryTheyReceiveEverySampleOnce) {
  expect_joins({.domain = Domain::kProfileSharedMemory,
                .profiles = "shared_memory.xml",
                .arguments = {"--transport", "shm"},
                .transport = dds::Transport::kSharedMemory});
}

// Both computers are this one.
TEST(Profiles, ThroughTwoDiscoveryServersTheyReceiveEverySampleOnce) {
  const std::vector<std::string> servers{"127.0.0.1:21811", "127.0.0.1:21812"};
  expect_joins({.domain = Domain::kProfileTwoComputers,
                .profiles = "two_computers.xml",
                .edits = {{"<address>192.168.0.5</address><port>11811</port>",
                           "<address>127.0.0.1</address><port>21811</port>"},
                          {"<address>192.168.0.6</address><port>11811</port>",
                           "<address>127.0.0.1</address><port>21812</port>"},
                          {"192.168.0.7", "127.0.0.1"}},
                .arguments = {"--discovery-server", servers[0], "--discovery-server", servers[1]},
                .discovery_servers = servers});
}

}  // namespace
}  // namespace zerodrift::system_test
