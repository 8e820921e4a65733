// SPDX-License-Identifier: Apache-2.0
#include "common/core/integer_time.h"

#include <gtest/gtest.h>

namespace zerodrift::core {
namespace {

TEST(IntegerTimeAbuse, DifferencesOfExtremeStampsSaturate) {
  EXPECT_EQ(saturating_difference(SensorTime{5}, SensorTime{8}), SensorTime{-3});
  EXPECT_EQ(saturating_difference(SensorTime::max(), SensorTime::min()), SensorTime::max());
  EXPECT_EQ(saturating_difference(SensorTime::min(), SensorTime::max()), SensorTime::min());
  EXPECT_EQ(saturating_difference(SensorTime{0}, SensorTime::min()), SensorTime::max());
  EXPECT_EQ(saturating_difference(SensorTime::min(), SensorTime{0}), SensorTime::min());
  EXPECT_EQ(saturating_difference(SensorTime{-1}, SensorTime::min()), SensorTime::max());
}

TEST(IntegerTimeLaws, EveryTimeLiesInItsInterval) {
  for (const std::int64_t width : {1, 3, 10}) {
    for (std::int64_t t = -31; t <= 31; ++t) {
      const std::int64_t start = interval_index(SensorTime{t}, SensorTime{width}) * width;
      EXPECT_LE(start, t);
      EXPECT_LT(t, start + width);
    }
  }
}

TEST(IntegerTimeLaws, StampsOfTodayAreUsableAndExtremesAreNot) {
  EXPECT_TRUE(is_usable(SensorTime{1'900'000'000'000'000'000}));  // 2030, Unix time
  EXPECT_TRUE(is_usable(SensorTime{0}));
  EXPECT_FALSE(is_usable(kNever));
  EXPECT_FALSE(is_usable(SensorTime::max()));
}

}  // namespace
}  // namespace zerodrift::core
