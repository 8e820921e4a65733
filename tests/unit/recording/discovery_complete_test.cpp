// SPDX-License-Identifier: Apache-2.0
#include "common/recording/discovery_complete.h"

#include <gtest/gtest.h>

namespace zerodrift::recording {
namespace {

constexpr std::int64_t kMs = 1'000'000;
using Known = dds::Acquaintance;

TEST(DiscoveryCompleteLaws, ItIsCompleteAfterHalfASecondWithoutNews) {
  DiscoveryComplete discovery;
  EXPECT_FALSE(discovery.note({}, 0, 0));
  EXPECT_FALSE(discovery.note({}, 0, 499 * kMs));
  EXPECT_TRUE(discovery.note({}, 0, 500 * kMs)) << "nobody is there";
  EXPECT_FALSE(discovery.note(Known{.peers = 1, .endpoints = 20}, 12, 600 * kMs));
  EXPECT_FALSE(discovery.note(Known{.peers = 1, .endpoints = 20}, 13, 700 * kMs))
      << "a writer that is matched later, as under security";
  EXPECT_TRUE(discovery.note(Known{.peers = 1, .endpoints = 20}, 13, 1200 * kMs));
}

TEST(DiscoveryCompleteLaws, AParticipantWhoseWritersAreNotToldYetIsWaitedFor) {
  DiscoveryComplete discovery;
  const Known found{.peers = 6, .unfinished = 6};
  for (int ms = 0; ms < 1100; ms += 100) EXPECT_FALSE(discovery.note(found, 0, ms * kMs));
  const Known reported{.peers = 6, .endpoints = 140};
  EXPECT_FALSE(discovery.note(reported, 9, 1100 * kMs));
  EXPECT_TRUE(discovery.note(reported, 9, 1600 * kMs));
}

TEST(DiscoveryCompleteLaws, AParticipantWithoutWritersHoldsNobodyUpForLong) {
  DiscoveryComplete discovery;
  const Known found{.peers = 2, .unfinished = 1, .endpoints = 9};
  EXPECT_FALSE(discovery.note(found, 3, 0));
  EXPECT_FALSE(discovery.note(found, 3, 2999 * kMs));
  EXPECT_TRUE(discovery.note(found, 3, 3000 * kMs));
}

}  // namespace
}  // namespace zerodrift::recording
