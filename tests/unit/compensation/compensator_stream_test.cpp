// SPDX-License-Identifier: Apache-2.0
// One raw sample, one answer; and equal bits whatever the order of arrival.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <limits>
#include <map>

#include "tests/unit/compensation/synthetic_gyro.h"

namespace zerodrift::compensation {
namespace {

using testing::answer_ready;
using testing::LearnerTiming;

// Everything that decides what goes out, as bits.
std::vector<std::uint64_t> bits(const core::CompensatedSample& answer) {
  std::vector<std::uint64_t> words{answer.raw.sequence, answer.late ? 1U : 0U, answer.model_epoch};
  for (std::size_t i = 0; i < core::kAxisCount; ++i) {
    for (const double value : {answer.rate_radps[i], answer.applied_drift_radps[i],
                               answer.drift_variance[i], answer.sensor_variance[i]}) {
      words.push_back(std::bit_cast<std::uint64_t>(value));
    }
    words.push_back(static_cast<std::uint64_t>(answer.mode[i]));
    words.push_back(static_cast<std::uint64_t>(answer.reason[i]));
    words.push_back(static_cast<std::uint64_t>(answer.rung[i]));
  }
  return words;
}

// Five minutes of ramp with a turn that the record's reference knows of.
Record record_with_references() {
  GyroSpec spec;
  spec.duration_s = 300.0;
  spec.low_degc = 20.0;
  spec.high_degc = 30.0;
  spec.motion = testing::turn(150.0, 10.0, 0.05 * core::kRadPerDeg);
  Record record = make_record(spec);
  testing::add_true_rates(record);
  return record;
}

// Merges the three streams, each in its own order, with each one ahead by a random run of messages.
std::vector<core::CompensatedSample> run_interleaved(const Record& record, std::uint64_t seed,
                                                     LearnerTiming timing) {
  Compensator compensator{testing::options()};
  Random random(seed);
  std::vector<core::CompensatedSample> answers;
  const auto take = [&](const core::CompensatedSample& answer) { answers.push_back(answer); };
  std::size_t k = 0, t = 0, r = 0;
  // A record's reference comes with every sample, so the stream is there from the beginning.
  compensator.push(record.references[r++]);
  while (k < record.rates.size() || t < record.temperatures.size() ||
         r < record.references.size()) {
    const std::size_t stream = random.below(3);
    // Rates and references stay within the 4096 waiting places of each other.
    std::size_t burst = 1 + random.below(stream == 1 ? 60 : 400);
    for (; burst > 0; --burst) {
      if (stream == 0 && k < record.rates.size() && k < r + 3000)
        compensator.push(record.rates[k++]);
      if (stream == 1 && t < record.temperatures.size()) compensator.push(record.temperatures[t++]);
      if (stream == 2 && r < record.references.size() && r < k + 3000)
        compensator.push(record.references[r++]);
      if (random.below(4) == 0) answer_ready(compensator, timing, take);
    }
    if (k > answers.size() + 3500) {  // the temperatures are far behind: let them catch up
      const auto behind = record.rates[answers.size()].time + from_seconds(2.0);
      for (; t < record.temperatures.size() && record.temperatures[t].time < behind; ++t) {
        compensator.push(record.temperatures[t]);
      }
      answer_ready(compensator, timing, take);
    }
  }
  answer_ready(compensator, timing, take);
  EXPECT_EQ(compensator.counts().late_models, 0U);
  EXPECT_EQ(compensator.readiness(), Readiness::kNothing);
  return answers;
}

// Rule: as long as readiness() is respected, the output is equal to the bit whatever stream came
// first, and whether the learner works at once or only when its model is awaited.
TEST(CompensatorLaws, ArrivalOrderAndLearnerTimingNeverChangeABit) {
  const Record record = record_with_references();
  const auto first = run_interleaved(record, 1, LearnerTiming::kAtOnce);
  ASSERT_EQ(first.size(), record.rates.size());
  ASSERT_GT(first.back().model_epoch, 10U);  // models took part
  for (const std::uint64_t seed : {1U, 2U, 3U, 4U, 5U}) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const auto other = run_interleaved(record, seed, LearnerTiming::kOnlyWhenAwaited);
    ASSERT_EQ(other.size(), first.size());
    for (std::size_t k = 0; k < first.size(); ++k)
      ASSERT_EQ(bits(other[k]), bits(first[k])) << "sample " << k;
  }
}

// Rule: models that fall due together take effect in the same samples whenever they were learned.
// A handover of 30 s keeps up to three in flight; a data gap of 50 s makes them due at once.
TEST(CompensatorLaws, ModelsDueTogetherTakeEffectAlikeWheneverTheyWereLearned) {
  GyroSpec spec;
  spec.duration_s = 400.0;
  spec.low_degc = 20.0;
  spec.high_degc = 30.0;
  Record record = make_record(spec);
  std::erase_if(record.rates, [](const auto& s) {
    return s.time > from_seconds(203.0) && s.time < from_seconds(253.0);
  });
  CompensationOptions options = testing::options();
  options.learning.handover_s = 30.0;
  Compensator at_once{options}, awaited{options};
  const auto a = testing::run(at_once, record, LearnerTiming::kAtOnce);
  const auto b = testing::run(awaited, record, LearnerTiming::kOnlyWhenAwaited);
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t k = 0; k < a.size(); ++k) ASSERT_EQ(bits(a[k]), bits(b[k])) << "sample " << k;
  EXPECT_GT(a.back().model_epoch, 5U);
  EXPECT_EQ(awaited.counts().late_models, 0U);
}

// Rule: an axis that a gyro never measured is no fault; one that it had is, and so is a sample
// without any axis, or with one that is said to be measured and is no number.
TEST(Compensator, ASampleWithoutAnAxisThatWasNeverMeasuredIsNotCountedAsInvalid) {
  GyroSpec spec;
  spec.duration_s = 10.0;
  Record record = make_record(spec);
  core::PerAxis<std::uint64_t> of_axes{};
  const auto invalid = [&] {
    Compensator compensator{testing::options()};
    (void)testing::run(compensator, record);
    of_axes = compensator.counts().invalid_axes;
    return compensator.counts().invalid;
  };
  for (auto& sample : record.rates) sample.valid = {true, false, false};
  EXPECT_EQ(invalid(), 0U);
  record.rates[100].valid = {};
  EXPECT_EQ(invalid(), 1U);
  record.rates[10].valid[1] = true;
  EXPECT_EQ(invalid(), record.rates.size() - 11U);
  EXPECT_EQ(of_axes, (core::PerAxis<std::uint64_t>{1, record.rates.size() - 11U, 0}));
  for (auto& sample : record.rates) sample.valid = {};
  EXPECT_EQ(invalid(), record.rates.size());
  for (auto& sample : record.rates) {
    sample.valid = {true, true, false};
    sample.rate_radps[1] = std::numeric_limits<double>::quiet_NaN();
  }
  EXPECT_EQ(invalid(), record.rates.size());
  EXPECT_EQ(of_axes, (core::PerAxis<std::uint64_t>{0, record.rates.size(), 0}));
}

// Rule: a due model is waited for; whoever goes on without it is counted, and the model takes
// effect as soon as it is there.
TEST(Compensator, AnsweringWithoutADueModelIsCounted) {
  GyroSpec spec;
  spec.duration_s = 60.0;
  Compensator compensator{testing::options()};
  const Record record = make_record(spec);
  for (const auto& reading : record.temperatures) compensator.push(reading);
  bool awaited = false;
  core::CompensatedSample last;
  for (const auto& sample : record.rates) {
    compensator.push(sample);
    awaited = awaited || compensator.readiness() == Readiness::kAwaitsModel;
    last = compensator.answer_next();
  }
  EXPECT_TRUE(awaited);
  EXPECT_EQ(last.model_epoch, 0U);
  EXPECT_GE(compensator.counts().late_models, 1U);
  ASSERT_TRUE(compensator.learner().run_one());
  core::AngularRateSample next = record.rates.back();
  ++next.sequence;
  next.time += from_seconds(0.05);
  compensator.push(next);
  EXPECT_EQ(compensator.answer_next().model_epoch, 1U);
}

// Rule: every admitted sample has exactly one answer, its own, and nothing else has any: for random
// late, duplicated and lost samples, temperatures and references.
TEST(CompensatorLaws, EveryAdmittedSampleHasExactlyOneAnswer) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(seed);
    Record record = record_with_references();
    std::vector<core::AngularRateSample> arrivals;
    std::map<std::uint64_t, double> sent;  // sequence -> raw x rate
    for (const auto& sample : record.rates) {
      if (random.below(50) == 0) continue;  // lost
      arrivals.push_back(sample);
      sent[sample.sequence] = sample.rate_radps[0];
      if (random.below(20) == 0) arrivals.push_back(sample);  // twice
    }
    for (std::size_t i = 0; i + 40 < arrivals.size(); i += 7) {  // swaps: some come late
      if (random.below(3) == 0) std::swap(arrivals[i], arrivals[i + random.below(40)]);
    }
    Compensator compensator{testing::options()};
    std::map<std::uint64_t, int> answered;
    const auto take = [&](const core::CompensatedSample& answer) {
      ++answered[answer.raw.sequence];
      ASSERT_EQ(answer.raw.rate_radps[0], sent.at(answer.raw.sequence));
      ASSERT_EQ(answer.rate_radps[0], answer.raw.rate_radps[0] - answer.applied_drift_radps[0]);
    };
    std::size_t t = 0, r = 0;
    for (const auto& sample : arrivals) {
      compensator.push(sample);
      while (t < record.temperatures.size() && random.below(2) == 0)
        compensator.push(record.temperatures[t++]);
      if (r < record.references.size()) compensator.push(record.references[r++]);
      if (random.below(3) == 0) answer_ready(compensator, LearnerTiming::kOnlyWhenAwaited, take);
      // Now and then nobody waits for what is missing.
      if (random.below(200) == 0) compensator.give_up_waiting();
      if (random.below(500) == 0 && compensator.readiness() != Readiness::kNothing)
        take(compensator.answer_next());
    }
    while (compensator.readiness() != Readiness::kNothing) take(compensator.answer_next());
    EXPECT_EQ(answered.size(), sent.size());
    for (const auto& [sequence, times] : answered) ASSERT_EQ(times, 1) << sequence;
    const CompensatorCounts counts = compensator.counts();
    EXPECT_EQ(counts.samples_in, arrivals.size());
    EXPECT_EQ(counts.samples_out, sent.size());
    EXPECT_EQ(counts.duplicates, arrivals.size() - sent.size());
    EXPECT_EQ(counts.too_old, 0U);
    EXPECT_GT(counts.late, 0U);
    const std::uint64_t last = std::max(sent.rbegin()->first, std::uint64_t{1});
    std::uint64_t after_first = 0;  // what came before the first arrival was never missed
    for (const auto& [sequence, rate] : sent)
      after_first += sequence >= arrivals.front().sequence ? 1U : 0U;
    EXPECT_EQ(counts.missing, last - arrivals.front().sequence + 1 - after_first);
  }
}

// Rule: a full queue refuses and counts nothing as seen: the same sample is taken once there is
// room.
TEST(Compensator, AFullQueueRefusesTheSampleAndTakesItOnceThereIsRoom) {
  Compensator compensator{testing::options()};
  core::AngularRateSample sample;
  sample.valid = {true, true, true};
  sample.interval_s = 0.01;
  Admission admission = Admission::kInOrder;
  while (admission == Admission::kInOrder) {
    ++sample.sequence;
    sample.time = from_seconds(0.01 * static_cast<double>(sample.sequence));
    admission = compensator.push(sample);
  }
  ASSERT_EQ(admission, Admission::kQueueFull);
  EXPECT_EQ(compensator.answer_next().raw.sequence, 1U);
  EXPECT_EQ(compensator.push(sample), Admission::kInOrder);
}

// Rule: a late sample is answered with the drift in force, marked late, and moves nothing: those
// after it are as without it, to the bit.
TEST(CompensatorLaws, ALateSampleChangesNoLaterAnswer) {
  GyroSpec spec;
  spec.duration_s = 120.0;
  const Record record = make_record(spec);
  Record reordered = record;
  std::rotate(reordered.rates.begin() + 1000, reordered.rates.begin() + 1001,
              reordered.rates.begin() + 1006);
  Record without = record;
  without.rates.erase(without.rates.begin() + 1000);
  Compensator a{testing::options()}, b{testing::options()};
  auto late = testing::run(a, reordered);
  const auto never = testing::run(b, without);
  ASSERT_EQ(late.size(), record.rates.size());
  ASSERT_TRUE(late[1005].late);
  EXPECT_EQ(late[1005].applied_drift_radps, late[1004].applied_drift_radps);
  late.erase(late.begin() + 1005);
  for (std::size_t k = 0; k < never.size(); ++k) ASSERT_EQ(bits(late[k]), bits(never[k])) << k;
}

// Rule: after restart_stream numbers and time may begin anew; what was learned still compensates.
TEST(CompensatorScenarios, AfterASourceRestartTheModelStillCompensates) {
  GyroSpec spec;
  spec.duration_s = 600.0;
  spec.high_degc = 30.0;
  Compensator compensator{testing::options()};
  const Record record = make_record(spec);
  const auto before = testing::run(compensator, record);
  ASSERT_EQ(before.back().rung[0], core::Rung::kStack);
  const auto counts_before = compensator.counts();
  compensator.restart_stream();
  EXPECT_EQ(compensator.counts().missing, 0U);
  // The source anew: the same clock and numbers, from their beginning, at 20 °C.
  spec.seed = 2;
  const Record again = make_record(spec);
  const auto after = testing::run(compensator, again);
  ASSERT_EQ(after.size(), again.rates.size());
  const auto counts_after = compensator.counts();
  EXPECT_EQ(counts_after.duplicates, counts_before.duplicates);
  EXPECT_EQ(counts_after.time_faults, counts_before.time_faults);
  EXPECT_GT(counts_after.labels, counts_before.labels + 30);
  EXPECT_GE(after.back().model_epoch, before.back().model_epoch + 30);
  // The temperature rate has its window again after 30 s. The first whole label after that ends at
  // 50 s, is confirmed at 55 s and in force at 56 s: then the model knows the new level, which was
  // held until then.
  for (std::size_t k = 0; k < after.size(); ++k) {
    if (again.rates[k].time < from_seconds(60.0)) continue;
    ASSERT_EQ(after[k].rung[0], core::Rung::kStack) << k;
  }
}

// Rule: of the publishers of a second run the one of temperatures may be heard before or after the
// one of rates, and be gone again before the first rate: no bit depends on it.
TEST(CompensatorLaws, WhatComesBeforeTheFirstRateOfASecondRunCounts) {
  GyroSpec spec;
  spec.duration_s = 200.0;
  const Record record = make_record(spec);
  const auto end_all = [](Compensator& compensator) {
    for (std::size_t p = 0; p < compensator.probes().size(); ++p) compensator.end_temperature(p);
  };
  const std::size_t all = record.temperatures.size();
  const auto second_run = [&](std::size_t early) {
    Compensator compensator{testing::options()};
    testing::run(compensator, record);
    end_all(compensator);
    Record rest = record;
    for (std::size_t t = 0; t < early; ++t) compensator.push(record.temperatures[t]);
    rest.temperatures.erase(rest.temperatures.begin(),
                            rest.temperatures.begin() + static_cast<std::ptrdiff_t>(early));
    if (early == all) end_all(compensator);
    compensator.restart_stream();
    auto answers = testing::run(compensator, rest);
    // The third run waits for its temperatures again.
    compensator.restart_stream();
    compensator.push(record.rates.front());
    if (early == all) {
      EXPECT_EQ(compensator.readiness(), Readiness::kAwaitsTemperature);
    }
    return answers;
  };
  const auto late = second_run(0);
  for (const std::size_t early : {std::size_t{1}, std::size_t{10}, all}) {
    const auto answers = second_run(early);
    ASSERT_EQ(answers.size(), late.size()) << early;
    for (std::size_t k = 0; k < late.size(); ++k)
      ASSERT_EQ(bits(answers[k]), bits(late[k])) << early << " of " << all << ", sample " << k;
  }
}

// Rule: a probe that no publisher has is not waited for, in whatever order that becomes known.
TEST(CompensatorLaws, AProbeThatIsNotPublishedIsNotWaitedFor) {
  const std::string probe = testing::options().probes().at(0);
  for (const auto& [published, readiness] :
       {std::pair<std::string, Readiness>{"", Readiness::kReady},
        {probe + "_inner,x", Readiness::kReady},
        {probe, Readiness::kAwaitsTemperature},
        {"x," + probe, Readiness::kAwaitsTemperature},
        {probe + ",x", Readiness::kAwaitsTemperature}}) {
    GyroSpec spec;
    spec.duration_s = 1.0;
    Compensator compensator{testing::options()};
    compensator.push(make_record(spec).rates.front());
    EXPECT_EQ(compensator.readiness(), Readiness::kAwaitsTemperature);
    compensator.limit_probes(published);
    EXPECT_EQ(compensator.readiness(), readiness) << published;
  }
}

// Rule: samples that wait across a restart are still answered, and move nothing of the new stream.
TEST(CompensatorAbuse, SamplesThatWaitAcrossARestartAreAnsweredAndMoveNothing) {
  Compensator compensator{testing::options()};
  GyroSpec spec;
  spec.duration_s = 120.0;
  const Record record = make_record(spec);
  for (std::size_t k = 2200; k < 2300; ++k) compensator.push(record.rates[k]);
  compensator.restart_stream();
  std::size_t answered = 0;
  while (compensator.readiness() != Readiness::kNothing) {
    EXPECT_TRUE(compensator.answer_next().late);
    ++answered;
  }
  EXPECT_EQ(answered, 100U);
  const auto after = testing::run(compensator, record);
  EXPECT_EQ(after.size(), record.rates.size());
  EXPECT_EQ(compensator.counts().time_faults, 0U);
  EXPECT_GT(compensator.counts().labels, 5U);
}

// Rule: a record slower than a sample a minute is a stream like any other; its steps are no faults.
TEST(Compensator, ARecordOfTwoMinuteMeansIsFollowedAndCompensated) {
  Compensator compensator{testing::options()};
  core::CompensatedSample last;
  for (std::uint64_t k = 0; k < 200; ++k) {
    core::AngularRateSample sample;
    sample.sequence = k;
    sample.time = core::SensorTime{std::chrono::seconds(120 * k)};
    sample.interval_s = 120.0;
    sample.rate_radps.fill(1e-5 + (k % 2 == 0 ? 1e-9 : -1e-9));
    sample.valid.fill(true);
    sample.clock = core::ClockSource::kReplay;
    ASSERT_EQ(compensator.push(sample), Admission::kInOrder);
    compensator.learner().run_one();
    last = compensator.answer_next();
  }
  EXPECT_EQ(compensator.counts().time_faults, 0U);
  EXPECT_EQ(last.mode[0], core::Mode::kFallback);
  EXPECT_NEAR(last.applied_drift_radps[0], 1e-5, 1e-8);  // ten times the alternation
}

}  // namespace
}  // namespace zerodrift::compensation
