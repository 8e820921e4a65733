// SPDX-License-Identifier: Apache-2.0
// A receiving thread that never leaves a datagram is found.
#include "common/dds/receiving_watch.h"

#include <gtest/gtest.h>

#include <memory>
#include <vector>

namespace zerodrift::dds {
namespace {

using Time = ReceivingWatch::Time;

Time at_ns(std::int64_t ns) {
  return Time(std::chrono::nanoseconds(ns));
}

TEST(ReceivingWatch, TellsTheOldestDatagramThatIsWorkedOn) {
  ReceivingWatch watch;
  EXPECT_FALSE(watch.busy_since_ns());
  {
    const ReceivingWatch::Passage first(watch, at_ns(10));
    {
      const ReceivingWatch::Passage second(watch, at_ns(20));
      EXPECT_EQ(watch.busy_since_ns(), 10);
    }
    EXPECT_EQ(watch.busy_since_ns(), 10);
  }
  EXPECT_FALSE(watch.busy_since_ns());
}

TEST(ReceivingWatch, MoreThreadsThanItWatchesHarmNothing) {
  ReceivingWatch watch;
  std::vector<std::unique_ptr<ReceivingWatch::Passage>> passages;
  for (int k = 1; k <= 40; ++k)
    passages.push_back(std::make_unique<ReceivingWatch::Passage>(watch, at_ns(k)));
  EXPECT_EQ(watch.busy_since_ns(), 1);
  passages.clear();
  EXPECT_FALSE(watch.busy_since_ns());
}

TEST(StuckCount, CountsRoundsWithTheSameDatagram) {
  StuckCount count;
  for (int round = 0; round < StuckCount::kRounds; ++round) EXPECT_FALSE(count.look(7)) << round;
  EXPECT_TRUE(count.look(7));
  EXPECT_TRUE(count.look(7));
  EXPECT_FALSE(count.look(8)) << "it came to the next one";
  EXPECT_FALSE(count.look({}));
  EXPECT_FALSE(count.look({}));
}

TEST(StuckCount, AThreadThatIsAlwaysBusyIsNotStuck) {
  StuckCount count;
  for (std::int64_t datagram = 1; datagram < 1000; ++datagram) EXPECT_FALSE(count.look(datagram));
}

}  // namespace
}  // namespace zerodrift::dds
