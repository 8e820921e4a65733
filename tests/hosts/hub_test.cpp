// SPDX-License-Identifier: Apache-2.0
// The laws of the hub that the tests of several hosts rest on.
#include "tests/hosts/hub.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>

namespace zerodrift::hosts_test {
namespace {

using namespace std::chrono_literals;

constexpr std::size_t kPorts = 3;
constexpr std::uint64_t kSeed = 20260;

// A frame to the host behind `to`, with a number in it; ports' addresses end with their number.
Hub::Frame frame(std::uint8_t from, std::uint8_t to, std::uint32_t number = 0) {
  Hub::Frame bytes(64, 0);
  bytes[0] = bytes[6] = 0x02;
  bytes[5] = to;
  bytes[11] = from;
  std::memcpy(&bytes[14], &number, sizeof number);
  return bytes;
}

std::uint32_t number_of(const Hub::Frame& bytes) {
  std::uint32_t number = 0;
  std::memcpy(&number, &bytes[14], sizeof number);
  return number;
}

// All ports' addresses are seen once, so that frames go to one port each.
Hub acquainted(std::uint64_t seed = kSeed) {
  Hub hub(kPorts, seed);
  for (std::uint8_t port = 0; port < kPorts; ++port) hub.accept(port, frame(port, port), 0s);
  while (hub.take_due(0s)) {
  }
  return hub;
}

struct Arrival {
  std::uint32_t number;
  nanoseconds took;
};

// Numbered frames from port 0 to port 1, one each millisecond.
std::vector<Arrival> arrivals(Hub& hub, std::uint32_t frames) {
  for (std::uint32_t n = 0; n < frames; ++n) hub.accept(0, frame(0, 1, n), n * 1ms);
  std::vector<Arrival> arrived;
  while (const auto due = hub.next_due()) {
    const auto delivery = hub.take_due(*due);
    if (!delivery) continue;
    const std::uint32_t number = number_of(delivery->frame);
    arrived.push_back({number, *due - number * 1ms});
  }
  return arrived;
}

TEST(Hub, AnUnknownDestinationIsFloodedAndAKnownOneIsNot) {
  Hub hub(kPorts, kSeed);
  hub.accept(0, frame(0, 1), 0s);
  EXPECT_EQ(hub.under_way(), 2U);
  hub.accept(1, frame(1, 0), 0s);
  EXPECT_EQ(hub.under_way(), 3U);
  hub.accept(2, frame(2, 0xFF), 0s);
  EXPECT_EQ(hub.under_way(), 5U);
}

TEST(Hub, WithoutFaultsEveryFrameArrivesAtOnceInOrderAndAsItWas) {
  Hub hub = acquainted();
  const auto arrived = arrivals(hub, 1000);
  ASSERT_EQ(arrived.size(), 1000U);
  for (std::uint32_t n = 0; n < 1000; ++n) {
    EXPECT_EQ(arrived[n].number, n);
    EXPECT_EQ(arrived[n].took, 0ns);
  }
}

TEST(Hub, TheLossIsAsLargeAsToldAndCounted) {
  constexpr std::uint32_t kFrames = 100000;
  constexpr double kLoss = 0.05;
  Hub hub = acquainted();
  hub.set_conditions({.loss = kLoss});
  const auto before = hub.counts();
  const auto arrived = arrivals(hub, kFrames);
  const double lost = static_cast<double>(hub.counts().lost - before.lost);
  EXPECT_EQ(arrived.size() + hub.counts().lost - before.lost, kFrames);
  // 5 sigma of a binomial count: 5 sqrt(n p (1 - p)) = 345.
  EXPECT_NEAR(lost, kFrames * kLoss, 5.0 * std::sqrt(kFrames * kLoss * (1.0 - kLoss)));
}

TEST(Hub, TheSameSeedGivesEveryFrameTheSameFateWhateverTheOtherLinksCarry) {
  const LinkConditions bad{
      .loss = 0.2, .delay = 10ms, .jitter = 5ms, .reorder = 0.1, .reorder_by = 8ms};
  Hub one = acquainted();
  Hub other = acquainted();
  Hub foreign = acquainted(kSeed + 1);
  for (Hub* hub : {&one, &other, &foreign}) hub->set_conditions(bad);
  for (std::uint32_t n = 0; n < 500; ++n) {
    other.accept(2, frame(2, 1, n), n * 1ms);
    other.accept(1, frame(1, 0, n), n * 1ms);
  }
  while (const auto due = other.next_due()) static_cast<void>(other.take_due(*due));
  const auto same = [](const std::vector<Arrival>& a, const std::vector<Arrival>& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const auto& x, const auto& y) {
      return x.number == y.number && x.took == y.took;
    });
  };
  const auto expected = arrivals(one, 1000);
  EXPECT_TRUE(same(expected, arrivals(other, 1000)));
  EXPECT_FALSE(same(expected, arrivals(foreign, 1000)));
}

TEST(Hub, TheDelayIsUniformWithinItsJitter) {
  constexpr std::uint32_t kFrames = 10000;
  Hub hub = acquainted();
  hub.set_conditions({.delay = 10ms, .jitter = 5ms});
  const auto arrived = arrivals(hub, kFrames);
  ASSERT_EQ(arrived.size(), kFrames);
  double sum_ms = 0.0;
  for (const Arrival& arrival : arrived) {
    EXPECT_GE(arrival.took, 5ms);
    EXPECT_LE(arrival.took, 15ms);
    sum_ms += std::chrono::duration<double, std::milli>(arrival.took).count();
  }
  // 5 sigma of the mean of 1e4 uniform over 10 ms: 5 * 10 / sqrt(12) / 100 = 0.144 ms.
  EXPECT_NEAR(sum_ms / kFrames, 10.0, 0.144);
  // Frames 1 ms apart with 10 ms of spread overtake each other.
  EXPECT_FALSE(std::is_sorted(arrived.begin(), arrived.end(),
                              [](const auto& a, const auto& b) { return a.number < b.number; }));
}

TEST(Hub, FramesHeldBackAreOvertakenAndTheOthersKeepTheirOrder) {
  constexpr std::uint32_t kFrames = 10000;
  Hub hub = acquainted();
  hub.set_conditions({.reorder = 0.1, .reorder_by = 3500us});
  auto arrived = arrivals(hub, kFrames);
  ASSERT_EQ(arrived.size(), kFrames);
  // 5 sigma of a binomial count: 150.
  EXPECT_NEAR(static_cast<double>(hub.counts().held_back), 1000.0, 150.0);
  std::erase_if(arrived, [](const Arrival& arrival) { return arrival.took > 0ns; });
  EXPECT_EQ(arrived.size(), kFrames - hub.counts().held_back);
  EXPECT_TRUE(std::is_sorted(arrived.begin(), arrived.end(),
                             [](const auto& a, const auto& b) { return a.number < b.number; }));
}

TEST(Hub, ACutPassesNothingInEitherDirectionAndLeavesTheOtherLinksAlone) {
  Hub hub = acquainted();
  hub.set_conditions({.delay = 1ms});
  hub.accept(0, frame(0, 1), 0s);  // under way when the link is cut
  hub.cut({0}, {1});
  hub.accept(0, frame(0, 1), 0s);
  hub.accept(1, frame(1, 0), 0s);
  EXPECT_FALSE(hub.take_due(1s));
  EXPECT_EQ(hub.counts().cut, 3U);
  hub.accept(0, frame(0, 2), 1s);
  hub.accept(2, frame(2, 1), 1s);
  EXPECT_TRUE(hub.take_due(2s));
  EXPECT_TRUE(hub.take_due(2s));
  hub.heal();
  EXPECT_FALSE(hub.take_due(2s)) << "what was cut came back";
  hub.accept(0, frame(0, 1), 2s);
  EXPECT_TRUE(hub.take_due(3s));
}

TEST(Hub, APulledPlugStaysPulled) {
  Hub hub = acquainted();
  hub.unplug(1);
  hub.heal();
  hub.accept(0, frame(0, 1), 0s);
  hub.accept(1, frame(1, 0), 0s);
  EXPECT_FALSE(hub.take_due(1s));
  hub.accept(0, frame(0, 2), 1s);
  EXPECT_TRUE(hub.take_due(1s));
}

TEST(Hub, EveryAcceptedFrameIsCountedOnce) {
  Hub hub = acquainted();
  hub.set_conditions({.loss = 0.3, .delay = 10ms, .jitter = 10ms});
  const auto before = hub.counts();
  for (std::uint32_t n = 0; n < 1000; ++n) {
    if (n == 500) hub.cut({0}, {1});
    hub.accept(0, frame(0, 1, n), n * 1ms);
    while (hub.take_due(n * 1ms)) {
    }
  }
  const auto& now = hub.counts();
  EXPECT_EQ(now.accepted - before.accepted, 1000U);
  EXPECT_EQ(now.delivered - before.delivered + now.lost - before.lost + now.cut + hub.under_way(),
            1000U);
}

TEST(Hub, WhatIsNoFrameIsNotPassedOn) {
  Hub hub = acquainted();
  hub.accept(0, std::vector<std::uint8_t>(13, 0xFF), 0s);
  hub.accept(0, {}, 0s);
  EXPECT_EQ(hub.under_way(), 0U);
  EXPECT_EQ(hub.counts().malformed, 2U);
}

TEST(Hub, ConditionsThatMakeNoSenseAreRefusedByName) {
  Hub hub(kPorts, kSeed);
  EXPECT_THROW(hub.set_conditions({.loss = 1.5}), std::invalid_argument);
  EXPECT_THROW(hub.set_conditions({.loss = std::nan("")}), std::invalid_argument);
  EXPECT_THROW(hub.set_conditions({.delay = 1ms, .jitter = 2ms}), std::invalid_argument);
  EXPECT_THROW(hub.set_conditions({.reorder = -0.1}), std::invalid_argument);
}

}  // namespace
}  // namespace zerodrift::hosts_test
