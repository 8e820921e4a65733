// SPDX-License-Identifier: Apache-2.0
#include "common/recording/pre_trigger.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

namespace zerodrift::recording {
namespace {

constexpr std::int64_t kSecondNs = 1'000'000'000;

MessageBatch batch_of(std::uint64_t sequence, std::int64_t arrival_ns) {
  MessageBatch batch;
  batch.append({.sequence = sequence, .arrival_ns = arrival_ns, .payload = "payload"});
  return batch;
}

std::vector<std::uint64_t> given_out(PreTrigger& kept, std::int64_t trigger_ns) {
  std::vector<std::uint64_t> sequences;
  kept.give_out(trigger_ns,
                [&](const QueuedMessage& message) { sequences.push_back(message.sequence); });
  return sequences;
}

TEST(PreTriggerLaws, TheLastSecondsBeforeTheTriggerAreGivenOutInOrderAndOnce) {
  PreTrigger kept(3.0, 1U << 20U);
  for (std::int64_t s = 1; s <= 10; ++s)
    kept.keep(batch_of(static_cast<std::uint64_t>(s), s * kSecondNs), s * kSecondNs);
  EXPECT_EQ(given_out(kept, 10 * kSecondNs), (std::vector<std::uint64_t>{7, 8, 9, 10}));
  EXPECT_TRUE(given_out(kept, 10 * kSecondNs).empty());
  EXPECT_FALSE(kept.is_shortened());
}

// Rule: memory is bounded, and a recording says where that left something out.
TEST(PreTriggerLaws, WhereTheMemoryIsTooSmallTheNewestAreKeptAndItIsTold) {
  const std::size_t one = batch_of(1, kSecondNs).bytes();
  PreTrigger kept(100.0, 2 * one);
  for (std::int64_t s = 1; s <= 5; ++s)
    kept.keep(batch_of(static_cast<std::uint64_t>(s), s * kSecondNs), s * kSecondNs);
  EXPECT_EQ(given_out(kept, 5 * kSecondNs), (std::vector<std::uint64_t>{4, 5}));
  EXPECT_TRUE(kept.is_shortened());
}

}  // namespace
}  // namespace zerodrift::recording
