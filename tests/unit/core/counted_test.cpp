// SPDX-License-Identifier: Apache-2.0
#include "common/core/counted.h"

#include <gtest/gtest.h>

#include <limits>

namespace zerodrift::core {
namespace {

TEST(CountedLaws, OneHasNoPluralAndThousandsAreSetApart) {
  EXPECT_EQ(counted(0, "gyro"), "0 gyros");
  EXPECT_EQ(counted(1, "gyro"), "1 gyro");
  EXPECT_EQ(counted(2, "gyro"), "2 gyros");
  EXPECT_EQ(counted(999, "sample"), "999 samples");
  EXPECT_EQ(counted(1000, "sample"), "1,000 samples");
  EXPECT_EQ(counted(1234567, "sample"), "1,234,567 samples");
  EXPECT_EQ(counted(std::numeric_limits<std::uint64_t>::max(), "sample"),
            "18,446,744,073,709,551,615 samples");
}

}  // namespace
}  // namespace zerodrift::core
