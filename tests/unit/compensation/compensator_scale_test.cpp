// SPDX-License-Identifier: Apache-2.0
// The compensator with the scale factor learned: what is left in motion, what it states of it, and
// that the drift is learned as without.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "tests/unit/compensation/synthetic_gyro.h"

namespace zerodrift::compensation {
namespace {

constexpr double kDegS = core::kRadPerDeg;

// 30 s of rest every five minutes, else bends about z of up to 10 deg/s.
double stop_and_go(double time_s, Axis axis) {
  const double phase = std::fmod(time_s, 300.0);
  if (axis != Axis::kZ || phase < 30.0) return 0.0;
  return 10.0 * kDegS * std::sin(2.0 * std::numbers::pi * (phase - 30.0) / 45.0);
}

GyroSpec drive(std::uint64_t seed) {
  GyroSpec spec;
  spec.duration_s = 5400.0;
  spec.low_degc = 10.0;
  spec.high_degc = 35.0;
  spec.scale_error = 300e-6;
  spec.scale_error_per_degc = 5e-6;
  spec.motion = stop_and_go;
  spec.seed = seed;
  return spec;
}

Record referenced(const GyroSpec& spec, core::ReferenceKind kind) {
  Record record = testing::make_record(spec);
  testing::add_true_rates(record, kind);
  return record;
}

CompensationOptions options(bool learns_scale) {
  CompensationOptions options = testing::options();
  options.learning.label_interval_s = 5.0;
  options.learning.scale_factor = learns_scale;
  return options;
}

struct Left {
  double in_motion_deg_h = 0.0;      // rms of output less truth less noise, about z
  double within_three_sigmas = 0.0;  // share
  core::PerAxis<std::optional<ScaleFactorState>> states{};
  double temperature_degc = 0.0;
};

Left left_after(double begin_s, const Record& record, bool learns_scale) {
  Compensator compensator{options(learns_scale)};
  double squares = 0.0, within = 0.0, n = 0.0;
  std::size_t k = 0;
  testing::run(compensator, record, [&](const core::CompensatedSample& answer) {
    const std::size_t z = index(Axis::kZ);
    const double error = answer.rate_radps[z] - record.true_radps[k][z] - record.noise_radps[k][z];
    const bool moves = std::abs(record.true_radps[k][z]) > kDegS;
    ++k;
    if (core::seconds(answer.raw.time) < begin_s || !moves) return;
    squares += error * error;
    within += error * error <= 9.0 * answer.drift_variance[z] ? 1.0 : 0.0;
    n += 1.0;
  });
  Left left{std::sqrt(squares / n) / kDegH, within / n};
  for (const auto axis : core::kAxes) left.states[index(axis)] = compensator.scale_factor(axis);
  left.temperature_degc = compensator.temperature_degc();
  return left;
}

// Rule: of 300 ppm and 5 ppm/°C at up to 10 deg/s, 7 deg/h rms, less than a tenth is left after
// half an hour, which the stated variance holds; axes that never turn learn nothing.
TEST(CompensatorScale, InMotionATenthOfTheErrorIsLeftAndStated) {
  for (const auto kind : {core::ReferenceKind::kRateTable, core::ReferenceKind::kRecord}) {
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      const GyroSpec spec = drive(seed);
      const Record record = referenced(spec, kind);
      const Left with = left_after(1800.0, record, true);
      const Left without = left_after(1800.0, record, false);
      std::printf("seed %d: in motion %.3f deg/h with, %.3f without; within 3 sigmas %.3f, %.3f\n",
                  static_cast<int>(seed), with.in_motion_deg_h, without.in_motion_deg_h,
                  with.within_three_sigmas, without.within_three_sigmas);
      EXPECT_LT(with.in_motion_deg_h, 0.1 * without.in_motion_deg_h);
      EXPECT_GT(with.within_three_sigmas, 0.95);
      const ScaleFactorState z = with.states[2].value();
      const double truth = 300e-6 + 5e-6 * (with.temperature_degc - 25.0);
      EXPECT_NEAR(z.error, truth, 4.0 * z.sigma);
      EXPECT_NEAR(z.per_degc, 5e-6, 4.0 * z.per_degc_sigma);
      EXPECT_FALSE(with.states[0]->is_known);
      EXPECT_FALSE(without.states[2].has_value());
    }
  }
}

// Rule: at rest, where the true rate is nothing, labels are the same to the bit, and so is what is
// taken off and its variance; in motion the variance is more.
TEST(CompensatorScale, TheDriftIsLearnedAsWithout) {
  const Record record = referenced(drive(4), core::ReferenceKind::kRecord);
  std::vector<core::CompensatedSample> answers[2];
  std::vector<Label> labels[2];
  for (const bool learns_scale : {false, true}) {
    Compensator compensator{options(learns_scale)};
    testing::run(compensator, record, [&](const core::CompensatedSample& answer) {
      answers[learns_scale].push_back(answer);
      if (const Label* label = compensator.confirmed_label())
        labels[learns_scale].push_back(*label);
    });
  }
  ASSERT_EQ(labels[0].size(), labels[1].size());
  for (std::size_t i = 0; i < labels[0].size(); ++i)
    EXPECT_EQ(labels[0][i].drift_radps, labels[1][i].drift_radps);
  ASSERT_EQ(answers[0].size(), answers[1].size());
  std::size_t moving = 0;
  for (std::size_t k = answers[0].size() / 2; k < answers[0].size(); ++k) {
    const auto& a = answers[0][k];
    const auto& b = answers[1][k];
    ASSERT_EQ(b.rate_radps[2], b.raw.rate_radps[2] - b.applied_drift_radps[2]);
    ASSERT_EQ(a.applied_drift_radps[0], b.applied_drift_radps[0]);
    ASSERT_EQ(a.mode, b.mode);
    if (std::abs(record.true_radps[k][2]) < kDegS) continue;
    ++moving;
    ASSERT_GT(b.drift_variance[2], a.drift_variance[2]);
  }
  EXPECT_GT(moving, 1000U);
}

// Rule: a slow turn against a reference is learned from as drift; with the scale factor known, what
// it adds to the turn is no part of the label: 1 % of .05 deg/s would be 1.8 deg/h.
TEST(CompensatorScale, OfASlowTurnTheScaleFactorsPartIsNoDrift) {
  GyroSpec spec = drive(5);
  spec.scale_error = 8000e-6;
  spec.scale_error_per_degc = 0.0;
  spec.motion = [](double time_s, Axis axis) {
    if (time_s < 3600.0) return stop_and_go(time_s, axis);
    return axis == Axis::kZ ? 0.05 * kDegS : 0.0;
  };
  const Record record = referenced(spec, core::ReferenceKind::kRecord);
  Compensator compensator{options(true)};
  std::size_t labels = 0;
  testing::run(compensator, record, [&](const core::CompensatedSample&) {
    const Label* label = compensator.confirmed_label();
    if (label == nullptr || core::seconds(label->begin) < 3700.0) return;
    ++labels;
    const double time_s = 0.5 * (core::seconds(label->begin) + core::seconds(label->end));
    // A label's noise is .056 / sqrt(5) deg/h, 5 sigmas of it, and what is left of 8000 ppm.
    ASSERT_NEAR(label->drift_radps[2] / kDegH, testing::drift_deg_h(spec, time_s, Axis::kZ), 0.15);
  });
  EXPECT_GT(labels, 100U);
}

// Rule: references of a record that come three samples after their rates, and a learner that works
// only when it is waited for, change no bit.
TEST(CompensatorScale, OrderOfArrivalAndLearnerTimingChangeNoBit) {
  GyroSpec spec = drive(7);
  spec.duration_s = 1500.0;
  const Record record = referenced(spec, core::ReferenceKind::kRecord);
  Compensator usual{options(true)}, late{options(true)};
  const auto expected = testing::run(usual, record);
  std::vector<core::CompensatedSample> answers;
  const auto take = [&](const core::CompensatedSample& answer) { answers.push_back(answer); };
  std::size_t t = 0;
  late.push(record.references.front());
  for (std::size_t k = 0; k < record.rates.size(); ++k) {
    for (; t < record.temperatures.size() && record.temperatures[t].time <= record.rates[k].time;
         ++t)
      late.push(record.temperatures[t]);
    late.push(record.rates[k]);
    if (k > 3) late.push(record.references[k - 3]);
    testing::answer_ready(late, testing::LearnerTiming::kOnlyWhenAwaited, take);
  }
  ASSERT_GT(usual.scale_factor(Axis::kZ)->windows, 10U);
  ASSERT_GT(answers.size() + 100, expected.size());  // the last wait for what doesn't come
  for (std::size_t k = 0; k < answers.size(); ++k) {
    ASSERT_EQ(answers[k].rate_radps, expected[k].rate_radps) << k;
    ASSERT_EQ(answers[k].drift_variance, expected[k].drift_variance) << k;
  }
}

// Rule: a reference a tenth of a second late moves the output in motion no more than without the
// scale factor, and is told as refused.
TEST(CompensatorScale, ALateReferenceChangesNothing) {
  const GyroSpec spec = drive(6);
  Record record = referenced(spec, core::ReferenceKind::kRateTable);
  for (std::size_t k = record.rates.size(); k-- > 2;)
    record.references[k].rate_radps = record.references[k - 2].rate_radps;
  const Left with = left_after(0.0, record, true);
  const Left without = left_after(0.0, record, false);
  EXPECT_EQ(with.in_motion_deg_h, without.in_motion_deg_h);
  EXPECT_GT(with.states[2]->refused, 10U);
}

}  // namespace
}  // namespace zerodrift::compensation
