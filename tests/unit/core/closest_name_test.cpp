// SPDX-License-Identifier: Apache-2.0
#include "common/core/closest_name.h"

#include <gtest/gtest.h>

namespace zerodrift::core {
namespace {

TEST(ClosestNameLaws, FindsTyposAndOtherUnitsAndNothingFarOff) {
  const std::string names[] = {"duration_s", "power_on_s", "chamber"};
  EXPECT_EQ(closest_name("duratoin_s", names), "duration_s");
  EXPECT_EQ(closest_name("duration_minutes", names), "duration_s");
  EXPECT_EQ(closest_name("xyz", names), std::nullopt);
  EXPECT_EQ(suggestion("xyz", names), "; valid: duration_s, power_on_s, chamber");
}

TEST(ClosestNameLaws, NoMoreEditsThanAskedForAreForgiven) {
  const std::string names[] = {"compensate", "compare"};
  EXPECT_EQ(closest_name("compenate", names, 2), "compensate");
  EXPECT_EQ(closest_name("compnat", names, 2), std::nullopt);
  EXPECT_EQ(closest_name("compnat", names), "compensate") << "three edits of seven letters";
}

}  // namespace
}  // namespace zerodrift::core
