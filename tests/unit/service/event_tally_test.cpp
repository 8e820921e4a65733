// SPDX-License-Identifier: Apache-2.0
#include "common/service/event_tally.h"

#include <gtest/gtest.h>

namespace zerodrift::service {
namespace {

constexpr std::int64_t kStart = 5000000000;
constexpr std::int64_t kPeriod = EventTally::kPeriodNs;

TEST(EventTally, IsPublishedAtOnceAndThenOnceAPeriodWithItsCount) {
  EventTally tally;
  EXPECT_FALSE(tally.is_due(kStart));
  tally.raised(3, kStart);
  ASSERT_TRUE(tally.is_due(kStart));
  EXPECT_EQ(tally.publish("it fails", kStart).count, 3U);
  EXPECT_FALSE(tally.is_due(kStart + kPeriod)) << "none was raised since";
  tally.raised(1, kStart + 1);
  EXPECT_FALSE(tally.is_due(kStart + kPeriod - 1));
  ASSERT_TRUE(tally.is_due(kStart + kPeriod));
  EXPECT_EQ(tally.publish("it fails", kStart + kPeriod).count, 4U);
}

// Rule: what goes on is one line of the log, whatever its text counts.
TEST(EventTally, WhatGoesOnIsNewsOnce) {
  EventTally tally;
  std::int64_t now = kStart;
  for (int round = 0; round < 100; ++round) {
    for (int k = 0; k < 4; ++k) tally.raised(1, now += kPeriod / 4);
    const auto text = "asked " + std::to_string(round / 10) + ".5 s ago";
    EXPECT_EQ(tally.publish(text, now).is_news, round == 0) << round;
  }
}

// Before: a fault that came back was never in the log, whose last line was that it had gone.
TEST(EventTally, WhatComesBackAfterAQuietPeriodIsNewsAgain) {
  EventTally tally;
  tally.raised(1, kStart);
  EXPECT_TRUE(tally.publish("it fails", kStart).is_news);
  tally.raised(1, kStart + kPeriod - 1);
  EXPECT_FALSE(tally.publish("it fails", kStart + kPeriod).is_news);
  tally.raised(1, kStart + 2 * kPeriod);
  EXPECT_TRUE(tally.publish("it fails", kStart + 2 * kPeriod + 1).is_news);
}

TEST(EventTally, AnotherTextIsNewsAtOnceUnlessItsNumbersAloneDiffer) {
  EventTally tally;
  std::int64_t now = kStart;
  const auto is_news = [&](const char* text) {
    tally.raised(1, now += kPeriod / 2);
    return tally.publish(text, now += kPeriod / 2).is_news;
  };
  EXPECT_TRUE(is_news("axis x: compensating"));
  EXPECT_TRUE(is_news("axis x: raw (no temperature for -1.5 s)"));
  EXPECT_FALSE(is_news("axis x: raw (no temperature for 12 s)"));
  EXPECT_TRUE(is_news("axis x: compensating"));
}

TEST(EventTally, WhatIsPublishedByItselfIsCountedAndNotDue) {
  EventTally tally;
  EXPECT_EQ(tally.published_by_itself(), 1U);
  EXPECT_EQ(tally.published_by_itself(), 2U);
  EXPECT_FALSE(tally.is_due(kStart + kPeriod));
}

}  // namespace
}  // namespace zerodrift::service
