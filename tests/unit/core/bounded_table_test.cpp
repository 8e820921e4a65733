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
  EXPECT_EQ(table.size(), 3U);
  EXPECT_EQ(table.find(2), &table.entries().at(2));
  EXPECT_EQ(table.find(100), nullptr) << "to look is not to ask for a place";
  EXPECT_EQ(table.refused(), 9'900U);
}

// Rule: what a thread holds on to while others come in stays where it is.
TEST(BoundedTableLaws, AValueIsMadeInItsPlaceAndStaysThere) {
  struct Immovable {
    explicit Immovable(int its_number) : number(its_number) {}
    Immovable(const Immovable&) = delete;
    Immovable& operator=(const Immovable&) = delete;
    const int number;
  };
  BoundedTable<int, Immovable> table(100);
  const Immovable* first = table.find_or_make(50, 7);
  for (int key = 0; key < 100; ++key) table.find_or_make(key, key);
  EXPECT_EQ(table.find(50), first);
  EXPECT_EQ(table.entries().at(50).number, 7);
}

}  // namespace
}  // namespace zerodrift::core
