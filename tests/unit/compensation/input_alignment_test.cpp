// SPDX-License-Identifier: Apache-2.0
// Three streams in any order of arrival become the one order of sensor time.
#include "common/compensation/input_alignment.h"

#include <gtest/gtest.h>

#include <set>
#include <vector>

#include "common/core/sequence_gap.h"
#include "tests/unit/compensation/synthetic_gyro.h"

namespace zerodrift::compensation {
namespace {

using core::SensorTime;

bool is_admitted(Admission admission) {
  return admission == Admission::kInOrder || admission == Admission::kLate;
}

// -------------------------------------------------------------------------------------------
// sequences

// Rule: whatever the order, each sequence number is admitted at most once, and missing() counts
// exactly the numbers between the first and the newest that were never admitted.
TEST(SequenceWindowLaws, EverySequenceIsAdmittedAtMostOnceAndMissingCountsTheRest) {
  for (const std::uint64_t seed : {1U, 2U, 3U, 4U}) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(seed);
    SequenceWindow window;
    std::set<std::uint64_t> admitted;
    const std::uint64_t first = 10'000;
    std::uint64_t newest = first;
    ASSERT_EQ(window.admit(first), Admission::kInOrder);
    admitted.insert(first);
    for (int i = 0; i < 30'000; ++i) {
      // Mostly near the newest, on both sides; now and then anywhere within the window's 4096.
      const std::uint64_t reach = random.below(500) == 0 ? 4096 : 40;
      const std::uint64_t sequence = newest + random.below(reach) - random.below(reach);
      const Admission admission = window.admit(sequence);
      ASSERT_EQ(is_admitted(admission), !admitted.contains(sequence));
      ASSERT_EQ(admission == Admission::kInOrder, sequence > newest);
      if (is_admitted(admission)) admitted.insert(sequence);
      newest = std::max(newest, sequence);
    }
    std::uint64_t between = 0;
    for (const std::uint64_t s : admitted) between += s >= first ? 1U : 0U;
    EXPECT_EQ(window.missing(), newest - first + 1 - between);
  }
}

// Rule: a number that arrives late is no longer missing.
TEST(SequenceWindow, AGapIsCountedAndALateArrivalUncountsIt) {
  SequenceWindow window;
  EXPECT_EQ(window.admit(5), Admission::kInOrder);
  EXPECT_EQ(window.admit(9), Admission::kInOrder);
  EXPECT_EQ(window.missing(), 3U);
  EXPECT_EQ(window.admit(7), Admission::kLate);
  EXPECT_EQ(window.missing(), 2U);
  EXPECT_EQ(window.admit(7), Admission::kDuplicate);
  EXPECT_EQ(window.missing(), 2U);
}

// Rule: a number from before the first was never counted as missing, so it uncounts nothing.
TEST(SequenceWindow, ANumberFromBeforeTheFirstIsAnsweredButUncountsNothing) {
  SequenceWindow window;
  window.admit(100);
  window.admit(102);
  EXPECT_EQ(window.admit(99), Admission::kLate);
  EXPECT_EQ(window.missing(), 1U);
}

// Rule: the window is 4096 wide; what is older may have been answered and is refused.
TEST(SequenceWindow, TheOldestNumberOfTheWindowIsTakenAndTheOneBeforeItRefused) {
  SequenceWindow window;
  window.admit(0);
  window.admit(4000);
  window.admit(8000);
  EXPECT_EQ(window.admit(8000 - 4095), Admission::kLate);
  EXPECT_EQ(window.admit(8000 - 4096), Admission::kTooOld);
}

// Rule: one corrupt number is answered once and changes nothing for those that follow.
TEST(SequenceWindow, OneNumberFarAheadDoesNotMakeTheOthersTooOld) {
  SequenceWindow window;
  window.admit(10);
  EXPECT_EQ(window.admit(1ULL << 60U), Admission::kLate);
  EXPECT_EQ(window.admit(1ULL << 60U), Admission::kDuplicate);
  EXPECT_EQ(window.admit(11), Admission::kInOrder);
  EXPECT_EQ(window.admit(12), Admission::kInOrder);
  EXPECT_EQ(window.missing(), 0U);
}

// Rule: a jump past the whole window is believed when the next number follows it, and leaves no
// stale marks behind.
TEST(SequenceWindow, AJumpThatGoesOnIsBelievedAndItsNumbersAreNew) {
  SequenceWindow window;
  for (std::uint64_t s = 0; s < 4096; ++s) window.admit(s);
  EXPECT_EQ(window.admit(3 * 4096), Admission::kLate);
  EXPECT_EQ(window.admit(3 * 4096 + 1), Admission::kInOrder);
  EXPECT_EQ(window.admit(3 * 4096), Admission::kDuplicate);
  for (std::uint64_t s = 2 * 4096 + 2; s < 3 * 4096; ++s) {
    ASSERT_EQ(window.admit(s), Admission::kLate) << s;
  }
  EXPECT_EQ(window.missing(), 4098U);  // 4096 to 8193: too old to come any more
}

// Rule: numbers that jump further than any outage lasts are another count, of which nothing is
// lost; what is lost of either counts as before. Before: the jump was added, and the sum wrapped to
// below the loss that it held.
TEST(SequenceWindow, NumbersThatJumpFurtherThanAnyLossAreAnotherCount) {
  constexpr std::uint64_t kFar = ~std::uint64_t{0} - 10'000;
  SequenceWindow window;
  window.admit(1);
  window.admit(4);
  EXPECT_EQ(window.admit(kFar), Admission::kLate);
  EXPECT_EQ(window.admit(kFar + 3), Admission::kInOrder);
  EXPECT_EQ(window.missing(), 4U) << "2 and 3 of one count, two numbers of the other";
  EXPECT_EQ(window.admit(kFar + 193), Admission::kInOrder);
  EXPECT_EQ(window.missing(), 4U + 189U);
  EXPECT_EQ(window.admit(kFar + 2), Admission::kLate);
  EXPECT_EQ(window.missing(), 3U + 189U);
  EXPECT_EQ(window.admit(kFar - 1), Admission::kLate) << "from before that count's first";
  EXPECT_EQ(window.missing(), 3U + 189U);
  EXPECT_EQ(window.admit(5), Admission::kTooOld);
  EXPECT_EQ(window.admit(6), Admission::kInOrder) << "the first count goes on";
  EXPECT_EQ(window.missing(), 3U + 189U);
}

// Rule: the longest outage that is believed counts in full.
TEST(SequenceWindow, TheLongestLossCountsInFull) {
  SequenceWindow window;
  window.admit(7);
  window.admit(7 + core::kLongestLoss);
  window.admit(8 + core::kLongestLoss);
  EXPECT_EQ(window.missing(), core::kLongestLoss - 1);
}

// Rule: a source that starts anew far behind is heard from its second sample on.
TEST(SequenceWindow, ARestartFarBehindIsBelievedWithItsSecondNumber) {
  SequenceWindow window;
  window.admit(1'000'000);
  EXPECT_EQ(window.admit(0), Admission::kTooOld);
  EXPECT_EQ(window.admit(1), Admission::kInOrder);
  EXPECT_EQ(window.admit(2), Admission::kInOrder);
  EXPECT_EQ(window.missing(), 0U);
}

// Rule: a restarted source may use its numbers again.
TEST(SequenceWindow, AfterRestartTheSameNumbersAreNew) {
  SequenceWindow window;
  window.admit(1);
  window.admit(4);
  window.restart();
  EXPECT_EQ(window.missing(), 0U);
  EXPECT_EQ(window.admit(1), Admission::kInOrder);
}

// ---------------------------------------------------------------------------------------
// temperatures

PendingTemperature reading(std::size_t probe, double time_s, double temperature_degc = 20.0) {
  return {probe, from_seconds(time_s), temperature_degc, true};
}

// Rule: over all probes readings come out in time order, ties in order of probe, none early.
TEST(TemperatureQueueLaws, ReadingsOfAllProbesComeOutInTimeOrder) {
  Random random(7);
  TemperatureQueue queue(3, 64);
  std::vector<double> clock(3, 0.0);
  for (std::size_t each = 0; each < 3; ++each) queue.push(reading(each, 0.0));
  std::size_t pushed = 3, popped = 0;
  SensorTime last{0};
  std::optional<std::size_t> last_probe;
  for (int i = 0; i < 5000; ++i) {
    const std::size_t probe = random.below(3);
    clock[probe] += 0.5 * static_cast<double>(1 + random.below(4));  // a coarse grid makes ties
    ASSERT_TRUE(queue.push(reading(probe, clock[probe])));
    ++pushed;
    const double until_s = std::min({clock[0], clock[1], clock[2]}) - 0.25;
    ASSERT_TRUE(queue.complete_to(from_seconds(until_s)));
    while (const auto next = queue.pop_until(from_seconds(until_s))) {
      ++popped;
      ASSERT_LE(next->time, from_seconds(until_s));
      ASSERT_TRUE(next->time > last ||
                  (next->time == last && (!last_probe || next->probe > *last_probe)));
      last = next->time;
      last_probe = next->probe;
    }
    if (i % 100 == 99) {  // bring the three together so that none fills its queue
      const double furthest = std::max({clock[0], clock[1], clock[2]});
      clock.assign(3, furthest + 1.0);
      for (std::size_t each = 0; each < 3; ++each) queue.push(reading(each, clock[each]));
      pushed += 3;
    }
  }
  EXPECT_GT(popped, pushed / 2);
}

// Rule: complete up to t means every probe has spoken beyond t, not just up to it.
TEST(TemperatureQueue, IsCompleteOnlyOnceEveryProbeHasSpokenBeyond) {
  TemperatureQueue queue(2, 8);
  EXPECT_FALSE(queue.complete_to(from_seconds(0.0)));
  queue.push(reading(0, 1.0));
  EXPECT_FALSE(queue.complete_to(from_seconds(0.5)));
  queue.push(reading(1, 2.0));
  EXPECT_TRUE(queue.complete_to(from_seconds(0.5)));
  EXPECT_FALSE(queue.complete_to(from_seconds(1.0)));  // probe 0 may stamp another 1.0
}

// Rule: "nothing was measured" still moves a probe's time forward.
TEST(TemperatureQueue, AReadingThatMeasuredNothingStillCompletes) {
  TemperatureQueue queue(1, 8);
  PendingTemperature blank = reading(0, 3.0);
  blank.measured = false;
  queue.push(blank);
  EXPECT_TRUE(queue.complete_to(from_seconds(2.0)));
}

// Rule: a silent probe is given up; when it speaks again it is waited for again.
TEST(TemperatureQueue, AProbeGivenUpIsWaitedForAgainOnceItSpeaks) {
  TemperatureQueue queue(2, 8);
  queue.push(reading(0, 10.0));
  queue.push(reading(1, 1.0));
  EXPECT_FALSE(queue.complete_to(from_seconds(5.0)));
  queue.give_up_waiting(from_seconds(5.0));
  EXPECT_TRUE(queue.complete_to(from_seconds(5.0)));
  EXPECT_FALSE(queue.complete_to(from_seconds(10.0)));  // probe 0 was not given up
  queue.push(reading(1, 6.0));
  EXPECT_FALSE(queue.complete_to(from_seconds(7.0)));
  EXPECT_TRUE(queue.complete_to(from_seconds(5.5)));
}

// Rule: nothing more is awaited of a probe that ended, and what it said before is given out; who
// measures it next begins anew, at any time.
TEST(TemperatureQueue, AnEndedProbeHoldsNothingUpAndBeginsAnew) {
  TemperatureQueue queue(2, 8);
  queue.push(reading(0, 100.0));
  queue.push(reading(1, 1.0));
  queue.push(reading(1, 2.0));
  queue.end(1);
  EXPECT_TRUE(queue.complete_to(from_seconds(99.0)));
  EXPECT_EQ(queue.pop_until(from_seconds(99.0))->time, from_seconds(1.0));
  queue.push(reading(1, 0.5));
  EXPECT_FALSE(queue.complete_to(from_seconds(0.5)));
  EXPECT_EQ(queue.pop_until(from_seconds(99.0))->time, from_seconds(0.5));
  EXPECT_FALSE(queue.pop_until(from_seconds(99.0))) << "what the one before said is void";
}

// Rule: where the rates begin anew, only what publishers that left had said is dropped: the others
// may have spoken of the new run before its first rate came.
TEST(TemperatureQueue, ARestartKeepsWhatThoseSaidWhoHaveNotLeft) {
  TemperatureQueue queue(2, 8);
  queue.push(reading(0, 600.0));
  queue.push(reading(1, 600.0));
  queue.end(0);
  queue.end(1);
  queue.push(reading(0, 0.0));
  queue.push(reading(0, 1.0));
  queue.restart_ended();
  EXPECT_FALSE(queue.complete_to(from_seconds(0.0))) << "probe 1 has not spoken in the new run";
  queue.push(reading(1, 1.0));
  EXPECT_TRUE(queue.complete_to(from_seconds(0.5)));
  EXPECT_EQ(queue.pop_until(from_seconds(0.5))->time, from_seconds(0.0));
}

// Rule: a full queue drops the oldest reading and says so.
TEST(TemperatureQueue, WhenFullTheOldestReadingIsDroppedAndReported) {
  TemperatureQueue queue(1, 2);
  EXPECT_TRUE(queue.push(reading(0, 1.0)));
  EXPECT_TRUE(queue.push(reading(0, 2.0)));
  EXPECT_FALSE(queue.push(reading(0, 3.0)));
  EXPECT_EQ(queue.pop_until(from_seconds(9.0))->time, from_seconds(2.0));
}

// Rule: one wild stamp far ahead neither holds up the readings behind it nor ends the waiting.
TEST(TemperatureQueueAbuse, AWildStampAheadIsForgottenAfterTwoGoodReadings) {
  for (const SensorTime wild : {from_seconds(1e6), SensorTime::max()}) {
    TemperatureQueue queue(1, 16);
    queue.push({0, wild, 20.0, true});
    queue.push(reading(0, 1.0, 21.0));
    queue.push(reading(0, 2.0, 22.0));
    const auto popped = queue.pop_until(from_seconds(1.5));
    ASSERT_TRUE(popped);
    EXPECT_EQ(popped->temperature_degc, 21.0);
    EXPECT_TRUE(queue.complete_to(from_seconds(1.5)));
    EXPECT_FALSE(queue.complete_to(from_seconds(2.0)));
  }
}

// Rule: one wild stamp behind doesn't start the waiting anew nor cost a good reading.
TEST(TemperatureQueueAbuse, AWildStampBehindChangesNothing) {
  TemperatureQueue queue(1, 16);
  queue.push(reading(0, 1000.0));
  queue.push(reading(0, 1001.0));
  queue.push({0, SensorTime::min(), 20.0, true});
  EXPECT_TRUE(queue.complete_to(from_seconds(1000.5)));
  EXPECT_EQ(queue.pop_until(from_seconds(1000.5))->time, from_seconds(1000.0));
}

// -----------------------------------------------------------------------------------------
// references

core::RateReferenceSample reference(double time_s, double rate_radps,
                                    core::ReferenceKind kind = core::ReferenceKind::kRecord) {
  core::RateReferenceSample sample;
  sample.time = from_seconds(time_s);
  sample.rate_radps = {rate_radps, rate_radps, rate_radps};
  sample.valid = {true, true, true};
  sample.kind = kind;
  return sample;
}

// Rule: the newest reference at or before a sample counts, as long as it is young enough.
TEST(ReferenceQueue, GivesTheNewestAtOrBeforeASampleUnlessTooOld) {
  ReferenceQueue queue(16);
  const SensorTime age = from_seconds(1.0);
  EXPECT_EQ(queue.at(from_seconds(1.0), age), nullptr);
  queue.push(reference(1.0, 0.1));
  queue.push(reference(1.5, 0.2));
  queue.push(reference(2.0, 0.3));
  EXPECT_EQ(queue.at(from_seconds(0.9), age), nullptr);
  EXPECT_EQ(queue.at(from_seconds(1.0), age)->rate_radps[0], 0.1);
  EXPECT_EQ(queue.at(from_seconds(1.99), age)->rate_radps[0], 0.2);
  EXPECT_EQ(queue.at(from_seconds(3.0), age)->rate_radps[0], 0.3);
  EXPECT_EQ(queue.at(from_seconds(3.0) + SensorTime{1}, age), nullptr);
}

// Rule: a record's reference is waited for, also at the very stamp; others never are.
TEST(ReferenceQueue, OnlyARecordsReferenceIsWaitedFor) {
  ReferenceQueue queue(16);
  EXPECT_TRUE(queue.complete_to(from_seconds(100.0)));
  queue.push(reference(1.0, 0.0, core::ReferenceKind::kRateTable));
  EXPECT_TRUE(queue.complete_to(from_seconds(100.0)));
  queue.push(reference(2.0, 0.0));
  EXPECT_TRUE(queue.complete_to(from_seconds(2.0)));
  EXPECT_FALSE(queue.complete_to(from_seconds(2.0) + SensorTime{1}));
  queue.give_up_waiting();
  EXPECT_TRUE(queue.complete_to(from_seconds(100.0)));
}

// Rule: as with temperatures: one whose publisher left isn't awaited, and begins anew; a restart
// keeps what a publisher that has not left said.
TEST(ReferenceQueue, AnEndedOneHoldsNothingUpAndARestartKeepsTheOthers) {
  const SensorTime age = from_seconds(1.0);
  ReferenceQueue queue(16);
  queue.push(reference(600.0, 0.1));
  EXPECT_NE(queue.at(from_seconds(600.0), age), nullptr);
  queue.end();
  EXPECT_TRUE(queue.complete_to(from_seconds(700.0)));
  queue.push(reference(0.0, 0.2));
  queue.restart_ended();
  EXPECT_FALSE(queue.complete_to(from_seconds(1.0)));
  ASSERT_NE(queue.at(from_seconds(0.5), age), nullptr);
  EXPECT_EQ(queue.at(from_seconds(0.5), age)->rate_radps[0], 0.2);
  queue.end();
  queue.restart_ended();
  EXPECT_TRUE(queue.complete_to(from_seconds(1.0)));
  EXPECT_EQ(queue.at(from_seconds(0.5), age), nullptr);
}

// Rule: a reference that comes late never replaces a newer one.
TEST(ReferenceQueueAbuse, ALateReferenceDoesNotReplaceANewerOne) {
  ReferenceQueue queue(16);
  queue.push(reference(2.0, 0.2));
  queue.push(reference(1.5, 0.1));
  EXPECT_EQ(queue.at(from_seconds(2.1), from_seconds(1.0))->rate_radps[0], 0.2);
}

// Rule: hostile stamps are never taken for fresh references and never hold up good ones for good.
TEST(ReferenceQueueAbuse, WildStampsAreNeitherFreshNorInTheWay) {
  ReferenceQueue queue(16);
  core::RateReferenceSample oldest = reference(0.0, 9.0);
  oldest.time = SensorTime::min();
  queue.push(oldest);
  EXPECT_EQ(queue.at(from_seconds(5.0), from_seconds(1.0)), nullptr);
  queue.push(reference(1e7, 9.0));
  queue.push(reference(6.0, 0.1));
  queue.push(reference(7.0, 0.2));
  const auto* found = queue.at(from_seconds(7.5), from_seconds(1.0));
  ASSERT_NE(found, nullptr);
  EXPECT_EQ(found->rate_radps[0], 0.2);
  EXPECT_FALSE(queue.complete_to(from_seconds(7.5)));
}

}  // namespace
}  // namespace zerodrift::compensation
