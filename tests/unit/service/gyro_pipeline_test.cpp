// SPDX-License-Identifier: Apache-2.0
#include "common/service/gyro_pipeline.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <vector>

#include "tests/simulation/hash_engine.h"

namespace zerodrift::service {
namespace {

using simulation::HashAnswer;
using simulation::HashEngine;
using Pipeline = GyroPipeline<HashEngine>;

constexpr std::int64_t kMs = 1'000'000;
constexpr std::uint64_t kRun = 11;

core::AngularRateSample rate(std::uint64_t sequence) {
  core::AngularRateSample sample;
  sample.sequence = sequence;
  sample.time = core::SensorTime{static_cast<std::int64_t>(sequence) * 5 * kMs};
  sample.clock = core::ClockSource::kHardware;
  return sample;
}
core::TemperatureSample temperature(std::uint64_t sequence, std::uint64_t at) {
  core::TemperatureSample sample;
  sample.sequence = sequence;
  sample.time = core::SensorTime{static_cast<std::int64_t>(at) * 5 * kMs};
  return sample;
}

// An instance: its pipeline, and all that it wrote.
class Instance final : Pipeline::Port {
 public:
  explicit Instance(std::uint32_t number, bool has_output_of_one = false)
      : has_output_of_one_(has_output_of_one),
        number_(number),
        pipeline(std::make_unique<HashEngine>(), InstanceSync(number), *this) {}

  void sample(std::uint64_t sequence, std::uint64_t run = kRun) {
    now_ns += 5 * kMs;
    pipeline.push(rate(sequence), run, 0, now_ns);
  }
  // At the same moment as what came before.
  void sample_at_once(std::uint64_t sequence, std::uint64_t run = kRun) {
    pipeline.push(rate(sequence), run, 0, now_ns);
  }
  // Of a replay, which is faster than its own time.
  void paced_sample(std::uint64_t sequence) {
    core::AngularRateSample sample = rate(sequence);
    sample.clock = core::ClockSource::kReplay;
    pipeline.push(sample, kRun, 0, now_ns += kMs / 100);
  }
  void receive(const AnswerMark& other) { pipeline.receive(other); }
  // From `first` until it is the only one in sync.
  std::uint64_t begin(std::uint64_t first = 1) {
    while (written.empty()) sample(first++);
    return first;
  }
  // As the node does: the state of another, and the log.
  bool catch_up(const Instance& giver) {
    const std::uint64_t sequence = giver.pipeline.newest_sequence();
    auto fresh = std::make_unique<HashEngine>(giver.pipeline.engine());
    return go_on(fresh, giver.pipeline.run(), sequence);
  }
  bool go_on(std::unique_ptr<HashEngine>& fresh, std::uint64_t run, std::uint64_t sequence) {
    if (!pipeline.continues(run, sequence)) return false;
    std::vector<HashAnswer> answers;
    for (const auto& input : pipeline.logged()) Pipeline::repeat(*fresh, input, sequence, answers);
    pipeline.go_on_with(fresh, sequence, answers, now_ns);
    return true;
  }

  AnswerMark prepare(const HashAnswer& answer, std::uint64_t run,
                     std::uint32_t answered) noexcept override {
    return prepared_ = {number_, answered, run, answer.raw.sequence, answer.digest};
  }
  void write_prepared(bool leads) noexcept override {
    written.push_back(prepared_);
    if (leads) write_prepared_alone();
  }
  void write_prepared_alone() noexcept override { alone.push_back(prepared_.sequence); }
  [[nodiscard]] bool has_output_of_one() const noexcept override { return has_output_of_one_; }
  [[nodiscard]] bool can_write() const noexcept override { return open; }
  bool is_open() override { return open; }
  void begin_run() override { ++runs_begun; }
  bool await_model() override { return false; }
  void report_progress(std::uint64_t newest, core::SensorTime) override { reported = newest; }
  void notify_learner() override {}

  bool open = true;
  int runs_begun = 0;  // after the first
  std::uint64_t reported = 0;
  std::int64_t now_ns = 0;
  std::vector<AnswerMark> written{};
  std::vector<std::uint64_t> alone{};

 private:
  bool has_output_of_one_;
  std::uint32_t number_;
  AnswerMark prepared_{};

 public:
  Pipeline pipeline;
};

TEST(GyroPipeline, TheOnlyOneOfSeveralLosesNothingThatItHeldBack) {
  Instance only(0);
  const std::uint64_t next = only.begin();
  ASSERT_EQ(only.written.size(), next - 1);
  for (std::size_t k = 0; k < only.written.size(); ++k) EXPECT_EQ(only.written[k].sequence, k + 1);
}

// Rule: a run that is over before anybody is known to be the only one is written all the same.
TEST(GyroPipeline, AShortRunOfTheOnlyOneIsWrittenByTheTick) {
  Instance only(0);
  for (std::uint64_t k = 1; k <= 50; ++k) only.sample(k);
  EXPECT_TRUE(only.written.empty());
  for (int k = 0; k < 12; ++k) only.pipeline.tick(only.now_ns += 250 * kMs);
  EXPECT_EQ(only.written.size(), 50U);
}

// Rule: a replay waits until it is known who writes, and so loses none of what is held back,
// however many samples come before that.
TEST(GyroPipeline, AReplayWaitsWhereMoreThanIsHeldBackWouldBeLost) {
  Instance only(0);
  constexpr std::uint64_t kSamples = 10000;
  for (std::uint64_t k = 1; k <= kSamples; ++k) only.paced_sample(k);
  EXPECT_TRUE(only.written.empty());
  for (int k = 0; k < 12; ++k) {
    only.pipeline.drain(only.now_ns);
    only.pipeline.tick(only.now_ns += 250 * kMs);
  }
  ASSERT_EQ(only.written.size(), kSamples);
  for (std::uint64_t k = 0; k < kSamples; ++k) ASSERT_EQ(only.written[k].sequence, k + 1);
  EXPECT_EQ(only.pipeline.dropped(), 0U);
}

// Rule: what a state knows need not be answered, and a replay doesn't wait for it.
TEST(GyroPipeline, AReplayGoesOnFromTheStateThatIsTakenOver) {
  Instance giver(0);
  Instance taker(1);
  std::uint64_t next = giver.begin();
  taker.sample(next);
  taker.receive(giver.written.back());
  EXPECT_FALSE(taker.pipeline.state_to_ask_for(taker.now_ns)) << "the log begins first";
  taker.open = false;  // as where it waits for a temperature
  const std::uint64_t end = next + 200;
  for (; next < end; ++next) {
    giver.paced_sample(next);
    taker.paced_sample(next);
  }
  ASSERT_TRUE(taker.catch_up(giver));
  taker.pipeline.report_progress();
  EXPECT_EQ(taker.reported, end - 1);
}

// Rule: it doesn't wait where another one answers what it holds back.
TEST(GyroPipeline, AReplayGoesOnWhereAnotherWrites) {
  Instance leader(0);
  Instance behind(1);
  std::uint64_t next = leader.begin();
  for (; next < 10000; ++next) {
    leader.paced_sample(next);
    behind.paced_sample(next);
    behind.receive(leader.written.back());
  }
  EXPECT_EQ(behind.pipeline.newest_sequence(), next - 1);
  EXPECT_EQ(behind.pipeline.dropped(), 0U);
}

TEST(GyroPipeline, OneThatCatchesUpGoesOnToTheBitAndReachesBackToTheState) {
  Instance giver(0);
  Instance taker(1);
  std::uint64_t next = giver.begin();
  const auto step = [&] {
    giver.sample(next);
    taker.sample(next);
    taker.receive(giver.written.back());
    ++next;
  };
  for (int k = 0; k < 10; ++k) step();
  EXPECT_FALSE(taker.pipeline.state_to_ask_for(taker.now_ns)) << "the log begins first";
  for (int k = 0; k < 10; ++k) step();
  EXPECT_EQ(taker.pipeline.state_to_ask_for(taker.now_ns), 0U);
  EXPECT_FALSE(taker.pipeline.state_to_ask_for(taker.now_ns)) << "not again at once";
  const std::uint64_t cut = next - 1;
  auto state = std::make_unique<HashEngine>(giver.pipeline.engine());
  for (int k = 0; k < 30; ++k) step();
  ASSERT_TRUE(taker.written.empty());
  ASSERT_TRUE(taker.go_on(state, kRun, cut));
  ASSERT_EQ(taker.written.size(), 30U) << "all since the state";
  for (int k = 0; k < 30; ++k) step();
  for (std::size_t k = 0; k < taker.written.size(); ++k) {
    const AnswerMark& mine = taker.written[taker.written.size() - 1 - k];
    const AnswerMark& other = giver.written[giver.written.size() - 1 - k];
    EXPECT_EQ(mine.sequence, other.sequence);
    EXPECT_EQ(mine.digest, other.digest);
  }
}

// Rule: what only one that is behind has answered is not lost with its line. Here the other one
// died, and began anew a hundred samples later.
TEST(GyroPipeline, WhatNobodyElseAnsweredIsWrittenBeforeItGoesOnFromAStateThatBeganLater) {
  Instance first(0);
  Instance survivor(1);
  const std::uint64_t held_from = first.begin();
  std::uint64_t next = held_from;
  std::vector<std::uint64_t> digests;
  const auto answer = [&] {
    survivor.sample(next++);
    digests.push_back(survivor.pipeline.newest().digest);
  };
  for (int k = 0; k < 10; ++k) {
    first.sample(next);
    answer();
    survivor.receive(first.written.back());
  }
  EXPECT_FALSE(survivor.pipeline.state_to_ask_for(survivor.now_ns)) << "the log begins first";
  for (int k = 0; k < 100; ++k) answer();
  Instance anew(0);
  const std::uint64_t began_at = next;
  next = anew.begin(began_at);
  for (std::uint64_t k = began_at; k < next; ++k) survivor.sample_at_once(k);
  for (const AnswerMark& mark : anew.written) survivor.receive(mark);
  ASSERT_TRUE(survivor.written.empty());
  ASSERT_TRUE(survivor.catch_up(anew));
  ASSERT_EQ(survivor.written.size(), digests.size()) << "anew has written the others";
  for (std::size_t k = 0; k < digests.size(); ++k) {
    EXPECT_EQ(survivor.written[k].sequence, held_from + k);
    EXPECT_EQ(survivor.written[k].digest, digests[k]);
  }
  anew.sample(next);
  survivor.sample(next);
  EXPECT_EQ(survivor.written.back().digest, anew.written.back().digest);
}

// Rule: one wild number keeps nobody from catching up in the rest of the run.
TEST(GyroPipeline, AStateAfterAWildNumberIsOneToGoOnFrom) {
  Instance giver(0);
  Instance taker(1);
  std::uint64_t next = giver.begin();
  giver.sample(1'000'000'000'000);
  const auto step = [&] {
    giver.sample(next);
    taker.sample(next++);
    taker.receive(giver.written.back());
  };
  step();
  EXPECT_EQ(giver.pipeline.newest_sequence(), next - 1);
  EXPECT_FALSE(taker.pipeline.state_to_ask_for(taker.now_ns)) << "the log begins first";
  for (int k = 0; k < 10; ++k) step();
  ASSERT_TRUE(taker.catch_up(giver));
  step();
  EXPECT_EQ(taker.written.back().digest, giver.written.back().digest);
}

TEST(GyroPipeline, AStateThatTheLogDoesNotReachIsRefused) {
  Instance giver(0);
  Instance taker(1);
  std::uint64_t next = giver.begin();
  const AnswerMark first = giver.written.back();
  for (int k = 0; k < 10; ++k) giver.sample(next++);
  taker.sample(next);
  taker.receive(first);
  EXPECT_FALSE(taker.pipeline.state_to_ask_for(taker.now_ns));
  EXPECT_FALSE(taker.catch_up(giver)) << "the log is empty";
  taker.sample(next + 1);
  EXPECT_FALSE(taker.catch_up(giver)) << "the log begins behind the state";
  giver.sample(next);
  giver.sample(next + 1);
  EXPECT_TRUE(taker.catch_up(giver));
}

TEST(GyroPipeline, AStateOfAnotherPublishersRunIsRefused) {
  Instance giver(0);
  Instance taker(1);
  const std::uint64_t next = giver.begin();
  taker.sample(next, 77);
  AnswerMark mark = giver.written.back();
  mark.run = 77;
  taker.receive(mark);
  EXPECT_FALSE(taker.pipeline.state_to_ask_for(taker.now_ns));
  taker.sample(next + 1, 77);
  giver.sample(next);
  EXPECT_FALSE(taker.catch_up(giver));
}

// Rule: with two publishers of one id, one that is behind follows the one that those in sync
// follow, whichever it heard first.
TEST(GyroPipeline, OneThatIsBehindFollowsThePublisherOfThoseInSync) {
  Instance giver(0);
  Instance taker(1);
  std::uint64_t next = giver.begin();
  for (int k = 0; k < 100; ++k) {
    taker.sample(next, 22);
    giver.sample(next);
    taker.receive(giver.written.back());
    taker.sample(next, kRun);
    giver.sample(next, 22);
    ++next;
    if (k == 50) {
      EXPECT_FALSE(taker.pipeline.state_to_ask_for(taker.now_ns));
    }
  }
  EXPECT_EQ(taker.pipeline.run(), kRun);
  EXPECT_GT(taker.pipeline.rejected(), 90U);
  EXPECT_GT(giver.pipeline.rejected(), 90U);
  EXPECT_TRUE(taker.catch_up(giver));
  for (const AnswerMark& mark : taker.written)
    EXPECT_EQ(mark.run, kRun) << "what it answered of the other one is nobody's";
}

TEST(GyroPipeline, APublisherThatIsGoneIsReplacedAtOnceAndASilentOneAfterASecond) {
  Instance instance(0);
  std::uint64_t next = instance.begin();
  instance.sample(1, 22);
  instance.pipeline.publisher_gone(22, instance.now_ns);
  EXPECT_EQ(instance.pipeline.run(), kRun) << "another one is gone";
  instance.sample(next++);
  EXPECT_EQ(instance.pipeline.rejected(), 1U) << "the one that is followed goes on";
  instance.pipeline.publisher_gone(kRun, instance.now_ns);
  instance.sample(next++);
  EXPECT_EQ(instance.pipeline.run(), kRun) << "what it wrote last was on its way";
  instance.sample(1, 22);
  EXPECT_EQ(instance.pipeline.run(), 22U);
  instance.now_ns += 1000 * kMs;
  instance.sample(1, 33);
  EXPECT_EQ(instance.written.back().run, 33U);
  EXPECT_EQ(instance.runs_begun, 2) << "who is waited for is asked anew";
  EXPECT_EQ(instance.pipeline.rejected(), 1U);
}

std::vector<std::uint64_t> written_of(const Instance& instance, std::uint64_t run) {
  std::vector<std::uint64_t> sequences;
  for (const AnswerMark& mark : instance.written) {
    if (mark.run == run) sequences.push_back(mark.sequence);
  }
  return sequences;
}

// Rule: whether an instance learns at once that a publisher is over, or late, or never: it begins
// the next run with its first sample, and so answers it as the others do.
TEST(GyroPipeline, ARunThatBeginsBeforeTheOneBeforeIsKnownToBeOverIsAnsweredFromItsFirstSample) {
  Instance at_once(0);
  Instance late(0);
  Instance never(0);
  Instance by_tick(0);
  const std::vector<Instance*> all{&at_once, &late, &never, &by_tick};
  for (Instance* instance : all) {
    instance->begin();
    if (instance == &at_once) instance->pipeline.publisher_gone(kRun, instance->now_ns);
    for (std::uint64_t k = 1; k <= 300; ++k) {
      if (instance == &by_tick && k == 151) instance->pipeline.tick(instance->now_ns += 1000 * kMs);
      if (instance == &by_tick && k > 150) break;
      instance->sample(k, 22);
      if (instance == &late && k == 40) {
        EXPECT_TRUE(written_of(late, 22).empty());
        late.pipeline.publisher_gone(kRun, late.now_ns);
        EXPECT_EQ(written_of(late, 22).size(), 40U);
      }
    }
    const auto sequences = written_of(*instance, 22);
    ASSERT_EQ(sequences.size(), instance == &by_tick ? 150U : 300U);
    for (std::size_t k = 0; k < sequences.size(); ++k) EXPECT_EQ(sequences[k], k + 1);
    EXPECT_EQ(instance->pipeline.rejected(), 0U);
  }
  for (const Instance* instance : {&late, &never})
    EXPECT_EQ(instance->written.back().digest, at_once.written.back().digest);
}

TEST(GyroPipeline, ARunThatIsOverBeforeItIsFollowedIsAnsweredAllTheSame) {
  Instance instance(0);
  instance.begin();
  for (std::uint64_t k = 1; k <= 10; ++k) instance.sample(k, 22);
  instance.pipeline.publisher_gone(22, instance.now_ns);
  for (std::uint64_t k = 1; k <= 10; ++k) instance.sample(k, 33);
  instance.pipeline.publisher_gone(kRun, instance.now_ns);
  EXPECT_EQ(written_of(instance, 22).size(), 10U);
  EXPECT_EQ(written_of(instance, 33).size(), 10U);
  EXPECT_EQ(instance.pipeline.rejected(), 0U);
}

// Rule: of two publishers that send at a time nothing is kept for long, and every sample that is
// not answered is counted.
TEST(GyroPipeline, OfARivalAllThatIsNotAnsweredIsCounted) {
  Instance instance(0);
  std::uint64_t next = instance.begin();
  std::uint64_t rivals = 0;
  for (int k = 0; k < 1000; ++k) {
    instance.sample(++rivals, 22);
    if (k % 3 == 0) instance.sample(next++);
  }
  EXPECT_EQ(instance.pipeline.run(), kRun);
  instance.pipeline.publisher_gone(kRun, instance.now_ns);
  const auto sequences = written_of(instance, 22);
  EXPECT_EQ(sequences.size() + instance.pipeline.rejected(), rivals);
  EXPECT_EQ(sequences.size(), 0U) << "since the newest of the one that was followed";
}

TEST(GyroPipeline, WhatWaitsIsBoundedAndTheOldestIsRefusedAndCounted) {
  Instance instance(0);
  instance.begin();
  for (std::uint64_t k = 1; k <= 5000; ++k) instance.sample_at_once(k, 22);
  instance.pipeline.publisher_gone(kRun, instance.now_ns);
  const auto sequences = written_of(instance, 22);
  ASSERT_FALSE(sequences.empty());
  EXPECT_EQ(sequences.back(), 5000U);
  EXPECT_EQ(sequences.size() + instance.pipeline.rejected(), 5000U);
}

// Rule: what one that fell behind has answered alone of a run that is over reaches the readers,
// if they know the run from it; here its senior died meanwhile, and began anew with the next run.
TEST(GyroPipeline, WhatItHeldBackOfARunThatItWroteIsWrittenBeforeItGoesOnWithTheNext) {
  Instance senior(0);
  Instance junior(1);
  std::uint64_t next = junior.begin();
  AnswerMark other = junior.written.back();
  other.instance = 0;
  for (int k = 0; k < 250; ++k) {  // its answers differ
    junior.sample(next);
    other.sequence = next++;
    junior.receive(other);
  }
  ASSERT_FALSE(junior.pipeline.sync().may_write());
  const std::uint64_t held_from = junior.written.back().sequence + 1;
  junior.pipeline.publisher_gone(kRun, junior.now_ns);
  std::uint64_t of_next = 1;
  while (senior.written.empty()) senior.sample(of_next++, 22);
  for (const AnswerMark& mark : senior.written) {
    junior.receive(mark);
    junior.sample(mark.sequence, 22);
  }
  const auto step = [&] {
    senior.sample(of_next, 22);
    junior.sample(of_next++, 22);
    junior.receive(senior.written.back());
  };
  step();
  ASSERT_FALSE(junior.pipeline.state_to_ask_for(junior.now_ns)) << "the log begins first";
  for (int k = 0; k < 10; ++k) step();
  ASSERT_TRUE(junior.catch_up(senior));
  const auto sequences = written_of(junior, kRun);
  ASSERT_EQ(sequences.back(), next - 1);
  EXPECT_EQ(std::count(sequences.begin(), sequences.end(), held_from), 1);
}

TEST(GyroPipeline, NothingIsAnsweredBeforeItCanBeWritten) {
  Instance instance(0);
  instance.open = false;
  for (std::uint64_t k = 1; k <= 1000; ++k) instance.sample(k);
  instance.pipeline.tick(instance.now_ns);
  EXPECT_TRUE(instance.written.empty());
  instance.open = true;
  instance.begin(1001);
  EXPECT_EQ(instance.written.front().sequence, 1U);
}

// Rule: what one instance writes goes on where the leader stopped being heard.
TEST(GyroPipeline, WhatOnlyOneWritesGoesOnAfterTheLeadersDeath) {
  Instance leader(0, true);
  Instance other(1, true);
  std::uint64_t next = leader.begin();
  const auto step = [&] {
    leader.sample(next);
    other.sample(next);
    other.receive(leader.written.back());
    ++next;
  };
  step();
  EXPECT_FALSE(other.pipeline.state_to_ask_for(other.now_ns));
  step();
  ASSERT_TRUE(other.catch_up(leader));
  for (int k = 0; k < 100; ++k) step();
  EXPECT_TRUE(other.alone.empty());
  const std::uint64_t dead_from = next;
  for (int k = 0; k < 100; ++k) other.sample(next++);
  ASSERT_EQ(other.alone.size(), 100U);
  for (std::size_t k = 0; k < 100; ++k) EXPECT_EQ(other.alone[k], dead_from + k);
}

TEST(GyroPipeline, TemperaturesThatTheStateKnowsAreNotRepeated) {
  Instance giver(0);
  Instance taker(1);
  std::uint64_t next = giver.begin();
  std::uint64_t readings = 0;
  const auto step = [&] {
    const auto reading = temperature(++readings, next);
    giver.pipeline.push(reading, giver.now_ns);
    taker.pipeline.push(reading, taker.now_ns);
    giver.sample(next);
    taker.sample(next);
    taker.receive(giver.written.back());
    ++next;
  };
  step();
  EXPECT_FALSE(taker.pipeline.state_to_ask_for(taker.now_ns));
  for (int k = 0; k < 50; ++k) step();
  ASSERT_TRUE(taker.catch_up(giver));
  for (int k = 0; k < 50; ++k) step();
  EXPECT_EQ(taker.written.back().digest, giver.written.back().digest);
}

}  // namespace
}  // namespace zerodrift::service
