// SPDX-License-Identifier: Apache-2.0
#include "common/service/hot_standby.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include "common/core/samples.h"

namespace zerodrift::service {
namespace {

using Role = HotStandby::Role;

constexpr std::int64_t kMs = 1'000'000;

msg::CompensatedRate answer(std::uint64_t sequence, std::uint32_t strength = 0,
                            double drift_radps = 1e-6) {
  msg::CompensatedRate message;
  message.sequence_number(sequence);
  message.sensor_time_ns(static_cast<std::int64_t>(sequence) * 5 * kMs);
  message.applied_drift_radps()[0] = drift_radps;
  message.ownership_strength(strength);
  return message;
}

std::vector<std::uint64_t> taken_over(HotStandby& standby, std::int64_t now_ns) {
  std::vector<std::uint64_t> written;
  standby.take_over(now_ns, [&](const msg::CompensatedRate& message) {
    written.push_back(message.sequence_number());
  });
  return written;
}

// A standby of instance 1 that has caught up with an active one of strength 32, and heard its
// sample 10.
HotStandby in_sync(std::int64_t now_ns) {
  HotStandby standby(1, 1, now_ns);
  standby.hear(answer(9, 32), now_ns);
  standby.caught_up(now_ns);
  standby.set_strength(standby.wanted_strength());
  EXPECT_FALSE(standby.take(answer(10), now_ns));
  standby.hear(answer(10, 32), now_ns);
  return standby;
}

TEST(StrongerThan, IsGreaterAndOfEachInstanceItsOwn) {
  for (const std::uint32_t strength : {0U, 1U, 15U, 16U, 17U, 31U, 32U, 4711U}) {
    std::set<std::uint32_t> found;
    for (std::uint32_t instance = 0; instance < kMostInstances; ++instance) {
      EXPECT_GT(stronger_than(strength, instance), strength);
      found.insert(stronger_than(strength, instance));
    }
    EXPECT_EQ(found.size(), kMostInstances);
  }
}

TEST(FirstStrength, IsGreaterTheLaterAndThenByRank) {
  const std::int64_t now = 1'800'000'000'000'000'000;
  EXPECT_GT(first_strength(now + 1'000'000'000, 0), first_strength(now, 15));
  EXPECT_GT(first_strength(now, 2), first_strength(now, 1));
  EXPECT_EQ(first_strength(0, 3), 3U) << "a clock that was never set";
}

TEST(HotStandby, AloneWritesEverythingAtOnce) {
  HotStandby alone(0);
  EXPECT_TRUE(alone.is_alone());
  for (std::uint64_t k = 1; k < 100; ++k) EXPECT_TRUE(alone.take(answer(k), 0));
  alone.set_unwell(true, 0);
  EXPECT_TRUE(alone.take(answer(100), 0)) << "nobody else would";
  EXPECT_FALSE(alone.must_take_over(3600'000 * kMs));
}

TEST(HotStandby, HoldsBackWhatTheActiveOneWrites) {
  HotStandby standby = in_sync(0);
  for (std::uint64_t k = 11; k < 1000; ++k) {
    const std::int64_t now = static_cast<std::int64_t>(k) * 5 * kMs;
    EXPECT_FALSE(standby.take(answer(k), now));
    standby.hear(answer(k, 32), now + kMs);
    EXPECT_FALSE(standby.must_take_over(now + 4 * kMs));
  }
  EXPECT_EQ(standby.counts().compared, 990U);
  EXPECT_EQ(standby.counts().differing, 0U);
}

TEST(HotStandby, TakesOverOnceTheOldestUnheardAnswerIsTooOld) {
  HotStandby standby = in_sync(0);
  EXPECT_FALSE(standby.take(answer(11), 100 * kMs));
  EXPECT_FALSE(standby.must_take_over(100 * kMs + HotStandby::kSilence.count() - 1));
  EXPECT_TRUE(standby.must_take_over(100 * kMs + HotStandby::kSilence.count()));
  const auto written = taken_over(standby, 105 * kMs);
  EXPECT_EQ(written, (std::vector<std::uint64_t>{11}));
  EXPECT_EQ(standby.role(), Role::kActive);
  EXPECT_TRUE(standby.take(answer(12), 106 * kMs));
}

// Samples from `first` on, each heard `lag_ns` after it was answered here.
void follow(HotStandby& standby, std::uint64_t first, std::uint64_t count, std::int64_t lag_ns) {
  std::deque<std::pair<std::int64_t, std::uint64_t>> under_way;
  for (std::uint64_t k = first; k < first + count; ++k) {
    const std::int64_t now = static_cast<std::int64_t>(k) * 5 * kMs;
    while (!under_way.empty() && under_way.front().first <= now) {
      standby.hear(answer(under_way.front().second, 32), under_way.front().first);
      under_way.pop_front();
    }
    EXPECT_FALSE(standby.take(answer(k), now));
    under_way.emplace_back(now + lag_ns, k);
  }
  for (const auto& [at, k] : under_way) standby.hear(answer(k, 32), at);
}

TEST(HotStandby, OverASlowNetworkItWaitsTwiceAsLongAsTheAnswersNeed) {
  HotStandby standby = in_sync(0);
  follow(standby, 11, 100, 20 * kMs);
  EXPECT_FALSE(standby.take(answer(111), 1000 * kMs));
  EXPECT_FALSE(standby.must_take_over(1000 * kMs + 39 * kMs));
  EXPECT_TRUE(standby.must_take_over(1000 * kMs + 40 * kMs));
}

// What the active one wrote may be lost on the way to a reader and be under repair when it dies.
TEST(HotStandby, WhereAnswersComeLateMoreIsWrittenAgain) {
  HotStandby standby = in_sync(0);
  follow(standby, 11, 100, 20 * kMs);
  EXPECT_FALSE(standby.take(answer(111), 555 * kMs));
  ASSERT_TRUE(standby.must_take_over(610 * kMs)) << "answer 110 was heard at 570 ms";
  const auto written = taken_over(standby, 610 * kMs);
  ASSERT_FALSE(written.empty());
  EXPECT_EQ(written.back(), 111U);
  EXPECT_EQ(written.front(), 98U) << "since 610 ms - 40 ms of patience - 4 * 20 ms";
  EXPECT_EQ(written.size(), 14U) << "none left out";
}

// What others wrote meanwhile is on its way in: silence counts while one listens.
TEST(HotStandby, OneThatStoodStillItselfListensBeforeItTakesOver) {
  HotStandby standby = in_sync(0);
  EXPECT_FALSE(standby.take(answer(11), 100 * kMs));
  standby.woke(500 * kMs);
  EXPECT_FALSE(standby.must_take_over(500 * kMs + HotStandby::kSilence.count() - 1));
  EXPECT_TRUE(standby.must_take_over(500 * kMs + HotStandby::kSilence.count()));
  standby.hear(answer(11, 32), 501 * kMs);
  EXPECT_FALSE(standby.must_take_over(500 * kMs + HotStandby::kSilence.count()));
}

// It listens a little after each standstill, and doesn't begin to wait from the start.
TEST(HotStandby, OneThatStandsStillAgainAndAgainTakesOverAllTheSame) {
  constexpr std::int64_t kDeathMs = 999;
  HotStandby standby = in_sync(0);
  std::optional<std::int64_t> relieved_ms;
  for (std::int64_t ms = 55; ms < 6000 && !relieved_ms; ++ms) {
    const bool wakes = ms > kDeathMs && ms % 1000 == 400;
    if (ms > kDeathMs && ms % 1000 < 400) continue;
    if (wakes) standby.woke(ms * kMs);
    if (ms % 5 == 0) {
      auto message = answer(static_cast<std::uint64_t>(ms / 5), 32);
      message.publish_time_ns((wakes ? ms - 400 : ms) * kMs);
      EXPECT_FALSE(standby.take(message, ms * kMs));
      if (ms < kDeathMs) standby.hear(message, ms * kMs);
    }
    if (standby.must_take_over(ms * kMs)) relieved_ms = ms;
  }
  ASSERT_TRUE(relieved_ms);
  EXPECT_LE(*relieved_ms, kDeathMs + 2 * HotStandby::kSilenceLate.count() / kMs);
}

TEST(HotStandby, ASlowNetworkIsForgottenOnceItIsFast) {
  HotStandby standby = in_sync(0);
  follow(standby, 11, 100, 20 * kMs);
  follow(standby, 111, 3000, kMs);  // 20 ms * exp(-3000 / 1024) = 1.1 ms
  EXPECT_FALSE(standby.take(answer(3111), 20000 * kMs));
  EXPECT_TRUE(standby.must_take_over(20000 * kMs + HotStandby::kSilence.count()));
}

TEST(HotStandby, OneThatTookOverTooSoonWaitsLongEnoughTheNextTime) {
  HotStandby standby = in_sync(0);
  EXPECT_FALSE(standby.take(answer(11), 100 * kMs));
  taken_over(standby, 105 * kMs);
  standby.hear(answer(11, 32), 115 * kMs);  // 15 ms after it was answered here
  EXPECT_TRUE(standby.take(answer(12), 116 * kMs));
  standby.hear(answer(12, 64),
               120 * kMs);  // relieved in turn; how long that one waited says nothing
  EXPECT_EQ(standby.role(), Role::kStandby);
  standby.caught_up(120 * kMs);
  EXPECT_FALSE(standby.take(answer(13), 121 * kMs));
  EXPECT_FALSE(standby.must_take_over(121 * kMs + 29 * kMs));
  EXPECT_TRUE(standby.must_take_over(121 * kMs + 30 * kMs));
}

TEST(HotStandby, OneThatWasStoppedForLongIsNotWaitedForEver) {
  HotStandby standby = in_sync(0);
  EXPECT_FALSE(standby.take(answer(11), 100 * kMs));
  taken_over(standby, 105 * kMs);
  standby.hear(answer(11, 32), 5000 * kMs);  // stopped, or cut off, for 5 s
  standby.hear(answer(12, 64), 5001 * kMs);
  standby.caught_up(5002 * kMs);
  EXPECT_FALSE(standby.take(answer(13), 5003 * kMs));
  EXPECT_TRUE(standby.must_take_over(5003 * kMs + HotStandby::kSilence.count()));
}

TEST(HotStandby, NoNetworkIsSoSlowThatItWaitsLongerThanTheDeadline) {
  HotStandby standby = in_sync(0);
  follow(standby, 11, 200, 90 * kMs);
  EXPECT_FALSE(standby.take(answer(211), 2000 * kMs));
  EXPECT_FALSE(standby.must_take_over(2000 * kMs + 99 * kMs));
  EXPECT_TRUE(standby.must_take_over(2000 * kMs + HotStandby::kSilenceLongest.count()));
}

// After an interruption of the network everybody is on his way through what came at once.
TEST(HotStandby, LateAnswersThatGoOnComingAreNoSilence) {
  HotStandby standby = in_sync(0);
  for (std::uint64_t k = 11; k <= 1000; ++k) EXPECT_FALSE(standby.take(answer(k), 5000 * kMs));
  std::int64_t now = 5000 * kMs;
  for (std::uint64_t k = 11; k <= 900; ++k) {
    now += 4 * kMs;
    EXPECT_FALSE(k > 11 && standby.must_take_over(now)) << k;
    standby.hear(answer(k, 32), now);
  }
  EXPECT_TRUE(standby.must_take_over(now + HotStandby::kSilenceLate.count()))
      << "it died on the way";
  const auto written = taken_over(standby, now + HotStandby::kSilenceLate.count());
  EXPECT_LE(written.front(), 901U);
  EXPECT_EQ(written.back(), 1000U);
}

// The active one may get them later; it is not silent for want of samples.
TEST(HotStandby, ABurstAfterAnInterruptionIsWaitedThrough) {
  HotStandby standby = in_sync(0);
  const auto published = [](std::uint64_t sequence) {
    msg::CompensatedRate message = answer(sequence);
    message.publish_time_ns(static_cast<std::int64_t>(sequence) * 5 * kMs);
    return message;
  };
  // On time by a clock that is 7 ms ahead, then a second's at once.
  for (std::uint64_t k = 11; k <= 100; ++k) {
    const std::int64_t now = static_cast<std::int64_t>(k) * 5 * kMs - 7 * kMs;
    EXPECT_FALSE(standby.take(published(k), now));
    standby.hear(answer(k, 32), now);
  }
  constexpr std::int64_t kHealed = 1500 * kMs;
  for (std::uint64_t k = 101; k <= 300; ++k) EXPECT_FALSE(standby.take(published(k), kHealed));
  EXPECT_FALSE(standby.must_take_over(kHealed + 900 * kMs));
  EXPECT_TRUE(standby.must_take_over(kHealed + 1000 * kMs)) << "it died meanwhile";
  // Once samples are on time again, a silence is one.
  for (std::uint64_t k = 101; k <= 300; ++k) standby.hear(answer(k, 32), kHealed + 10 * kMs);
  EXPECT_FALSE(standby.take(published(600), 3000 * kMs));
  EXPECT_TRUE(standby.must_take_over(3000 * kMs + HotStandby::kSilenceLongest.count()));
}

// It wrote to 20, and was relieved by one that came only to 14: 15 to 20 were taken from nobody,
// since readers hear the stronger one alone.
TEST(HotStandby, WritesAgainWhatTheOneThatRelievedItNeverReached) {
  HotStandby first = in_sync(0);
  EXPECT_FALSE(first.take(answer(11), 50 * kMs));
  taken_over(first, 100 * kMs);
  for (std::uint64_t k = 12; k <= 20; ++k) EXPECT_TRUE(first.take(answer(k), 101 * kMs));
  for (std::uint64_t k = 12; k <= 14; ++k) first.hear(answer(k, 64), 102 * kMs);
  EXPECT_EQ(first.role(), Role::kStandby);
  const std::int64_t later = 102 * kMs + HotStandby::kSilenceLongest.count();
  EXPECT_TRUE(first.must_take_over(later));
  const auto written = taken_over(first, later);
  for (std::uint64_t k = 15; k <= 20; ++k)
    EXPECT_TRUE(std::find(written.begin(), written.end(), k) != written.end()) << k;
}

TEST(HotStandby, WritesAgainWhatMayNotHaveArrivedEverywhere) {
  HotStandby standby = in_sync(0);
  for (std::uint64_t k = 11; k <= 20; ++k) {
    EXPECT_FALSE(standby.take(answer(k), static_cast<std::int64_t>(k) * 5 * kMs));
    if (k < 20) standby.hear(answer(k, 32), static_cast<std::int64_t>(k) * 5 * kMs + 1);
  }
  // 20 was answered at 100 ms and not heard; 15 to 19 are no older than 20 + 5 ms.
  EXPECT_EQ(taken_over(standby, 105 * kMs), (std::vector<std::uint64_t>{16, 17, 18, 19, 20}));
}

TEST(HotStandby, TheActiveOneMayAnswerFirst) {
  HotStandby standby = in_sync(0);
  standby.hear(answer(11, 32), kMs);
  standby.hear(answer(12, 32), 2 * kMs);
  EXPECT_FALSE(standby.take(answer(11), 3 * kMs));
  EXPECT_FALSE(standby.take(answer(12, 0, 2e-6), 3 * kMs));
  EXPECT_FALSE(standby.must_take_over(1000 * kMs)) << "both were heard";
  EXPECT_EQ(standby.counts().compared, 3U);
  EXPECT_EQ(standby.counts().differing, 1U);
}

TEST(HotStandby, ThatHearsNobodyWaitsForDiscoveryAndThenWritesAll) {
  HotStandby first(0, 2, 0);
  for (std::uint64_t k = 1; k <= 300; ++k)
    EXPECT_FALSE(first.take(answer(k), static_cast<std::int64_t>(k) * 5 * kMs));
  EXPECT_FALSE(first.must_take_over(HotStandby::kDiscovery.count() - 1));
  EXPECT_TRUE(first.must_take_over(HotStandby::kDiscovery.count()));
  EXPECT_EQ(taken_over(first, HotStandby::kDiscovery.count()).size(), 300U);
}

TEST(HotStandby, OfTwoThatAreActiveTheWeakerStepsBack) {
  HotStandby weaker(1, 1, 0);
  HotStandby stronger(0, 2, 0);
  taken_over(weaker, 1);
  taken_over(stronger, 1);
  weaker.hear(answer(5, stronger.strength()), 2);
  stronger.hear(answer(5, weaker.strength()), 2);
  EXPECT_EQ(weaker.role(), Role::kStandby);
  EXPECT_EQ(stronger.role(), Role::kActive);
  EXPECT_TRUE(weaker.needs_state());
  EXPECT_EQ(weaker.counts().step_backs, 1U);
}

TEST(HotStandby, OneThatIsBehindWaitsLonger) {
  HotStandby standby(1, 1, 0);
  standby.hear(answer(10, 32), 0);
  EXPECT_TRUE(standby.needs_state());
  EXPECT_EQ(standby.health(), HotStandby::Health::kBehind);
  EXPECT_FALSE(standby.take(answer(11), kMs));
  EXPECT_FALSE(standby.must_take_over(kMs + HotStandby::kSilenceBehind.count() - 1));
  EXPECT_TRUE(standby.must_take_over(kMs + HotStandby::kSilenceBehind.count()));
}

TEST(HotStandby, ThatHasCaughtUpIsStrongerThanTheActiveOne) {
  const HotStandby standby = in_sync(0);
  EXPECT_GT(standby.strength(), 32U);
  EXPECT_EQ(standby.health(), HotStandby::Health::kInSync);
  EXPECT_FALSE(standby.needs_state());
}

TEST(HotStandby, AsksForTheStateAgainWhereItsAnswersStayOthers) {
  HotStandby standby = in_sync(0);
  std::uint64_t k = 11;
  for (; k < 11 + 199; ++k) {
    EXPECT_FALSE(standby.take(answer(k, 0, 2e-6), 0));
    standby.hear(answer(k, 32), 0);
  }
  EXPECT_FALSE(standby.needs_state());
  EXPECT_FALSE(standby.take(answer(k, 0, 2e-6), 0));
  standby.hear(answer(k, 32), 0);
  EXPECT_TRUE(standby.needs_state());
  standby.caught_up(0);
  EXPECT_FALSE(standby.needs_state());
}

TEST(HotStandby, AnActiveOneThatIsUnwellStepsBackOnceAndIsActiveAgainWhereNobodyElseIs) {
  HotStandby standby = in_sync(0);
  taken_over(standby, 0);
  standby.set_unwell(true, 10 * kMs);
  EXPECT_EQ(standby.role(), Role::kStandby);
  EXPECT_FALSE(standby.needs_state()) << "it could not use it";
  EXPECT_FALSE(standby.take(answer(20), 12 * kMs));
  EXPECT_FALSE(standby.must_take_over(12 * kMs + HotStandby::kSilence.count()));
  EXPECT_TRUE(standby.must_take_over(12 * kMs + HotStandby::kSilenceUnwell.count()));
  EXPECT_EQ(taken_over(standby, 70 * kMs), (std::vector<std::uint64_t>{20}));
  standby.set_unwell(true, 80 * kMs);
  EXPECT_EQ(standby.role(), Role::kActive) << "for as long as it hangs";
  standby.set_unwell(false, 90 * kMs);
  standby.set_unwell(true, 95 * kMs);
  EXPECT_EQ(standby.role(), Role::kStandby);
}

TEST(HotStandby, IsPatientWithRecordsAndSimulations) {
  HotStandby standby = in_sync(0);
  auto replayed = answer(11);
  replayed.clock_source(static_cast<std::uint32_t>(core::ClockSource::kReplay));
  EXPECT_FALSE(standby.take(replayed, kMs));
  EXPECT_FALSE(standby.must_take_over(kMs + HotStandby::kSilencePaced.count() - 1));
  EXPECT_TRUE(standby.must_take_over(kMs + HotStandby::kSilencePaced.count()));
}

TEST(HotStandby, ASourceThatStartsAnewIsHeardAnew) {
  HotStandby standby(1, 1, 0);
  standby.hear(answer(10'000, 32), 0);
  standby.caught_up(0);
  standby.hear(answer(1, 32), 0);
  EXPECT_FALSE(standby.take(answer(2), kMs));
  EXPECT_TRUE(standby.must_take_over(kMs + HotStandby::kSilence.count()));
}

// What a subscriber sees: the strongest writer it hears, and of each sample the first.
class SubscriberModel {
 public:
  void hear(const msg::CompensatedRate& message) {
    if (message.ownership_strength() < strongest_) return;
    strongest_ = message.ownership_strength();
    if (known_.insert(message.sequence_number()).second) seen.push_back(message.sequence_number());
  }
  std::vector<std::uint64_t> seen;

 private:
  std::uint32_t strongest_ = 0;
  std::set<std::uint64_t> known_;
};

// --- a publisher that begins anew, which one instance may know long before the other

msg::CompensatedRate published(std::uint64_t sequence, std::int64_t publish_ns,
                               std::uint32_t strength = 0) {
  msg::CompensatedRate message = answer(sequence, strength);
  message.publish_time_ns(publish_ns);
  return message;
}

// In sync with an active one of strength 32 that answered 5000 to 5010 of the run before.
HotStandby after_a_run(std::int64_t now) {
  HotStandby standby = in_sync(now);
  for (std::uint64_t sequence = 5000; sequence <= 5010; ++sequence) {
    EXPECT_FALSE(standby.take(published(sequence, now), now));
    standby.hear(published(sequence, now, 32), now);
    now += kMs;
  }
  return standby;
}

TEST(HotStandby, WhatIsHeldOfTheRunBeforeIsNotMissedInTheNext) {
  HotStandby standby = after_a_run(0);
  const std::int64_t now = 1000 * kMs;
  standby.hear(published(122, now, 32), now);  // here the new publisher isn't known yet
  EXPECT_FALSE(standby.must_take_over(now + 200 * kMs));
  EXPECT_FALSE(standby.take(published(123, now + 5 * kMs), now + 300 * kMs));
  EXPECT_TRUE(standby.must_take_over(now + 600 * kMs));
  EXPECT_EQ(taken_over(standby, now + 600 * kMs), (std::vector<std::uint64_t>{123}));
}

TEST(HotStandby, AnswersOfANewRunAreNotTakenForHeardInTheOneBefore) {
  for (const std::uint64_t first : {std::uint64_t{0}, std::uint64_t{4000}}) {  // far back, or not
    HotStandby standby = after_a_run(0);
    const std::int64_t now = 1000 * kMs;
    EXPECT_FALSE(standby.take(published(first, now), now));
    EXPECT_FALSE(standby.must_take_over(now));
    EXPECT_TRUE(standby.must_take_over(now + 200 * kMs)) << first;
    EXPECT_EQ(taken_over(standby, now + 200 * kMs), (std::vector<std::uint64_t>{first}));
  }
}

TEST(HotStandby, OneThatIsRelievedByAnswersOfTheRunBeforeTakesOverAgain) {
  HotStandby standby = after_a_run(0);
  const std::int64_t now = 1000 * kMs;
  EXPECT_FALSE(standby.take(published(122, now), now));
  ASSERT_TRUE(standby.must_take_over(now + 200 * kMs));
  static_cast<void>(taken_over(standby, now + 200 * kMs));
  const std::int64_t then = now + 205 * kMs;
  EXPECT_TRUE(standby.take(published(123, then), then));
  standby.hear(published(5009, 9 * kMs, standby.strength() + 1), then);
  EXPECT_EQ(standby.role(), Role::kStandby);
  EXPECT_FALSE(standby.take(published(124, then + 5 * kMs), then + 5 * kMs));
  EXPECT_TRUE(standby.must_take_over(then + 300 * kMs));
  const auto written = taken_over(standby, then + 300 * kMs);
  EXPECT_TRUE(std::find(written.begin(), written.end(), 124) != written.end());
}

// The active one dies at any instant, with what it wrote last on its way to one of the two
// listeners only; delays of up to 2 ms. The subscriber sees every sample once and in order.
TEST(HotStandby, LosesAndRepeatsNothingWheneverTheActiveOneDies) {
  std::mt19937_64 random(5);
  for (int trial = 0; trial < 500; ++trial) {
    const auto below = [&](std::int64_t n) {
      return static_cast<std::int64_t>(random() % static_cast<std::uint64_t>(n));
    };
    HotStandby standby = in_sync(0);
    SubscriberModel subscriber;
    const std::int64_t death = 100 * kMs + below(20 * kMs);
    std::multimap<std::int64_t, msg::CompensatedRate> to_standby;
    std::multimap<std::int64_t, msg::CompensatedRate> to_subscriber;
    std::int64_t last_arrival_standby = 0;
    std::int64_t last_arrival_subscriber = 0;
    bool standby_misses = false;
    bool subscriber_misses = false;
    std::map<std::int64_t, std::uint64_t> answered_here;
    for (std::uint64_t k = 11; k < 60; ++k) {
      const std::int64_t raw = static_cast<std::int64_t>(k) * 5 * kMs;
      answered_here[raw + below(kMs)] = k;
      const std::int64_t written = raw + below(kMs);
      if (written >= death) continue;
      // In order, as a reliable reader gives them out: after a missing one, nothing.
      last_arrival_standby = std::max(last_arrival_standby + 1, written + below(2 * kMs));
      last_arrival_subscriber = std::max(last_arrival_subscriber + 1, written + below(2 * kMs));
      const bool last = written + 5 * kMs >= death;
      const auto missing = last ? below(3) : 0;
      standby_misses = standby_misses || missing == 1;
      subscriber_misses = subscriber_misses || missing == 2;
      if (!standby_misses) to_standby.emplace(last_arrival_standby, answer(k, 32));
      if (!subscriber_misses) to_subscriber.emplace(last_arrival_subscriber, answer(k, 32));
    }
    for (std::int64_t now = 50 * kMs; now < 320 * kMs; now += kMs / 4) {
      const auto due = [now](auto& queue, auto&& take) {
        while (!queue.empty() && queue.begin()->first <= now) {
          take(queue.begin()->second);
          queue.erase(queue.begin());
        }
      };
      due(answered_here, [&](std::uint64_t k) {
        auto message = answer(k, standby.strength());
        if (standby.take(message, now)) subscriber.hear(message);
      });
      due(to_standby, [&](const auto& message) { standby.hear(message, now); });
      due(to_subscriber, [&](const auto& message) { subscriber.hear(message); });
      if (!standby.must_take_over(now)) continue;
      standby.take_over(now, [&](msg::CompensatedRate& message) {
        message.ownership_strength(standby.strength());
        subscriber.hear(message);
      });
    }
    std::vector<std::uint64_t> expected;
    for (std::uint64_t k = 11; k < 60; ++k) expected.push_back(k);
    ASSERT_EQ(subscriber.seen, expected) << "trial " << trial;
    ASSERT_EQ(standby.counts().takeovers, 1U);
  }
}

}  // namespace
}  // namespace zerodrift::service
