// SPDX-License-Identifier: Apache-2.0
#include "common/core/bounded_table.h"

#include <gtest/gtest.h>

namespace zerodrift::core {
namespace {

TEST(BoundedTableLaws, WhoIsInItStaysInItAndWhoIsTooManyIsCounted) {
  BoundedTable<int, double> table(3);
  for (int key = 0; key < 3; ++key) {
    double* value = table.find_or_make(key);
    ASSERT_NE(value, nullptr);
    EXPECT_EQ(*value, 0.0);
    *value = 10.0 * key;
  }
  for (int made_up = 100; made_up < 10'000; ++made_up)
    EXPECT_EQ(table.find_or_make(made_up), nullptr);
  EXPECT_EQ(table.refused(), 9'900U);
  EXPECT_EQ(table.entries().size(), 3U);
  for (int key = 0; key < 3; ++key) EXPECT_EQ(table.entries().at(key), 10.0 * key);
  EXPECT_NE(table.find_or_make(2), nullptr);
  EXPECT_FALSE(table.contains(100));
}

}  // namespace
}  // namespace zerodrift::core
