// SPDX-License-Identifier: Apache-2.0
// Bad input never poisons what comes after it: one bad message of each kind, at the start and in
// mid-record, and two minutes later the drift is known as if nothing had been.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "tests/unit/compensation/synthetic_gyro.h"

namespace zerodrift::compensation {
namespace {

using core::SensorTime;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct BadInput {
  const char* name;
  std::function<void(Record&, std::size_t sample)> spoil;
};

void each_axis(core::AngularRateSample& sample, double rate_radps) {
  sample.rate_radps = {rate_radps, rate_radps, rate_radps};
}

core::TemperatureSample& reading_near(Record& record, std::size_t sample) {
  for (auto& reading : record.temperatures) {
    if (reading.time >= record.rates[sample].time) return reading;
  }
  return record.temperatures.back();
}

core::RateReferenceSample& reference_near(Record& record, std::size_t sample) {
  return record.references[sample];
}

std::vector<BadInput> bad_inputs() {
  return {
      {"rate_nan", [](Record& r, std::size_t k) { each_axis(r.rates[k], kNan); }},
      {"rate_nan_for_20_s",
       [](Record& r, std::size_t k) {
         for (std::size_t i = k; i < k + 400; ++i) each_axis(r.rates[i], kNan);
       }},
      {"rate_infinite", [](Record& r, std::size_t k) { each_axis(r.rates[k], -kInfinity); }},
      {"rate_huge", [](Record& r, std::size_t k) { each_axis(r.rates[k], 1e300); }},
      {"rate_invalid",
       [](Record& r, std::size_t k) {
         r.rates[k].valid = {};
         each_axis(r.rates[k], 5.0);
       }},
      {"rate_clipped",
       [](Record& r, std::size_t k) {
         r.rates[k].clipped = {true, true, true};
         each_axis(r.rates[k], 8.7);
       }},
      {"interval_nan", [](Record& r, std::size_t k) { r.rates[k].interval_s = kNan; }},
      {"interval_huge", [](Record& r, std::size_t k) { r.rates[k].interval_s = 1e18; }},
      {"time_far_ahead", [](Record& r, std::size_t k) { r.rates[k].time += from_seconds(1e8); }},
      {"time_largest", [](Record& r, std::size_t k) { r.rates[k].time = SensorTime::max(); }},
      {"time_smallest", [](Record& r, std::size_t k) { r.rates[k].time = SensorTime::min(); }},
      {"time_an_hour_back",
       [](Record& r, std::size_t k) { r.rates[k].time -= from_seconds(3600.0); }},
      {"time_repeated", [](Record& r, std::size_t k) { r.rates[k + 1].time = r.rates[k].time; }},
      {"time_a_second_back",
       [](Record& r, std::size_t k) { r.rates[k].time -= from_seconds(1.0); }},
      {"temperature_nan",
       [](Record& r, std::size_t k) { reading_near(r, k).temperature_degc = kNan; }},
      {"temperature_infinite",
       [](Record& r, std::size_t k) { reading_near(r, k).temperature_degc = kInfinity; }},
      {"temperature_of_a_broken_wire",
       [](Record& r, std::size_t k) { reading_near(r, k).temperature_degc = 850.0; }},
      {"temperature_not_measured",
       [](Record& r, std::size_t k) { reading_near(r, k).measured = false; }},
      {"temperature_far_ahead",
       [](Record& r, std::size_t k) { reading_near(r, k).time += from_seconds(1e8); }},
      {"temperature_time_largest",
       [](Record& r, std::size_t k) { reading_near(r, k).time = SensorTime::max(); }},
      {"temperature_time_smallest",
       [](Record& r, std::size_t k) { reading_near(r, k).time = SensorTime::min(); }},
      {"temperature_of_an_unknown_probe",
       [](Record& r, std::size_t k) { reading_near(r, k).probe = "nowhere"; }},
      {"reference_nan",
       [](Record& r, std::size_t k) {
         reference_near(r, k).rate_radps = {kNan, kNan, kNan};
       }},
      {"reference_huge",
       [](Record& r, std::size_t k) {
         reference_near(r, k).rate_radps = {1e300, -1e300, kInfinity};
       }},
      {"reference_far_ahead",
       [](Record& r, std::size_t k) { reference_near(r, k).time += from_seconds(1e8); }},
      {"reference_time_smallest",
       [](Record& r, std::size_t k) { reference_near(r, k).time = SensorTime::min(); }},
  };
}

Record record_with_references() {
  GyroSpec spec;
  spec.duration_s = 400.0;
  Record record = make_record(spec);
  for (std::size_t k = 0; k < record.rates.size(); ++k) {
    core::RateReferenceSample reference;
    reference.time = record.rates[k].time;
    reference.valid = {true, true, true};
    reference.kind = core::ReferenceKind::kRecord;
    record.references.push_back(reference);
  }
  return record;
}

// Feeds index by index, as the streams arrive whatever their stamps say, and answers at once.
std::vector<core::CompensatedSample> run_as_it_arrives(Compensator& compensator,
                                                       const Record& record) {
  std::vector<core::CompensatedSample> answers;
  const auto take = [&](const core::CompensatedSample& answer) { answers.push_back(answer); };
  for (std::size_t k = 0; k < record.rates.size(); ++k) {
    const std::size_t second = k / 20;
    if (k % 20 == 0 && second < record.temperatures.size())
      compensator.push(record.temperatures[second]);
    if (k < record.references.size()) compensator.push(record.references[k]);
    compensator.push(record.rates[k]);
    while (compensator.learner().run_one()) {
    }
    while (compensator.readiness() != Readiness::kNothing) take(compensator.answer_next());
  }
  return answers;
}

class OneBadMessage : public ::testing::TestWithParam<std::size_t> {};

// Rule: every sample is answered, what is answered is finite wherever the raw rate is, and two
// minutes after the bad message the drift is known again: a label of 10 s has sigma 0.018 deg/h,
// 5 sigma of it are 0.09 deg/h; nothing of the bad value may remain.
TEST_P(OneBadMessage, PoisonsNothing) {
  const BadInput bad = bad_inputs()[GetParam()];
  for (const double at_s : {0.0, 4.5, 200.3}) {
    SCOPED_TRACE(std::string(bad.name) + " at " + std::to_string(at_s) + " s");
    Record record = record_with_references();
    bad.spoil(record, static_cast<std::size_t>(std::llround(at_s * 20.0)));
    Compensator compensator{testing::options()};
    const auto answers = run_as_it_arrives(compensator, record);
    ASSERT_EQ(answers.size(), record.rates.size());
    for (std::size_t k = 0; k < answers.size(); ++k) {
      for (const auto axis : kAxes) {
        const std::size_t i = index(axis);
        ASSERT_TRUE(std::isfinite(answers[k].applied_drift_radps[i])) << k;
        ASSERT_TRUE(std::isfinite(answers[k].drift_variance[i])) << k;
        ASSERT_TRUE(std::isfinite(answers[k].sensor_variance[i])) << k;
        const bool is_measured = answers[k].raw.valid[i];
        ASSERT_EQ(answers[k].reason[i] == core::Reason::kInvalidInput, !is_measured) << k;
        ASSERT_TRUE(!is_measured || std::abs(answers[k].raw.rate_radps[i]) < 1e3) << k;
        if (static_cast<double>(k) / 20.0 < at_s + 120.0) continue;
        ASSERT_NE(answers[k].rung[i], core::Rung::kNone) << k;
        ASSERT_NEAR(answers[k].applied_drift_radps[i], record.drift_radps[k][i], 0.09 * kDegH) << k;
      }
    }
    // 38 labels fit into 400 s; the worst costs 20 s without data, ten initial blocks and two
    // labels.
    EXPECT_GE(compensator.counts().labels, 33U);
  }
}

INSTANTIATE_TEST_SUITE_P(All, OneBadMessage, ::testing::Range(std::size_t{0}, bad_inputs().size()),
                         [](const auto& parameter) {
                           return std::string(bad_inputs()[parameter.param].name);
                         });

// Rule: a clock that was set, forward or back, is believed with its second sample; numbers go on.
TEST(CompensatorAbuse, AClockThatWasSetIsBelievedWithItsSecondSample) {
  for (const double step_s : {1e6, -1e6}) {
    SCOPED_TRACE(step_s);
    Record record = record_with_references();
    const SensorTime step = from_seconds(step_s);
    for (std::size_t k = 4000; k < record.rates.size(); ++k) record.rates[k].time += step;
    for (std::size_t k = 4000; k < record.references.size(); ++k) record.references[k].time += step;
    for (std::size_t t = 200; t < record.temperatures.size(); ++t)
      record.temperatures[t].time += step;
    Compensator compensator{testing::options()};
    const auto answers = run_as_it_arrives(compensator, record);
    ASSERT_EQ(answers.size(), record.rates.size());
    EXPECT_EQ(compensator.counts().time_faults, 1U);
    EXPECT_TRUE(answers[4000].late);
    EXPECT_FALSE(answers[4001].late);
    EXPECT_GT(compensator.counts().labels, 32U);  // 39 fit without the step; it costs two or three
    for (const auto axis : kAxes) {
      EXPECT_NEAR(answers.back().applied_drift_radps[index(axis)],
                  record.drift_radps.back()[index(axis)], 0.09 * kDegH);
    }
  }
}

// Rule: a saturated axis says nothing of its drift: nothing is learned while it lasts.
TEST(CompensatorAbuse, NothingIsLearnedWhileAnAxisIsSaturated) {
  Record record = record_with_references();
  record.references.clear();
  for (std::size_t k = 2000; k < 4000; ++k) record.rates[k].clipped[1] = true;
  Compensator compensator{testing::options()};
  std::uint64_t labels_before = 0, labels_after = 0;
  std::size_t k = 0;
  testing::run(compensator, record, [&](const core::CompensatedSample&) {
    ++k;
    if (k == 2021) labels_before = compensator.counts().labels;
    if (k == 4000 + 15 * 20) labels_after = compensator.counts().labels;
  });
  EXPECT_GT(labels_before, 0U);
  EXPECT_EQ(labels_after, labels_before);
  EXPECT_GT(compensator.counts().labels, labels_after);
}

}  // namespace
}  // namespace zerodrift::compensation
