// SPDX-License-Identifier: Apache-2.0
// Ways to meet and to deliver other than the default: discovery servers, shared memory. Samples are
// counted: endpoints may be matched and yet exchange nothing.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "common/dds/participant.h"
#include "tests/unit/dds/numbered_rates.h"
#include "tests/unit/dds/test_domain.h"

namespace zerodrift::dds {
namespace {

constexpr std::uint32_t kDomain = 119;
// In the domain's own range of ports, beyond those of its participants.
constexpr int kServerPort = 7400 + 250 * static_cast<int>(kDomain) + 240;
constexpr std::uint64_t kSamples = 1000;

std::string refusal(const NetworkOptions& network) {
  try {
    const Participant participant("refused", network);
  } catch (const DdsError& error) {
    return error.what();
  }
  return "no error";
}

class DiscoveryServers : public testing::Test {
 protected:
  DiscoveryServers() {
    network_ = domain_.network();
    for (const int port : {kServerPort, kServerPort + 1})
      network_.discovery_servers.push_back("127.0.0.1:" + std::to_string(port));
  }
  [[nodiscard]] std::unique_ptr<Participant> server(std::size_t place) const {
    NetworkOptions network = network_;
    network.serves = place;
    return std::make_unique<Participant>("server", network);
  }
  TestDomain domain_{kDomain, IfHeld::kWait};
  NetworkOptions network_;
};

TEST_F(DiscoveryServers, ParticipantsMeetThroughThem) {
  const auto first = server(0);
  const auto second = server(1);
  expect_all_delivered(network_, kSamples);
  // Each knows the other, once the two clients are gone.
  EXPECT_TRUE(eventually(
      [&] { return first->acquaintance().peers == 1 && second->acquaintance().peers == 1; }));
}

TEST_F(DiscoveryServers, EitherIsEnough) {
  for (const std::size_t place : {0U, 1U}) {
    const auto only = server(place);
    expect_all_delivered(network_, kSamples);
  }
}

// Neither by chance nor by the peers that the default profile looks for.
TEST_F(DiscoveryServers, WithoutThemNobodyMeets) {
  Participant here("writer", network_);
  Participant there("reader", network_);
  const Reader<msg::AngularRate> reader(there, [](const msg::AngularRate&, const auto&) {});
  const Writer<msg::AngularRate> writer(here);
  EXPECT_FALSE(eventually([&] { return writer.matched() > 0; }, std::chrono::seconds(1)));
  const auto late = server(0);
  EXPECT_TRUE(eventually([&] { return writer.matched() > 0; }));
}

TEST_F(DiscoveryServers, ABadListIsRefusedInOneLine) {
  NetworkOptions network = network_;
  for (const char* text : {"127.0.0.1:", "127.0.0.1:0", "127.0.0.1:65536", "127.0.0.1:x",
                           "127.0.0.1:1 ", "127.0.0.1:1:2"}) {
    network.discovery_servers = {text};
    EXPECT_EQ(refusal(network), "dds: discovery server '" + std::string(text) +
                                    "': expected IPv4 or IPv4:PORT, e.g. 192.168.0.10:11811");
  }
  network.discovery_servers = {"server"};
  EXPECT_EQ(refusal(network), "dds: 'server' is not an IPv4 address; expected e.g. 192.168.0.10");
  network.discovery_servers = {"192.0.2.1"};
  EXPECT_EQ(refusal(network),
            "dds: discovery server 192.0.2.1 is beyond this machine: name an interface");
  network.discovery_servers = {"127.0.0.1"};
  network.serves = 1;
  EXPECT_EQ(refusal(network), "dds: discovery server 1 is not in the list of 1; the first is 0");
}

TEST(SharedMemory, DeliversEverySampleAndLeavesNothing) {
  const TestDomain domain(kDomain, IfHeld::kWait);
  NetworkOptions network = domain.network();
  network.transport = Transport::kSharedMemory;
  const auto files = [] {
    std::set<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator("/dev/shm")) {
      const std::string name = entry.path().filename().string();
      if (name.starts_with("fastrtps_")) names.insert(name);
    }
    return names;
  };
  // By name: a participant takes away what killed ones have left.
  const std::set<std::string> before = files();
  const auto is_none_new = [&] {
    const std::set<std::string> now = files();
    return std::includes(before.begin(), before.end(), now.begin(), now.end());
  };
  {
    const Participant one("one", network);
    EXPECT_FALSE(is_none_new()) << "no shared memory is used";
  }
  expect_all_delivered(network, kSamples);
  EXPECT_TRUE(eventually(is_none_new));  // others may have some meanwhile
}

TEST(SharedMemory, MeetsWhoUsesUdpAlone) {
  const TestDomain domain(kDomain, IfHeld::kWait);
  NetworkOptions network = domain.network();
  Participant udp("udp", network);
  network.transport = Transport::kSharedMemory;
  Participant both("both", network);
  std::atomic<std::uint64_t> received{0};
  const Reader<msg::AngularRate> reader(both,
                                        [&](const msg::AngularRate&, const auto&) { ++received; });
  Writer<msg::AngularRate> writer(udp);
  ASSERT_TRUE(eventually([&] { return writer.matched() == 1; }));
  msg::AngularRate message;
  message.gyro_id(1);
  ASSERT_TRUE(writer.write(message));
  EXPECT_TRUE(eventually([&] { return received == 1; }));
}

TEST(SharedMemory, IsRefusedWithSecurity) {
  NetworkOptions network;
  network.domain = kDomain;
  network.transport = Transport::kSharedMemory;
  network.security_dir = "/nowhere";
  EXPECT_NE(refusal(network).find("with security the transport is udp"), std::string::npos);
  network.transport = Transport::kUdp;
  network.discovery_servers = {"127.0.0.1"};
  EXPECT_NE(refusal(network).find("with security there are no discovery servers"),
            std::string::npos);
}

}  // namespace
}  // namespace zerodrift::dds
