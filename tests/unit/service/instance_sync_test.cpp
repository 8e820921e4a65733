// SPDX-License-Identifier: Apache-2.0
#include "common/service/instance_sync.h"

#include <gtest/gtest.h>

#include <cstdint>

namespace zerodrift::service {
namespace {

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kPeriod = 5 * kMs;

AnswerMark mark(std::uint32_t instance, std::uint64_t sequence, std::uint64_t digest = 1,
                std::uint32_t answered = 100000, std::uint64_t run = 1) {
  return {.instance = instance,
          .answered = answered,
          .run = run,
          .sequence = sequence,
          .digest = digest};
}

// One of two, and what it sees: samples come every 5 ms.
struct Instance {
  explicit Instance(std::uint32_t its_number) : number(its_number), sync(its_number) {}
  bool answer(std::uint64_t digest = 1, std::uint32_t answered = 100000) {
    now_ns += kPeriod;
    return sync.note(mark(number, ++sequence, digest, answered), now_ns);
  }
  void receive(std::uint64_t digest = 1, std::uint32_t answered = 100000) {
    sync.receive(mark(1 - number, sequence, digest, answered));
  }
  std::uint32_t number;
  InstanceSync sync;
  std::int64_t now_ns = 0;
  std::uint64_t sequence = 0;
};

Instance in_sync(std::uint32_t number) {
  Instance instance(number);
  instance.answer();
  instance.receive();
  instance.sync.caught_up();
  return instance;
}

TEST(InstanceSync, AloneWritesEverything) {
  InstanceSync alone;
  EXPECT_TRUE(alone.leads());
  for (std::uint64_t k = 1; k < 100; ++k) EXPECT_TRUE(alone.note(mark(0, k), 0));
  alone.set_hangs(true);
  EXPECT_TRUE(alone.note(mark(0, 100), 0)) << "nobody else would";
}

TEST(InstanceSync, TheOnlyOneIsInSyncTwoSecondsAfterItsFirstAnswer) {
  Instance only(1);
  while (!only.answer()) ASSERT_LT(only.now_ns, 3000 * kMs);
  EXPECT_GE(only.now_ns, 2000 * kMs);
  EXPECT_TRUE(only.sync.leads());
  EXPECT_FALSE(only.sync.giver()) << "nobody has anything for it";
}

TEST(InstanceSync, OneThatHearsAnotherWaitsForItsStateHoweverLong) {
  Instance late(0);
  for (int k = 0; k < 2000; ++k) {
    EXPECT_FALSE(late.answer(7)) << "it is behind";
    late.receive();
    ASSERT_EQ(late.sync.giver(), 1U);
  }
  late.sync.caught_up();
  EXPECT_TRUE(late.answer());
  EXPECT_EQ(late.sync.health(), InstanceSync::Health::kInSync);
}

// Rule: whoever is in sync writes, whether or not the other one is heard.
TEST(InstanceSync, ADeathChangesNothingForTheOther) {
  Instance instance = in_sync(1);
  for (int k = 0; k < 100; ++k) {
    EXPECT_TRUE(instance.answer());
    instance.receive();
  }
  for (int k = 0; k < 1000; ++k) EXPECT_TRUE(instance.answer());
}

// Rule: a stream that pauses and a process that stood still say nothing about others.
TEST(InstanceSync, NeitherAPauseNorAStandstillMakesOneTheOnlyOne) {
  Instance instance(0);
  for (int k = 0; k < 20; ++k) {
    instance.now_ns += 3600'000 * kMs;
    instance.sync.tick(instance.now_ns);
    EXPECT_FALSE(instance.answer());
    instance.receive();
    instance.sync.tick(instance.now_ns);
  }
}

TEST(InstanceSync, OfTwoThatDifferTheJuniorFallsBehindAndTheSeniorGoesOn) {
  Instance senior = in_sync(0);
  Instance junior = in_sync(1);
  for (std::uint64_t k = 0; k < InstanceSync::kDifferingRun; ++k) {
    EXPECT_TRUE(senior.answer(1));
    EXPECT_TRUE(junior.answer(2)) << "it may be a model that came late";
    senior.receive(2);
    junior.receive(1);
  }
  EXPECT_TRUE(senior.answer(1));
  EXPECT_FALSE(junior.answer(2));
  EXPECT_EQ(junior.sync.giver(), 0U);
  EXPECT_EQ(junior.sync.counts().step_backs, 1U);
}

// Rule: a command that changes the leader's model makes readers receive no mixture of two. Before:
// 200 answers of the old model and of the new one, in turn.
TEST(InstanceSync, AfterACommandOneAnswerThatDiffersIsEnough) {
  Instance senior = in_sync(0);
  Instance junior = in_sync(1);
  senior.sync.expect_change();
  junior.sync.expect_change();
  for (int k = 0; k < 10; ++k) {
    EXPECT_TRUE(senior.answer(1));
    EXPECT_TRUE(junior.answer(1)) << "it may have been refused";
    senior.receive(1);
    junior.receive(1);
  }
  EXPECT_TRUE(senior.answer(2));
  EXPECT_TRUE(junior.answer(1));
  senior.receive(1);
  junior.receive(2);
  EXPECT_TRUE(senior.answer(2)) << "it obeyed";
  EXPECT_FALSE(junior.answer(1));
  EXPECT_EQ(junior.sync.giver(), 0U);
  junior.sync.caught_up();
  EXPECT_TRUE(junior.answer(3)) << "one that differs may be a model that came late again";
  junior.receive(2);
  EXPECT_TRUE(junior.answer(2));
}

// Rule: who yields to a senior holds back no longer than the senior lives.
TEST(InstanceSync, AJuniorWhoseSeniorDiesGoesOnAtOnce) {
  Instance junior = in_sync(1);
  for (std::uint64_t k = 0; k < InstanceSync::kDifferingRun; ++k) {
    junior.answer(2);
    junior.receive(1);
  }
  const std::int64_t silent_since = junior.now_ns;
  while (!junior.answer(2)) ASSERT_LT(junior.now_ns - silent_since, 200 * kMs);
  EXPECT_GE(junior.now_ns - silent_since, InstanceSync::kSilentLeader.count());
}

TEST(InstanceSync, OneOfALongLineIsSeniorToOneThatBeganAnew) {
  Instance fresh = in_sync(0);
  for (std::uint64_t k = 0; k <= InstanceSync::kDifferingRun; ++k) {
    fresh.answer(2, 500);
    fresh.receive(1, 100000);
  }
  EXPECT_EQ(fresh.sync.health(), InstanceSync::Health::kBehind);
}

TEST(InstanceSync, AModelThatIsLateInOneChangesNothing) {
  Instance instance = in_sync(1);
  for (int k = 0; k < 5000; ++k) {
    EXPECT_TRUE(instance.answer(k % 150 == 0 ? 1 : 2));
    instance.receive(1);
  }
}

TEST(InstanceSync, ComparesWhatItHearsBeforeItAnswersToo) {
  Instance instance = in_sync(1);
  const auto before = instance.sync.counts().compared;
  instance.sync.receive(mark(0, instance.sequence + 1, 5));
  instance.answer(6);
  EXPECT_EQ(instance.sync.counts().compared, before + 1);
  EXPECT_EQ(instance.sync.counts().differing, 1U);
}

// Rule: one that has just started has learned nothing yet, so that its answers are no difference to
// be reported; from its state on they are.
TEST(InstanceSync, AnswersOfOneThatIsBehindAreNoDifference) {
  Instance late(0);
  for (int k = 0; k < 1000; ++k) {
    late.answer(7);
    late.receive(1);
  }
  EXPECT_EQ(late.sync.counts().differing, 0U);
  late.sync.caught_up();
  late.answer(7);
  late.receive(1);
  EXPECT_EQ(late.sync.counts().differing, 1U);
}

TEST(InstanceSync, TheLowestThatIsHeardLeads) {
  Instance instance = in_sync(1);
  instance.answer();
  instance.receive();
  instance.answer();
  EXPECT_FALSE(instance.sync.leads());
  for (int k = 0; k < 25; ++k) instance.answer();
  EXPECT_TRUE(instance.sync.leads()) << "100 ms without the other";
  instance.receive();
  instance.answer();
  EXPECT_FALSE(instance.sync.leads());
}

TEST(InstanceSync, OneThatHangsHoldsBackWhereABetterOneIsAndElseWrites) {
  Instance instance = in_sync(0);
  instance.answer();
  instance.receive();
  instance.sync.set_hangs(true);
  EXPECT_EQ(instance.sync.stated_answered(100000), 0U) << "others are senior to it";
  for (int k = 0; k < 100; ++k) {
    EXPECT_FALSE(instance.answer());
    instance.receive();
  }
  EXPECT_FALSE(instance.sync.giver()) << "its learner could not take a state";
  while (!instance.answer()) ASSERT_LT(instance.now_ns, 10000 * kMs);
  instance.receive();
  instance.sync.set_hangs(false);
  EXPECT_EQ(instance.sync.giver(), 1U);
}

TEST(InstanceSync, TwoThatHangDontBothHoldBack) {
  Instance lower = in_sync(0);
  lower.answer(1, 0);
  lower.receive(1, 0);
  lower.sync.set_hangs(true);
  EXPECT_TRUE(lower.answer(1, 0));
}

// Rule: two publishers of one id are never mixed: all follow the one that the senior follows.
TEST(InstanceSync, OfTwoThatFollowDifferentPublishersTheJuniorFallsBehindAndFollowsTheOther) {
  Instance senior = in_sync(0);
  Instance junior = in_sync(1);
  for (std::uint64_t k = 1; k <= InstanceSync::kDifferingRun + 1; ++k) {
    senior.sync.receive(mark(1, k, 9, 100000, 2));
    junior.sync.receive(mark(0, k, 9, 100000, 2));
  }
  EXPECT_EQ(senior.sync.health(), InstanceSync::Health::kInSync);
  EXPECT_EQ(junior.sync.health(), InstanceSync::Health::kBehind);
  EXPECT_EQ(junior.sync.wanted_run(), 2U);
}

TEST(InstanceSync, OneThatIsStillWithTheRunBeforeIsNotFollowed) {
  Instance instance = in_sync(1);
  for (int k = 0; k < 500; ++k) instance.answer();
  EXPECT_TRUE(instance.sync.note(mark(1, 1, 1, 100000, 2), instance.now_ns));
  for (std::uint64_t k = 1; k <= instance.sequence; ++k) instance.sync.receive(mark(0, k));
  EXPECT_EQ(instance.sync.health(), InstanceSync::Health::kInSync);
}

// Rule: a line of n answers up to a sample says nothing about what came before these n.
TEST(InstanceSync, WhatALineThatBeganAnewNeverAnsweredWasHeardFromNobody) {
  InstanceSync sync(1);
  sync.receive(mark(0, 1000, 1, 400));
  EXPECT_FALSE(sync.was_received(1, 600));
  EXPECT_TRUE(sync.was_received(1, 601));
  EXPECT_TRUE(sync.was_received(1, 1000));
  EXPECT_FALSE(sync.was_received(1, 1001));
  EXPECT_FALSE(sync.was_received(2, 1000)) << "of another run";
  sync.receive(mark(2, 700, 1, 100000));
  EXPECT_TRUE(sync.was_received(1, 600)) << "from the third one";
  sync.receive(mark(0, 1000, 1, 0));
  EXPECT_TRUE(sync.was_received(1, 800)) << "one that hangs doesn't say how long its line is";
}

TEST(InstanceSync, AnotherGyrosOrItsOwnOrAForgedNumberIsNobody) {
  Instance instance(0);
  instance.sync.receive(mark(0, 1));
  instance.sync.receive(mark(4711, 1));
  EXPECT_FALSE(instance.sync.giver());
}

}  // namespace
}  // namespace zerodrift::service
