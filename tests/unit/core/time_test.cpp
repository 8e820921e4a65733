// SPDX-License-Identifier: Apache-2.0
#include "common/core/time.h"

#include <gtest/gtest.h>

#include <cstdint>

namespace zerodrift::core {
namespace {

TEST(TimeLaws, EveryNanosecondOfALongRecordSurvivesSecondsAndBack) {
  // A double of t seconds is exact to t * 2^-53, and the product by 1e-9 or 1e9 rounds once more:
  // below half a nanosecond while t < 1e6 s. The strides are primes, so that all residues are met.
  for (std::int64_t ns = -1'000'000'000'000'000; ns < 1'000'000'000'000'000; ns += 97'003'000'043) {
    ASSERT_EQ(from_seconds(seconds(SensorTime{ns})).count(), ns);
  }
}

TEST(TimeLaws, StampsOfA200HzRecordAreAscendingAndExact) {
  for (std::int64_t i = 0; i < 3'600'000; i += 7) {
    ASSERT_EQ(from_seconds(static_cast<double>(i) / 200.0).count(), i * 5'000'000);
  }
}

TEST(TimeGolden, HalfANanosecondRoundsAwayFromZero) {
  EXPECT_EQ(from_seconds(0.5e-9).count(), 1);
  EXPECT_EQ(from_seconds(-0.5e-9).count(), -1);
  EXPECT_EQ(from_seconds(0.49e-9).count(), 0);
}

TEST(TimeLaws, NeverIsBeforeEveryOtherTime) {
  EXPECT_LT(kNever, SensorTime{0});
  EXPECT_LT(kNever, from_seconds(-4e6));
}

}  // namespace
}  // namespace zerodrift::core
