// SPDX-License-Identifier: Apache-2.0
#include "common/core/ring_buffer.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <deque>
#include <memory>
#include <random>

namespace zerodrift::core {
namespace {

void expect_same(const RingBuffer<int>& ring, const std::deque<int>& model) {
  ASSERT_EQ(ring.size(), model.size());
  EXPECT_EQ(ring.empty(), model.empty());
  EXPECT_EQ(ring.full(), model.size() == ring.capacity());
  for (std::size_t i = 0; i < model.size(); ++i) ASSERT_EQ(ring[i], model[i]);
  if (model.empty()) return;
  EXPECT_EQ(ring.front(), model.front());
  EXPECT_EQ(ring.back(), model.back());
}

TEST(RingBufferLaws, BehavesAsABoundedDequeUnderAnyOrderOfOperations) {
  constexpr std::uint64_t kSeed = 20220101;
  SCOPED_TRACE(kSeed);
  std::mt19937_64 random(kSeed);
  for (const std::size_t capacity : {1U, 2U, 3U, 8U, 61U}) {
    RingBuffer<int> ring(capacity);
    std::deque<int> model;
    for (int step = 0; step < 5000; ++step) {
      switch (random() % 16) {
        case 0:
          ring.clear();
          model.clear();
          break;
        case 1:
        case 2:
        case 3:
        case 4:
          if (model.empty()) break;
          ring.pop();
          model.pop_front();
          break;
        case 5:
        case 6:
        case 7:
        case 8:
          ring.push_overwriting(step);
          if (model.size() == capacity) model.pop_front();
          model.push_back(step);
          break;
        default: {
          const bool fits = model.size() < capacity;
          ASSERT_EQ(ring.push(step), fits);
          if (fits) model.push_back(step);
          break;
        }
      }
      expect_same(ring, model);
      ASSERT_EQ(ring.capacity(), capacity);
    }
  }
}

TEST(RingBufferLaws, AFullBufferRefusesAndKeepsWhatItHas) {
  RingBuffer<int> ring(2);
  EXPECT_TRUE(ring.push(1));
  EXPECT_TRUE(ring.push(2));
  EXPECT_FALSE(ring.push(3));
  expect_same(ring, {1, 2});
}

TEST(RingBufferLaws, ElementsCanBeChangedInPlace) {
  RingBuffer<int> ring(3);
  for (int i = 0; i < 5; ++i) ring.push_overwriting(i);
  ring.front() = 20;
  ring[1] = 30;
  ring.back() = 40;
  expect_same(ring, {20, 30, 40});
}

TEST(RingBufferScenario, MoveOnlyElementsPassThrough) {
  RingBuffer<std::unique_ptr<int>> ring(2);
  for (int i = 0; i < 3; ++i) ring.push_overwriting(std::make_unique<int>(i));
  EXPECT_EQ(*ring.front(), 1);
  EXPECT_EQ(*ring.back(), 2);
}

TEST(RingBufferAbuse, ClearedBufferStartsAfresh) {
  RingBuffer<int> ring(3);
  for (int i = 0; i < 4; ++i) ring.push_overwriting(i);
  ring.clear();
  ring.clear();
  EXPECT_TRUE(ring.empty());
  EXPECT_TRUE(ring.push(9));
  expect_same(ring, {9});
}

TEST(RingBufferAbuse, WhatItLacksIsNeitherReadNorPoppedInAnyBuild) {
  RingBuffer<int> ring(3);
  ring.push(1);
  EXPECT_DEATH(static_cast<void>(ring[1]), "an element that is read from a ring buffer is in it");
  ring.pop();
  EXPECT_DEATH(static_cast<void>(ring.back()), "an element that is read from a ring buffer");
  EXPECT_DEATH(ring.pop(), "a ring buffer that is popped holds an element");
  EXPECT_THROW(RingBuffer<int>{0}, BrokenPromise);
}

}  // namespace
}  // namespace zerodrift::core
