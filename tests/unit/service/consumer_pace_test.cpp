// SPDX-License-Identifier: Apache-2.0
#include "common/service/consumer_pace.h"

#include <gtest/gtest.h>

namespace zerodrift::service {
namespace {

constexpr bool kPaced = true;
constexpr bool kLate = true;

TEST(ConsumerPaceLaws, AReplayIsToldOfEveryThirtySecondSample) {
  ConsumerPace pace;
  int reports = 0;
  for (std::uint64_t k = 1; k <= 320; ++k) {
    if (!pace.take(k, kPaced, !kLate)) continue;
    ++reports;
    EXPECT_EQ(pace.newest_sequence(), 32U * static_cast<std::uint64_t>(reports));
    pace.note_report();
  }
  EXPECT_EQ(reports, 10);
}

TEST(ConsumerPaceLaws, AReportStaysDueUntilItWasMade) {
  ConsumerPace pace;
  for (std::uint64_t k = 1; k < 32; ++k) EXPECT_FALSE(pace.take(k, kPaced, !kLate));
  EXPECT_TRUE(pace.take(32, kPaced, !kLate));
  EXPECT_TRUE(pace.take(33, kPaced, !kLate));
}

TEST(ConsumerPaceLaws, ALateSampleTakesNothingBack) {
  ConsumerPace pace;
  EXPECT_FALSE(pace.take(7, kPaced, !kLate));
  EXPECT_FALSE(pace.take(3, kPaced, kLate));
  EXPECT_EQ(pace.newest_sequence(), 7U);
  EXPECT_TRUE(pace.is_waited_for());
}

TEST(ConsumerPaceLaws, NobodyWaitsForSamplesOfARealSensor) {
  ConsumerPace pace;
  for (std::uint64_t k = 1; k <= 1000; ++k) EXPECT_FALSE(pace.take(k, !kPaced, !kLate));
  EXPECT_FALSE(pace.is_waited_for());
}

}  // namespace
}  // namespace zerodrift::service
