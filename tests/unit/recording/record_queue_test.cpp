// SPDX-License-Identifier: Apache-2.0
#include "common/recording/record_queue.h"

#include <gtest/gtest.h>

#include <array>
#include <thread>
#include <vector>

namespace zerodrift::recording {
namespace {

using namespace std::chrono_literals;

QueuedMessage message_of(std::uint32_t topic, std::uint64_t sequence, std::string_view payload) {
  return {.topic = topic,
          .gyro_id = topic + 1,
          .sequence = sequence,
          .log_ns = static_cast<std::int64_t>(sequence),
          .arrival_ns = static_cast<std::int64_t>(2 * sequence),
          .publish_ns = -static_cast<std::int64_t>(sequence),
          .role = MessageRole::kPlain,
          .part = sequence % 2 == 0 ? "coil" : "",
          .payload = payload};
}

TEST(RecordQueueLaws, GivesOutWhatWasPushedInItsOrder) {
  RecordQueue queue(1 << 20);
  for (std::uint64_t i = 0; i < 10; ++i) queue.push(message_of(2, i, std::string(i, 'x')));
  MessageBatch batch;
  ASSERT_TRUE(queue.take(batch, 0ms));
  std::size_t position = 0;
  std::uint64_t i = 0;
  for (QueuedMessage message; batch.next(position, message); ++i) {
    EXPECT_EQ(message.topic, 2U);
    EXPECT_EQ(message.gyro_id, 3U);
    EXPECT_EQ(message.sequence, i);
    EXPECT_EQ(message.log_ns, static_cast<std::int64_t>(i));
    EXPECT_EQ(message.arrival_ns, static_cast<std::int64_t>(2 * i));
    EXPECT_EQ(message.publish_ns, -static_cast<std::int64_t>(i));
    EXPECT_EQ(message.part, i % 2 == 0 ? "coil" : "");
    EXPECT_EQ(message.payload, std::string(i, 'x'));
  }
  EXPECT_EQ(i, 10U);
  EXPECT_EQ(batch.newest_arrival_ns(), 18);
  EXPECT_EQ(queue.dropped(), 0U);
}

TEST(RecordQueueLaws, IsOverOnceItIsClosedAndEmpty) {
  RecordQueue queue(1 << 20);
  queue.push(message_of(0, 0, "last"));
  queue.close();
  queue.push(message_of(0, 1, "too late"));
  MessageBatch batch;
  EXPECT_TRUE(queue.take(batch, 1h));
  EXPECT_FALSE(batch.empty());
  EXPECT_FALSE(queue.take(batch, 1h));
  EXPECT_EQ(queue.dropped(), 0U) << "nobody asked for what comes after the end";
}

// A replay waits for its recorder, so the recorder must not wait for more of the replay.
TEST(RecordQueueLaws, DoesNotWaitForMoreOfAPacedSource) {
  for (const MessageRole role : {MessageRole::kPaced, MessageRole::kPacedOnly}) {
    RecordQueue queue(1 << 20);
    for (std::uint64_t i = 0; i < 64; ++i) {
      auto message = message_of(0, i, "");
      message.role = role;
      queue.push(message);
    }
    MessageBatch batch;
    EXPECT_TRUE(queue.take(batch, 1h));
  }
}

TEST(RecordQueueAbuse, WhatFindsNoRoomIsDroppedAndCountedByTopic) {
  RecordQueue queue(1000);
  const std::string payload(300, 'x');
  for (std::uint64_t i = 0; i < 3; ++i) queue.push(message_of(0, i, payload));
  for (std::uint64_t i = 0; i < 5; ++i) queue.push(message_of(1, i, payload));
  EXPECT_EQ(queue.dropped(0) + queue.dropped(1), queue.dropped());
  EXPECT_EQ(queue.dropped(1), 5U);
  EXPECT_LE(queue.peak_bytes(), 1000U);
  MessageBatch batch;
  ASSERT_TRUE(queue.take(batch, 0ms));
  queue.push(message_of(1, 5, payload));
  EXPECT_EQ(queue.dropped(1), 5U) << "there is room again";
}

TEST(RecordQueueAbuse, WhatIsNotRecordedIsNoLossWhereItFindsNoRoom) {
  RecordQueue queue(100);
  for (const MessageRole role : {MessageRole::kPacedOnly, MessageRole::kTrigger}) {
    auto message = message_of(0, 0, std::string(300, 'x'));
    message.role = role;
    queue.push(message);
  }
  EXPECT_EQ(queue.dropped(), 0U);
}

TEST(RecordQueueLaws, OfSeveralThreadsNothingGoesByUncounted) {
  constexpr std::uint32_t kThreads = 4;
  constexpr std::uint64_t kEach = 20000;
  RecordQueue queue(50000);
  std::vector<std::thread> threads;
  for (std::uint32_t thread = 0; thread < kThreads; ++thread) {
    threads.emplace_back([&queue, thread] {
      for (std::uint64_t i = 0; i < kEach; ++i) queue.push(message_of(thread, i + 1, "payload"));
    });
  }
  std::thread closer([&] {
    for (auto& thread : threads) thread.join();
    queue.close();
  });
  std::array<std::uint64_t, kThreads> newest{};
  std::uint64_t taken = 0;
  MessageBatch batch;
  while (queue.take(batch, 1ms)) {
    std::size_t position = 0;
    for (QueuedMessage message; batch.next(position, message); ++taken) {
      ASSERT_GT(message.sequence, newest[message.topic]) << "each thread's own order stays";
      newest[message.topic] = message.sequence;
      ASSERT_EQ(message.payload, "payload");
    }
  }
  closer.join();
  EXPECT_EQ(taken + queue.dropped(), kThreads * kEach);
}

}  // namespace
}  // namespace zerodrift::recording
