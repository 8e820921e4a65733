// SPDX-License-Identifier: Apache-2.0
// What a slow client loses, and what it never does.
#include "common/web/outgoing_queue.h"

#include <gtest/gtest.h>

#include <random>
#include <string>
#include <vector>

namespace zerodrift::web {
namespace {

using Pushed = OutgoingQueue::Pushed;

Frame frame(Frame::Importance importance, std::string text, std::uint64_t replaces = 0) {
  Frame made;
  made.importance = importance;
  made.replaces = replaces;
  made.body = body_of(std::move(text));
  return made;
}
Frame sample(std::string text) {
  return frame(Frame::Importance::kSample, std::move(text));
}
Frame state(std::string text, std::uint64_t replaces = 0) {
  return frame(Frame::Importance::kState, std::move(text), replaces);
}

std::vector<std::string> all(OutgoingQueue& queue) {
  std::vector<std::string> texts;
  while (const auto next = queue.pop()) texts.push_back(*next->body);
  return texts;
}

using Texts = std::vector<std::string>;

TEST(OutgoingQueueLaws, WhatFitsComesOutWholeAndInOrder) {
  OutgoingQueue queue({});
  Texts expected;
  for (int i = 0; i < 100; ++i) {
    expected.push_back(std::to_string(i));
    queue.push(i % 3 == 0 ? state(expected.back()) : sample(expected.back()));
  }
  EXPECT_EQ(all(queue), expected);
  EXPECT_EQ(queue.dropped(), 0U);
  EXPECT_EQ(queue.bytes(), 0U);
  EXPECT_EQ(queue.fill(), 0.0);
}

TEST(OutgoingQueueLaws, TheOldestSamplesAreLostAndCountedNeverState) {
  OutgoingQueue queue({.sample_frames = 2});
  for (const char* text : {"a", "b"}) queue.push(sample(text));
  queue.push(state("S"));
  for (const char* text : {"c", "d", "e"}) queue.push(sample(text));
  EXPECT_EQ(queue.dropped(), 3U);
  EXPECT_EQ(all(queue), (Texts{"S", "d", "e"}));
}

TEST(OutgoingQueueLaws, BytesBoundSamplesAsFramesDo) {
  OutgoingQueue queue({.sample_bytes = 10});
  for (const char* text : {"aaaa", "bbbb", "cccc"}) queue.push(sample(text));
  EXPECT_EQ(queue.dropped(), 1U);
  EXPECT_EQ(queue.bytes(), 8U);
  queue.push(sample(std::string(50, 'x')));  // alone it may be longer than the bound
  EXPECT_EQ(all(queue), Texts{std::string(50, 'x')});
}

TEST(OutgoingQueueLaws, StateThatSaysTheSameAnewTakesTheOldOnesPlace) {
  OutgoingQueue queue({.state_frames = 3});
  queue.push(state("one", 1));
  queue.push(state("two", 2));
  for (int i = 0; i < 100; ++i)
    EXPECT_EQ(queue.push(state("newest " + std::to_string(i), 1)), Pushed::kWaits);
  EXPECT_EQ(queue.dropped(), 0U);
  EXPECT_EQ(all(queue), (Texts{"newest 99", "two"}));
  queue.push(state("again", 1));  // nothing waits any more that it could replace
  EXPECT_EQ(all(queue), Texts{"again"});
}

TEST(OutgoingQueueLaws, MoreStateThanIsKeptIsToldOnTheSpot) {
  OutgoingQueue frames({.state_frames = 2});
  EXPECT_EQ(frames.push(state("a")), Pushed::kWaits);
  EXPECT_EQ(frames.push(state("b")), Pushed::kWaits);
  EXPECT_EQ(frames.push(state("c")), Pushed::kTooMuchState);
  OutgoingQueue bytes({.state_bytes = 4});
  EXPECT_EQ(bytes.push(state("a backlog of hours")), Pushed::kWaits);  // alone it may be longer
  EXPECT_EQ(bytes.push(state("b")), Pushed::kTooMuchState);
}

// Against a plain list, whatever comes in whatever order.
TEST(OutgoingQueueLaws, AccountsAgreeWithWhatWaits) {
  std::mt19937 random(7);
  OutgoingQueue queue({.sample_frames = 8, .sample_bytes = 64, .state_frames = 1000});
  std::uint64_t pushed = 0;
  std::uint64_t popped = 0;
  std::uint64_t replaced = 0;
  for (int i = 0; i < 20000; ++i) {
    const auto choice = random() % 4;
    const std::size_t before = queue.frames();
    const std::uint64_t dropped = queue.dropped();
    if (choice == 0) {
      popped += queue.pop().has_value() ? 1U : 0U;
      continue;
    }
    const std::string text(random() % 20, 'x');
    queue.push(choice == 1 ? state(text, 1 + random() % 3) : sample(text));
    ++pushed;
    if (choice == 1 && queue.frames() == before) ++replaced;
    ASSERT_EQ(queue.frames() + queue.dropped() - dropped,
              before + (choice == 1 && queue.frames() == before ? 0U : 1U));
    ASSERT_LE(queue.frames(), 8U + 3U);
  }
  EXPECT_EQ(pushed, popped + replaced + queue.dropped() + queue.frames());
  while (queue.pop()) {
  }
  EXPECT_EQ(queue.bytes(), 0U);
}

}  // namespace
}  // namespace zerodrift::web
