// SPDX-License-Identifier: Apache-2.0
#include "common/service/early_inputs.h"

#include <gtest/gtest.h>

#include <deque>
#include <string>

namespace zerodrift::service {
namespace {

using Kept = std::deque<std::string>;

TEST(EarlyInputs, AreGivenBackOnceAndInOrder) {
  EarlyInputs<std::string> early(2, 3);
  early.keep(1, "a");
  early.keep(2, "b");
  early.keep(1, "c");
  EXPECT_EQ(early.take(1), (Kept{"a", "c"}));
  EXPECT_EQ(early.take(1), Kept{});
  EXPECT_EQ(early.take(2), (Kept{"b"}));
  EXPECT_EQ(early.take(3), Kept{});
}

TEST(EarlyInputs, OfTooManyItemsTheOldestGo) {
  EarlyInputs<std::string> early(2, 3);
  for (const char* item : {"a", "b", "c", "d", "e"}) early.keep(1, item);
  EXPECT_EQ(early.take(1), (Kept{"c", "d", "e"}));
}

// Rule: forged ids cost what is kept of the last of them, and one that goes on speaking is not
// forgotten for them.
TEST(EarlyInputsAbuse, OfTooManyIdsTheOneThatWasQuietLongestGoes) {
  EarlyInputs<std::string> early(4, 3);
  for (std::uint32_t id = 2; id < 1000; ++id) {
    early.keep(1, "true");
    early.keep(id, "forged");
  }
  EXPECT_EQ(early.forgotten(), 998U - 3U);
  EXPECT_EQ(early.take(1), (Kept{"true", "true", "true"}));
  EXPECT_EQ(early.take(2), Kept{});
  EXPECT_EQ(early.take(996), Kept{});
  for (const std::uint32_t id : {997U, 998U, 999U}) EXPECT_EQ(early.take(id), Kept{"forged"}) << id;
}

}  // namespace
}  // namespace zerodrift::service
