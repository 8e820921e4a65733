// SPDX-License-Identifier: Apache-2.0
// Drift = prior + what is learned of the remainder.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <limits>
#include <memory>
#include <stdexcept>
#include <utility>

#include "tests/unit/compensation/prior_models.h"

namespace zerodrift::compensation {
namespace {

using testing::effect;
using testing::model_of;

// 20 to 50 °C at 1 °C/min on average, at rest but for the ten minutes from 900 s on.
GyroSpec climb() {
  return {.rate_hz = 10.0, .duration_s = 1500.0, .low_degc = 20.0, .high_degc = 50.0};
}

CompensationOptions options_with(const twin::Model& model) {
  CompensationOptions options = testing::options();
  options.prior = model;
  return options;
}

twin::Model without(twin::Model model, const std::string& kind) {
  std::erase_if(model.effects, [&](const auto& spec) { return spec.kind == kind; });
  return model;
}

// Root mean square of applied less true drift of an axis, rad/s.
double rms_error(const Record& record, const std::vector<core::CompensatedSample>& answers,
                 double from_s, double to_s, Axis axis) {
  double sum = 0.0;
  double n = 0.0;
  for (std::size_t k = 0; k < answers.size(); ++k) {
    if (answers[k].raw.time <= from_seconds(from_s) || answers[k].raw.time > from_seconds(to_s))
      continue;
    const double error =
        answers[k].applied_drift_radps[index(axis)] - record.drift_radps[k][index(axis)];
    sum += error * error;
    n += 1.0;
  }
  return std::sqrt(sum / n);
}

// The record's own model errs by what holding and the 60 s fit of the temperature rate cost. The
// chamber is T = 35 - 15 cos(w t), w = pi / 1800 s. Drift slope: (.05 + 2 * 1e-3 * 25) deg/h/°C *
// 1.57 °C/min = .0026 deg/h/s and Shupe .5 * 1.57 * w = .0014; readings are 1 s old at most, held
// for another. A quadratic fit over h = 60 s ends with an error of its slope of T''' h² / 20 (the
// third Legendre polynomial's) = 15 w³ * 180 = 1.4e-5 °C/s = 8.6e-4 °C/min, 4.3e-4 deg/h. In all
// below 2 * .004 + .0005 deg/h.
constexpr double kOfModelRadps = 0.0085 * kDegH;

// Rule: a record of the model, compensated with that model, is left with its noise, without any
// learning; the rung says so.
TEST(PriorScenario, TheRecordsOwnModelLeavesNoiseWithoutLearning) {
  const Record record = make_record(climb());
  Compensator compensator{options_with(model_of(climb()))};
  compensator.freeze();
  const auto answers = testing::run(compensator, record);
  for (const auto axis : kAxes) {
    EXPECT_LT(rms_error(record, answers, 62.0, 1500.0, axis), kOfModelRadps);
    EXPECT_EQ(answers.back().rung[index(axis)], core::Rung::kPrior);
    EXPECT_EQ(answers.back().mode[index(axis)], core::Mode::kFallback);
    EXPECT_EQ(answers.front().rung[index(axis)], core::Rung::kNone) << "the rate is not known yet";
    EXPECT_EQ(answers.front().reason[index(axis)], core::Reason::kRateNotReady);
    EXPECT_GT(rms_error(record, answers, 0.0, 50.0, axis), 0.5 * kDegH) << "nothing is taken off";
  }
  EXPECT_EQ(compensator.learner().labels_learned(), 0U);
}

// Rule: what the prior lacks is learned; the whole is better than either alone. The Shupe term
// swings by 0.5 * 1.57 = .79 deg/h.
TEST(PriorScenario, WhatThePriorLacksIsLearned) {
  const Record record = make_record(climb());
  const auto lacking = without(model_of(climb()), "shupe");
  Compensator prior_alone{options_with(lacking)};
  prior_alone.freeze();
  Compensator both{options_with(lacking)};
  const auto frozen = testing::run(prior_alone, record);
  const auto learned = testing::run(both, record);
  for (const auto axis : kAxes) {
    const double alone = rms_error(record, frozen, 900.0, 1500.0, axis);
    EXPECT_GT(alone, 0.3 * kDegH);
    EXPECT_LT(rms_error(record, learned, 900.0, 1500.0, axis), 0.25 * alone);
    EXPECT_EQ(learned.back().rung[index(axis)], core::Rung::kStack);
  }
}

// Rule: another gyro's prior, whose temperature terms go the other way, is told of each of its axes
// once the temperature has gone and come back; the own one isn't.
TEST(PriorScenario, OneThatCostsIsTold) {
  GyroSpec spec = climb();
  spec.duration_s = 3600.0;
  const Record record = make_record(spec);
  GyroSpec another = spec;
  another.per_degc_deg_h = -2.0 * spec.per_degc_deg_h;
  another.per_degc2_deg_h = -spec.per_degc2_deg_h;
  Compensator own{options_with(model_of(spec))};
  Compensator exchanged{options_with(model_of(another))};
  testing::run(own, record);
  testing::run(exchanged, record);
  EXPECT_EQ(own.counts().costly_priors, 0U);
  EXPECT_EQ(exchanged.counts().costly_priors, 3U);
}

// Rule: where labels stop for ten minutes of motion while the temperature goes on to where nothing
// was learned, the prior goes on: a tenth of the error at most of the online SVR alone, which goes
// back to holding. The stack's linear experts go on as well, and right where the drift is linear:
// half of their error at most.
TEST(PriorScenario, BeyondWhatWasLearnedAndWithoutLabelsThePriorGoesOn) {
  GyroSpec spec = climb();
  // Motion that no reference tells of, on z; the truth of x and y is still their drift.
  spec.motion = testing::turn(900.0, 600.0, 0.1);
  const Record record = make_record(spec);
  for (const auto& [options, times] :
       {std::pair{testing::svr_options(), 0.1}, std::pair{testing::options(), 0.5}}) {
    CompensationOptions with_model = options;
    with_model.prior = model_of(climb());
    Compensator learning{options};
    Compensator with_prior{with_model};
    const auto alone = testing::run(learning, record);
    const auto both = testing::run(with_prior, record);
    for (const auto axis : {Axis::kX, Axis::kY}) {
      const double error = rms_error(record, alone, 1200.0, 1500.0, axis);
      const double left = rms_error(record, both, 1200.0, 1500.0, axis);
      std::printf("axis %zu: %.4f deg/h alone, %.4f with the prior\n", index(axis), error / kDegH,
                  left / kDegH);
      if (options.scheme == Scheme::kOnlineSvr) {
        EXPECT_GT(error, 0.3 * kDegH);
      }
      EXPECT_LT(left, times * error);
    }
  }
}

// Rule: a prior that says 0 changes not one bit of what is taken off, nor of its variance.
TEST(PriorLaws, AModelWithoutDriftIsNoPriorToTheBit) {
  const Record record = make_record(climb());
  std::vector<twin::EffectSpec> nothing;
  for (const auto axis : kAxes) nothing.push_back(effect("bias", axis, {{"bias_deg_h", 0.0}}));
  Compensator without_prior{testing::options()};
  Compensator with_prior{options_with(model_of(nothing))};
  const auto expected = testing::run(without_prior, record);
  const auto answers = testing::run(with_prior, record);
  ASSERT_EQ(answers.size(), expected.size());
  std::size_t on_model = 0;
  for (std::size_t k = 0; k < answers.size(); ++k) {
    ASSERT_EQ(answers[k].applied_drift_radps, expected[k].applied_drift_radps) << k;
    ASSERT_EQ(answers[k].drift_variance, expected[k].drift_variance) << k;
    ASSERT_EQ(answers[k].model_epoch, expected[k].model_epoch) << k;
    const bool was_none = expected[k].rung[0] == core::Rung::kNone;
    ASSERT_EQ(answers[k].rung[0], was_none ? core::Rung::kPrior : expected[k].rung[0]) << k;
    if (answers[k].rung[0] == core::Rung::kStack) ++on_model;
  }
  EXPECT_GT(on_model, 1000U);
}

// Rule: neither the learner's timing nor the order of arrival changes a bit, with a prior and a
// change of it.
TEST(PriorLaws, LearnerTimingNeverChangesABit) {
  const Record record = make_record(climb());
  const auto options = options_with(without(model_of(climb()), "shupe"));
  const auto run = [&](testing::LearnerTiming timing) {
    Compensator compensator{options};
    const auto change = std::make_shared<PriorChange>(options, model_of(climb()));
    std::vector<core::CompensatedSample> answers;
    testing::run(
        compensator, record,
        [&](const core::CompensatedSample& answer) {
          answers.push_back(answer);
          if (answers.size() != 8'000 && answers.size() != 12'000) return;
          EXPECT_TRUE(compensator.change_prior(change));
        },
        timing);
    return answers;
  };
  const auto at_once = run(testing::LearnerTiming::kAtOnce);
  const auto awaited = run(testing::LearnerTiming::kOnlyWhenAwaited);
  ASSERT_EQ(at_once.size(), awaited.size());
  for (std::size_t k = 0; k < at_once.size(); ++k) {
    ASSERT_EQ(at_once[k].rate_radps, awaited[k].rate_radps) << k;
    ASSERT_EQ(at_once[k].model_epoch, awaited[k].model_epoch) << k;
    ASSERT_EQ(at_once[k].rung, awaited[k].rung) << k;
  }
}

// Rule: another prior is in force from the next sample on, with a new epoch and nothing learned of
// what it leaves; taken back, the prior before and what was learned with it are there again, with
// an epoch that is new as well.
TEST(PriorChanges, AnAdoptedPriorAndTheOneBeforeTakeEffectWithTheNextSample) {
  const Record record = make_record(climb());
  const auto options = options_with(without(model_of(climb()), "shupe"));
  Compensator compensator{options};
  const auto change = std::make_shared<PriorChange>(options, model_of(climb()));
  constexpr std::size_t kAdopted = 10'000, kReverted = 10'100;
  std::vector<core::CompensatedSample> answers;
  testing::run(compensator, record, [&](const core::CompensatedSample& answer) {
    answers.push_back(answer);
    if (answers.size() != kAdopted && answers.size() != kReverted) return;
    ASSERT_TRUE(compensator.change_prior(change));
    EXPECT_FALSE(change->in_force);
  });
  ASSERT_TRUE(change->in_force);
  EXPECT_EQ(answers[kAdopted - 1].rung[0], core::Rung::kStack);
  EXPECT_EQ(answers[kAdopted].rung[0], core::Rung::kPrior);
  EXPECT_EQ(answers[kAdopted].model_epoch, answers[kAdopted - 1].model_epoch + 1);
  EXPECT_NEAR(answers[kAdopted].applied_drift_radps[0], record.drift_radps[kAdopted][0],
              2.0 * kOfModelRadps);
  EXPECT_EQ(answers[kReverted].rung[0], core::Rung::kStack);
  EXPECT_EQ(answers[kReverted].model_epoch, answers[kReverted - 1].model_epoch + 1);
  // Ten seconds on, the same model says nearly the same: the drift moves by .004 deg/h/s at most.
  EXPECT_NEAR(answers[kReverted].applied_drift_radps[0],
              answers[kAdopted - 1].applied_drift_radps[0], 0.05 * kDegH);
  for (std::size_t k = 1; k < answers.size(); ++k)
    ASSERT_GE(answers[k].model_epoch, answers[k - 1].model_epoch);
  EXPECT_EQ(answers.back().rung[0], core::Rung::kStack);
}

// Rule: an axis that neither prior has effects of keeps what it learned and learns on.
TEST(PriorChanges, AnAxisThatNoPriorCoversKeepsWhatItLearned) {
  const Record record = make_record(climb());
  const CompensationOptions options = testing::options();
  Compensator compensator{options};
  const auto change = std::make_shared<PriorChange>(
      options, model_of({effect("bias", Axis::kX, {{"bias_deg_h", 2.0}})}));
  std::vector<core::CompensatedSample> answers;
  testing::run(compensator, record, [&](const core::CompensatedSample& answer) {
    answers.push_back(answer);
    if (answers.size() != 10'000) return;
    ASSERT_TRUE(compensator.change_prior(change));
  });
  EXPECT_EQ(answers[10'000].rung[0], core::Rung::kPrior);
  EXPECT_EQ(answers[9'999].rung[1], core::Rung::kStack);
  EXPECT_EQ(answers[10'000].rung[1], core::Rung::kStack);
  EXPECT_EQ(answers.back().rung[1], core::Rung::kStack);
}

// Rule: a prior can come where there was none, before anything was learned, and go again.
TEST(PriorChanges, APriorCanComeAndGo) {
  const Record record = make_record(climb());
  const CompensationOptions options = testing::options();
  Compensator compensator{options};
  compensator.freeze();  // else a label would come in between
  const auto change = std::make_shared<PriorChange>(options, model_of(climb()));
  ASSERT_TRUE(compensator.change_prior(change));
  std::size_t n = 0;
  testing::run(compensator, record, [&](const core::CompensatedSample& answer) {
    ++n;
    if (n == 1) {
      EXPECT_EQ(answer.model_epoch, 1U);
    } else if (n == 700) {  // the rate's 60 s are over
      EXPECT_EQ(answer.rung[0], core::Rung::kPrior);
    } else if (n == 750) {
      compensator.change_prior(change);
    } else if (n == 751) {
      EXPECT_EQ(answer.rung[0], core::Rung::kNone);
      EXPECT_EQ(answer.applied_drift_radps[0], 0.0);
    }
  });
  EXPECT_THROW(PriorChange(options, model_of({effect("bias_temperature", Axis::kX,
                                                     {{"c1_deg_h_per_degc", 1.0}}, {"board"})})),
               std::invalid_argument);
}

// Rule: while temperatures are absent, refused or stuck at NaN the prior stands still and the
// sample says why; every sample is answered with a finite drift.
TEST(PriorAbuse, WithoutTemperaturesThePriorStandsStillAndSaysWhy) {
  Record record = make_record(climb());
  for (auto& reading : record.temperatures) {
    if (reading.time > from_seconds(700.0) && reading.time <= from_seconds(1000.0))
      reading.temperature_degc = std::numeric_limits<double>::quiet_NaN();
  }
  Compensator compensator{options_with(model_of(climb()))};
  compensator.freeze();
  const auto answers = testing::run(compensator, record);
  ASSERT_EQ(answers.size(), record.rates.size());
  const auto at = [&](double time_s) -> const core::CompensatedSample& {
    return answers[static_cast<std::size_t>(time_s * climb().rate_hz)];
  };
  EXPECT_EQ(at(740).reason[0], core::Reason::kTemperatureStale);
  EXPECT_EQ(at(740).rung[0], core::Rung::kPrior);
  EXPECT_EQ(at(740).applied_drift_radps, at(990).applied_drift_radps);
  EXPECT_NE(at(1100).applied_drift_radps, at(990).applied_drift_radps);
  EXPECT_LT(rms_error(record, answers, 1070.0, 1500.0, Axis::kX), kOfModelRadps);
  for (const auto& answer : answers) ASSERT_TRUE(std::isfinite(answer.applied_drift_radps[0]));
}

// Rule: where a temperature that the prior reads never comes, the axes that read it take nothing
// off and learn nothing, and say so; the others go on.
TEST(PriorAbuse, AnAxisWithoutItsProbeTakesNothingOff) {
  const Record record = make_record(climb());
  CompensationOptions options = options_with(
      model_of({effect("bias_temperature", Axis::kX, {{"c1_deg_h_per_degc", 1.0}}, {"board"})}));
  EXPECT_EQ(options.probes(), (std::vector<std::string>{"coil", "board"}));
  Compensator compensator{options};
  std::vector<core::CompensatedSample> answers;
  const auto take = [&](const core::CompensatedSample& answer) { answers.push_back(answer); };
  std::size_t t = 0;
  for (const auto& sample : record.rates) {
    for (; record.temperatures[t].time <= sample.time; ++t)
      compensator.push(record.temperatures[t]);
    compensator.push(sample);
    compensator.give_up_waiting();
    testing::answer_ready(compensator, testing::LearnerTiming::kAtOnce, take);
  }
  ASSERT_GT(answers.size(), record.rates.size() - 100);
  EXPECT_EQ(answers.back().rung[0], core::Rung::kNone);
  EXPECT_EQ(answers.back().reason[0], core::Reason::kTemperatureMissing);
  EXPECT_EQ(answers.back().rung[1], core::Rung::kStack);
}

}  // namespace
}  // namespace zerodrift::compensation
