// SPDX-License-Identifier: Apache-2.0
// What a navigation filter may do to the compensation, right or wrong.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "tests/unit/compensation/synthetic_gyro.h"

namespace zerodrift::compensation {
namespace {

using core::RateReferenceSample;
using core::ReferenceKind;

// ------------------------------------------------------------------------------------- screening

RateReferenceSample reference(ReferenceKind kind, double rate_deg_h, double sigma_deg_h) {
  RateReferenceSample sample;
  sample.kind = kind;
  sample.rate_radps.fill(rate_deg_h * kDegH);
  sample.variance.fill(sigma_deg_h * sigma_deg_h * kDegH * kDegH);
  sample.valid = {true, true, true};
  return sample;
}

ReferenceVerdict screened(RateReferenceSample sample, const ReferenceOptions& options = {}) {
  return screen(options, sample);
}

TEST(ReferenceScreen, EachRefusalHasItsReason) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  using V = ReferenceVerdict;
  EXPECT_EQ(screened(reference(ReferenceKind::kRest, 5.0, 0.1)), V::kTaken);
  EXPECT_EQ(screened(reference(ReferenceKind::kRecord, 5000.0, 0.0)), V::kTaken);
  EXPECT_EQ(screened(reference(ReferenceKind::kNone, 5.0, 0.1)), V::kUnknownKind);
  EXPECT_EQ(screened(reference(static_cast<ReferenceKind>(9), 5.0, 0.1)), V::kUnknownKind);
  EXPECT_EQ(screened(reference(ReferenceKind::kRest, 9.0, 0.1)), V::kMoreThanEarth);  // 15.6 in all
  EXPECT_EQ(screened(reference(ReferenceKind::kRest, 5.0, 1.1)), V::kUncertain);
  EXPECT_EQ(screened(reference(ReferenceKind::kRest, 5.0, nan)), V::kUncertain);
  EXPECT_EQ(screened(reference(ReferenceKind::kNavigationResidual, 1.0, 0.01)), V::kNotAccepted);
  const ReferenceOptions accepting{.navigation_residual = ReferencePolicy::kAccept};
  EXPECT_EQ(screened(reference(ReferenceKind::kNavigationResidual, 1.0, 0.01), accepting),
            V::kTaken);
  EXPECT_EQ(screened(reference(ReferenceKind::kNavigationResidual, 1.0, 0.4), accepting),
            V::kUncertain);
  const ReferenceOptions refusing{.truth = ReferencePolicy::kRefuse,
                                  .rest = ReferencePolicy::kRefuse};
  EXPECT_EQ(screened(reference(ReferenceKind::kRest, 5.0, 0.1), refusing), V::kNotAccepted);
  EXPECT_EQ(screened(reference(ReferenceKind::kRateTable, 5.0, 0.1), refusing), V::kNotAccepted);
  RateReferenceSample empty = reference(ReferenceKind::kRest, 5.0, 0.1);
  empty.valid = {};
  EXPECT_EQ(screened(empty), V::kEmpty);
  for (const core::SensorTime time : {core::kNever, core::SensorTime::max()}) {
    RateReferenceSample wild = reference(ReferenceKind::kRateTable, 5.0, 0.1);
    wild.time = time;
    EXPECT_EQ(screened(wild), V::kTimeUnusable);
  }
}

TEST(ReferenceScreen, WhatIsKeptHoldsNumbersOnly) {
  using Doubles = std::numeric_limits<double>;
  RateReferenceSample sample = reference(ReferenceKind::kRecord, 5.0, 0.1);
  sample.rate_radps[0] = Doubles::quiet_NaN();
  sample.variance[1] = Doubles::infinity();
  sample.variance[2] = Doubles::quiet_NaN();  // not known
  EXPECT_EQ(screen({}, sample), ReferenceVerdict::kTaken);
  EXPECT_EQ(sample.valid, (core::PerAxis<bool>{false, false, true}));
  EXPECT_EQ(sample.rate_radps, (core::PerAxis<double>{0.0, 0.0, 5.0 * kDegH}));
  EXPECT_EQ(sample.variance, (core::PerAxis<double>{}));
}

// ------------------------------------------------------------------------------- rest references

constexpr double kEarthZ = 10.0;  // deg/h in the rate of a gyro that stands

GyroSpec standing_in_earth_rate() {
  GyroSpec spec;
  spec.duration_s = 240.0;
  spec.motion = [](double, core::Axis axis) {
    return axis == core::Axis::kZ ? kEarthZ * kDegH : 0.0;
  };
  return spec;
}

CompensationOptions earth_unknown() {
  CompensationOptions options = testing::options();
  options.earth_rate.mode = EarthRateMode::kUnknown;
  return options;
}

// Ten a second, from the beginning on.
void add_rest_references(Record& record, const core::PerAxis<bool>& valid, double sigma_deg_h) {
  for (double t = 0.0; t < 300.0; t += 0.1) {
    RateReferenceSample rest = reference(ReferenceKind::kRest, 0.0, sigma_deg_h);
    rest.rate_radps[2] = kEarthZ * kDegH;
    rest.time = core::from_seconds(t);
    rest.valid = valid;
    record.references.push_back(rest);
  }
}

TEST(RestReference, LetsAGyroQuieterThanEarthRateLearnItsDriftWithoutEarthRate) {
  Record record = make_record(standing_in_earth_rate());
  add_rest_references(record, {true, true, true}, 0.01);
  Compensator compensator(earth_unknown());
  const auto answers = testing::run(compensator, record);
  EXPECT_GT(compensator.counts().labels, 10U);
  EXPECT_NEAR(answers.back().applied_drift_radps[2] / kDegH, record.drift_radps.back()[2] / kDegH,
              0.1);
}

// Rule: an axis whose Earth rate nobody knows is not learned, though others are.
TEST(RestReference, AnAxisItDoesNotSpeakOfIsNotLearned) {
  Record record = make_record(standing_in_earth_rate());
  add_rest_references(record, {false, false, true}, 0.01);
  Compensator compensator(earth_unknown());
  const auto answers = testing::run(compensator, record);
  EXPECT_EQ(answers.back().applied_drift_radps[0], 0.0);
  EXPECT_EQ(answers.back().reason[0], core::Reason::kEarthRateUnknown);
  EXPECT_NEAR(answers.back().applied_drift_radps[2] / kDegH, record.drift_radps.back()[2] / kDegH,
              0.1);
}

TEST(RestReference, WithoutOneOrWithAnUncertainOneNothingIsLearned) {
  for (const bool is_there : {false, true}) {
    Record record = make_record(standing_in_earth_rate());
    if (is_there) add_rest_references(record, {true, true, true}, 5.0);
    Compensator compensator(earth_unknown());
    const auto answers = testing::run(compensator, record);
    EXPECT_EQ(compensator.counts().labels, 0U);
    EXPECT_EQ(answers.back().applied_drift_radps[2], 0.0);
  }
}

// Rule: never two corrections of one thing.
TEST(RestReference, IsNotTakenOffWhereEarthRateCountsAsDrift) {
  Record plain = make_record(standing_in_earth_rate());
  Record referenced = plain;
  add_rest_references(referenced, {true, true, true}, 0.01);
  CompensationOptions options = testing::options();
  options.earth_rate.mode = EarthRateMode::kIncluded;
  Compensator without(options);
  Compensator with(options);
  const auto expected = testing::run(without, plain);
  const auto answers = testing::run(with, referenced);
  ASSERT_EQ(answers.size(), expected.size());
  for (std::size_t k = 0; k < answers.size(); ++k)
    ASSERT_EQ(answers[k].applied_drift_radps, expected[k].applied_drift_radps);
  EXPECT_GT(
      with.counts().references[static_cast<std::size_t>(ReferenceVerdict::kEarthRateIncluded)],
      1000U);
}

// Rule: who says "at rest" in a turn is not believed.
TEST(RestReference, DeclaredInATurnTeachesNothingOfIt) {
  GyroSpec spec = standing_in_earth_rate();
  spec.duration_s = 400.0;
  spec.motion = [](double t, core::Axis axis) {
    const double turn = t > 250.0 && t <= 320.0 ? 0.02 * core::kRadPerDeg : 0.0;  // 72 deg/h
    return axis == core::Axis::kZ ? kEarthZ * kDegH + turn : 0.0;
  };
  Record record = make_record(spec);
  add_rest_references(record, {true, true, true}, 0.01);
  Compensator compensator(earth_unknown());
  const auto answers = testing::run(compensator, record);
  for (std::size_t k = 5000; k < answers.size(); ++k) {
    ASSERT_NEAR(answers[k].applied_drift_radps[2] / kDegH, record.drift_radps[k][2] / kDegH, 0.3);
  }
}

// Rule: with `await_feedback` the order of arrival never matters: what a filter says late is waited
// for.
TEST(RestReferenceLaws, ArrivalOrderNeverChangesABit) {
  Record record = make_record(standing_in_earth_rate());
  add_rest_references(record, {true, true, true}, 0.01);
  CompensationOptions options = earth_unknown();
  options.reference.await_feedback = true;
  Compensator in_time(options);
  const auto expected = testing::run(in_time, record);
  Record late = record;
  Compensator behind(options);
  std::vector<core::CompensatedSample> answers;
  std::size_t t = 0;
  std::size_t r = 0;
  testing::Random random(4);
  for (const auto& sample : late.rates) {
    const auto lag = core::from_seconds(3.0 * random.uniform());
    for (; t < late.temperatures.size() && late.temperatures[t].time <= sample.time; ++t)
      behind.push(late.temperatures[t]);
    behind.push(sample);
    for (; r < late.references.size() && late.references[r].time <= sample.time - lag; ++r)
      behind.push(late.references[r]);
    if (t == late.temperatures.size()) behind.give_up_waiting();
    testing::answer_ready(
        behind, testing::LearnerTiming::kOnlyWhenAwaited,
        [&](const core::CompensatedSample& answer) { answers.push_back(answer); });
  }
  for (; t < late.temperatures.size(); ++t) behind.push(late.temperatures[t]);
  for (; r < late.references.size(); ++r) behind.push(late.references[r]);
  testing::answer_ready(behind, testing::LearnerTiming::kOnlyWhenAwaited,
                        [&](const core::CompensatedSample& answer) { answers.push_back(answer); });
  ASSERT_GT(answers.size(), 4700U);
  for (std::size_t k = 0; k < answers.size(); ++k) {
    ASSERT_EQ(answers[k].raw.sequence, expected[k].raw.sequence);
    ASSERT_EQ(answers[k].applied_drift_radps, expected[k].applied_drift_radps) << k;
    ASSERT_EQ(answers[k].drift_variance, expected[k].drift_variance) << k;
  }
}

// ------------------------------------------------------------------------------ residual feedback

// Five minutes at rest, then fifteen that never stand still, while the drift goes on.
GyroSpec long_drive() {
  GyroSpec spec;
  spec.duration_s = 1200.0;
  spec.low_degc = 20.0;
  spec.high_degc = 45.0;
  spec.motion = [](double t, core::Axis axis) {
    return t > 300.0 && axis == core::Axis::kZ ? 0.05 * std::sin(0.2 * t) + 0.01 : 0.0;
  };
  return spec;
}

CompensationOptions with_residuals() {
  CompensationOptions options = testing::options();
  options.reference.navigation_residual = ReferencePolicy::kAccept;
  return options;
}

struct Opinion {
  core::PerAxis<double> residual_radps{};
  double sigma_deg_h = 0.02;
  std::uint64_t epoch_offset = 0;
  double age_s = 0.0;  // the stamp is older by this
};
// What a filter says at a sample in motion; nothing: nothing.
using Filter =
    std::function<std::optional<Opinion>(const core::CompensatedSample& answer, std::size_t k)>;

struct Driven {
  std::vector<core::CompensatedSample> answers;
  CompensatorCounts counts;
};

Driven drive(const Record& record, const Filter& filter, const CompensationOptions& options) {
  Compensator compensator(options);
  Driven driven;
  testing::run(compensator, record, [&](const core::CompensatedSample& answer) {
    const std::size_t k = driven.answers.size();
    driven.answers.push_back(answer);
    if (!filter || k % 2 != 0 || core::seconds(answer.raw.time) < 310.0) return;
    const auto opinion = filter(answer, k);
    if (!opinion) return;
    RateReferenceSample residual =
        reference(ReferenceKind::kNavigationResidual, 0.0, opinion->sigma_deg_h);
    residual.time = answer.raw.time - core::from_seconds(opinion->age_s);
    residual.model_epoch = answer.model_epoch + opinion->epoch_offset;
    for (std::size_t i = 0; i < 3; ++i)
      residual.rate_radps[i] = answer.applied_drift_radps[i] + opinion->residual_radps[i];
    compensator.push(residual);
  });
  driven.counts = compensator.counts();
  return driven;
}

double largest_difference_deg_h(const Driven& a, const Driven& b) {
  double largest = 0.0;
  for (std::size_t k = 0; k < a.answers.size(); ++k) {
    for (std::size_t i = 0; i < 3; ++i) {
      largest = std::max(largest, std::abs(a.answers[k].applied_drift_radps[i] -
                                           b.answers[k].applied_drift_radps[i]));
    }
  }
  return largest / kDegH;
}

double rms_error_deg_h(const Driven& driven, const Record& record) {
  double sum = 0.0;
  std::size_t n = 0;
  for (std::size_t k = 6400; k < driven.answers.size(); ++k) {  // from 320 s on
    for (std::size_t i = 0; i < 3; ++i) {
      const double error = driven.answers[k].applied_drift_radps[i] - record.drift_radps[k][i];
      sum += error * error;
      ++n;
    }
  }
  return std::sqrt(sum / static_cast<double>(n)) / kDegH;
}

std::uint64_t count_of(const Driven& driven, ReferenceVerdict verdict) {
  return driven.counts.references[static_cast<std::size_t>(verdict)];
}

class Feedback : public ::testing::Test {
 protected:
  const Record record = make_record(long_drive());
  const Driven without = drive(record, {}, testing::options());

  // Rule: nothing is learned from a residual; all it moves is the applied drift, within the bound.
  void expect_bounded(const Driven& with) const {
    ASSERT_EQ(with.answers.size(), without.answers.size());
    for (std::size_t k = 0; k < with.answers.size(); ++k) {
      ASSERT_EQ(with.answers[k].model_epoch, without.answers[k].model_epoch);
      ASSERT_EQ(with.answers[k].drift_variance, without.answers[k].drift_variance);
    }
    EXPECT_EQ(with.counts.labels, without.counts.labels);
    EXPECT_LE(largest_difference_deg_h(with, without), 0.5 + 1e-9);
  }
  // Says in motion what is truly left, otherwise as in `given`, and as `change` changes it.
  [[nodiscard]] Driven drive_with(
      const Opinion& given, const CompensationOptions& options = with_residuals(),
      const std::function<void(double& residual_radps, double time_s)>& change = {}) const {
    return drive(
        record,
        [&](const core::CompensatedSample& answer, std::size_t k) {
          Opinion opinion = given;
          opinion.residual_radps = truly_left(answer, k);
          for (double& residual : opinion.residual_radps) {
            if (change) change(residual, core::seconds(answer.raw.time));
          }
          return opinion;
        },
        options);
  }
  [[nodiscard]] core::PerAxis<double> truly_left(const core::CompensatedSample& answer,
                                                 std::size_t k) const {
    core::PerAxis<double> left{};
    for (std::size_t i = 0; i < 3; ++i)
      left[i] = record.drift_radps[k][i] - answer.applied_drift_radps[i];
    return left;
  }
};

TEST_F(Feedback, ByDefaultIsRefusedAndChangesNoBit) {
  const Driven with = drive_with({}, testing::options());
  EXPECT_EQ(largest_difference_deg_h(with, without), 0.0);
  EXPECT_GT(count_of(with, ReferenceVerdict::kNotAccepted), 8000U);
}

TEST_F(Feedback, AcceptedButSilentChangesNoBit) {
  EXPECT_EQ(largest_difference_deg_h(drive(record, {}, with_residuals()), without), 0.0);
}

TEST_F(Feedback, OfARightFilterImproves) {
  const Driven with = drive_with({});
  expect_bounded(with);
  const double before = rms_error_deg_h(without, record);
  const double after = rms_error_deg_h(with, record);
  std::printf("right filter: rms error in motion %.4f deg/h without, %.4f with\n", before, after);
  EXPECT_LT(after, 0.7 * before);
}

TEST_F(Feedback, WithAConstantErrorOfFiveDegPerHourIsRefusedAtOnce) {
  const Driven with = drive_with({.sigma_deg_h = 0.001}, with_residuals(),
                                 [](double& residual, double) { residual += 5.0 * kDegH; });
  expect_bounded(with);
  EXPECT_EQ(largest_difference_deg_h(with, without), 0.0);
  EXPECT_EQ(count_of(with, ReferenceVerdict::kImplausible), 3U) << "then it is not used";
  EXPECT_GT(count_of(with, ReferenceVerdict::kDistrusted), 8000U);
}

TEST_F(Feedback, OfTheWrongSignCannotRunAway) {
  const Driven with = drive_with({.sigma_deg_h = 0.001}, with_residuals(),
                                 [](double& residual, double) { residual = -residual; });
  expect_bounded(with);
  EXPECT_GT(count_of(with, ReferenceVerdict::kImplausible) +
                count_of(with, ReferenceVerdict::kDistrusted),
            0U);
}

TEST_F(Feedback, OfAFilterThatAnswersWithTheSameResidualForEverCannotRunAway) {
  const Driven with = drive(
      record,
      [&](const core::CompensatedSample&, std::size_t) {
        return Opinion{.residual_radps = {0.02 * kDegH, 0.02 * kDegH, 0.02 * kDegH},
                       .sigma_deg_h = 0.001};
      },
      with_residuals());
  expect_bounded(with);
}

TEST_F(Feedback, WithAnErrorThatGrowsIsFollowedNoFurtherThanTheBound) {
  const Driven with =
      drive_with({.sigma_deg_h = 0.001}, with_residuals(), [](double& residual, double time_s) {
        const double grown = 0.01 * (time_s - 310.0);  // 36 deg/h an hour
        residual += grown * kDegH;
      });
  expect_bounded(with);
  EXPECT_GT(count_of(with, ReferenceVerdict::kDistrusted), 1000U);
}

TEST_F(Feedback, OfAnotherModelsEpochIsRefused) {
  const Driven with = drive_with({.epoch_offset = 1});
  EXPECT_EQ(largest_difference_deg_h(with, without), 0.0);
  EXPECT_EQ(count_of(with, ReferenceVerdict::kWrongEpoch), 3U);
  EXPECT_EQ(count_of(with, ReferenceVerdict::kTaken), 0U);
}

TEST_F(Feedback, OlderThanASecondIsNotTaken) {
  const Driven with = drive_with({.age_s = 1.0});
  EXPECT_EQ(largest_difference_deg_h(with, without), 0.0);
  EXPECT_EQ(count_of(with, ReferenceVerdict::kTaken), 0U);
}

TEST_F(Feedback, ThatIsUncertainIsRefused) {
  const Driven with = drive_with({.sigma_deg_h = 0.5});
  EXPECT_EQ(largest_difference_deg_h(with, without), 0.0);
  EXPECT_GT(count_of(with, ReferenceVerdict::kUncertain), 8000U);
}

TEST_F(Feedback, OfNoNumbersPoisonsNothing) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const Driven with = drive(
      record,
      [&](const core::CompensatedSample&, std::size_t k) {
        return Opinion{.residual_radps = {nan, k % 4 == 0 ? 1e300 : nan, nan},
                       .sigma_deg_h = k % 8 == 0 ? nan : 0.01};
      },
      with_residuals());
  EXPECT_EQ(largest_difference_deg_h(with, without), 0.0);
}

// Rule: the correction moves no faster than its slew and fades when the filter falls silent.
TEST(ResidualCorrectionLaws, MovesByItsSlewFadesAndEndsWithTheNextLabel) {
  ReferenceOptions options;
  options.correction_memory_s = 100.0;
  ResidualCorrection correction(options);
  const core::PerAxis<OwnForecast> forecast{OwnForecast{0.0, std::pow(0.2 * kDegH, 2)},
                                            OwnForecast{}, OwnForecast{}};
  correction.note_epoch(core::from_seconds(1.0), 7);
  correction.step(core::from_seconds(10.0));
  RateReferenceSample residual = reference(ReferenceKind::kNavigationResidual, 0.3, 0.0);
  residual.time = core::from_seconds(10.0);
  residual.model_epoch = 7;
  EXPECT_EQ(correction.take(residual, true, forecast), ReferenceVerdict::kAtRest);
  EXPECT_EQ(correction.take(residual, false, forecast), ReferenceVerdict::kTaken);
  correction.step(core::from_seconds(11.0));
  EXPECT_NEAR(correction.correction_radps(0) / kDegH, 0.05, 1e-9);
  EXPECT_EQ(correction.correction_radps(1), 0.0) << "no forecast, no correction";
  for (double t = 11.1; t < 25.0; t += 0.1) correction.step(core::from_seconds(t));
  EXPECT_NEAR(correction.correction_radps(0) / kDegH, 0.3 * std::exp(-0.15), 0.002);
  for (double t = 25.0; t < 525.0; t += 0.1) correction.step(core::from_seconds(t));
  EXPECT_LT(correction.correction_radps(0) / kDegH, 0.003);
  residual.time = core::from_seconds(525.0);
  correction.take(residual, false, forecast);
  for (double t = 525.0; t < 535.0; t += 0.1) correction.step(core::from_seconds(t));
  EXPECT_GT(correction.correction_radps(0), 0.0);
  correction.note_epoch(core::from_seconds(535.0), 8);
  EXPECT_EQ(correction.correction_radps(0), 0.0);
}

}  // namespace
}  // namespace zerodrift::compensation
