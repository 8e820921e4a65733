// SPDX-License-Identifier: Apache-2.0
#include "common/compensation/axis_drift.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <string_view>
#include <utility>

#include "common/experts/expert_stack.h"

namespace zerodrift::compensation {
namespace {

using core::Mode;
using core::Reason;
using core::Rung;

constexpr double kHeldRadps = 1e-5;

// An axis of which the last stationary minute is known, and no more.
struct OneAxis {
  OneAxis() {
    model.drift.time = core::SensorTime{0};
    model.drift.held_radps = kHeldRadps;
    inputs.features = &features;
    inputs.thermal = &thermal;
  }
  void estimate(Scheme scheme = Scheme::kOnlineSvr) { drift.estimate(scheme, inputs); }

  FeatureArray features{};
  experts::ThermalState thermal{};
  AxisModel model{2, 8};
  AxisInputs inputs{};
  AxisDrift drift{};
};

TEST(AxisDriftLaws, TheBestRungThatHasAValueIsApplied) {
  OneAxis a;
  a.estimate();
  EXPECT_EQ(a.drift.rung(), Rung::kNone);
  EXPECT_EQ(a.drift.mode(), Mode::kPassthrough);
  EXPECT_EQ(a.drift.applied_radps(), 0.0);
  a.inputs.factory_radps = 2e-5;
  a.estimate();
  EXPECT_EQ(a.drift.rung(), Rung::kFactoryPolynomial);
  EXPECT_EQ(a.drift.applied_radps(), 2e-5);
  a.inputs.prior_covers = true;
  a.drift.note_prior(3e-5);
  a.estimate();
  EXPECT_EQ(a.drift.rung(), Rung::kPrior);
  EXPECT_EQ(a.drift.applied_radps(), 3e-5);
  a.inputs.model = &a.model;
  a.estimate();
  EXPECT_EQ(a.drift.rung(), Rung::kStationaryBias);
  EXPECT_DOUBLE_EQ(a.drift.applied_radps(), kHeldRadps + 3e-5);
}

// Rule: what a learner knows is the remainder; without the prior's value it is no drift.
TEST(AxisDriftLaws, WithoutThePriorsValueWhatWasLearnedIsNotApplied) {
  OneAxis a;
  a.inputs.prior_covers = true;
  a.inputs.model = &a.model;
  a.inputs.input = Reason::kTemperatureMissing;
  a.drift.note_prior(std::nullopt);
  a.estimate();
  EXPECT_EQ(a.drift.rung(), Rung::kNone);
  EXPECT_EQ(a.drift.reason(), Reason::kTemperatureMissing);
  EXPECT_EQ(a.drift.applied_radps(), 0.0);
}

TEST(AxisDriftLaws, SchemeNoneTakesNothingOffWhateverIsKnown) {
  OneAxis a;
  a.inputs.model = &a.model;
  a.inputs.factory_radps = 2e-5;
  a.drift.note_prior(3e-5);
  a.inputs.prior_covers = true;
  a.estimate(Scheme::kNone);
  EXPECT_EQ(a.drift.applied_radps(), 0.0);
  EXPECT_EQ(a.drift.reason(), Reason::kSchemeNone);
}

// Law: between estimates the applied drift moves by exactly what the prior moves, and what was held
// with it.
TEST(AxisDriftLaws, BetweenEstimatesWhatIsAppliedFollowsThePrior) {
  OneAxis a;
  a.inputs.prior_covers = true;
  a.inputs.model = &a.model;
  a.drift.note_prior(3e-5);
  a.estimate();
  EXPECT_TRUE(a.drift.follow_prior(5e-5));
  EXPECT_DOUBLE_EQ(a.drift.applied_radps(), kHeldRadps + 5e-5);
  ASSERT_TRUE(a.drift.context().applied_radps && a.drift.context().held_radps);
  EXPECT_DOUBLE_EQ(*a.drift.context().applied_radps, kHeldRadps + 5e-5);
  EXPECT_DOUBLE_EQ(*a.drift.context().held_radps, kHeldRadps + 5e-5);
  EXPECT_FALSE(a.drift.follow_prior(std::nullopt)) << "it went: another estimate is wanted";
}

// Law: the mean square is the plain mean of the first labels and an exponential one of twelve
// after.
TEST(AxisDriftLaws, LabelsJudgeWhatWasPredictedByAMeanThatForgets) {
  AxisDrift drift;
  drift.judge(0.0, 1.0, std::nullopt);
  EXPECT_EQ(drift.record().labels, 0U) << "nothing was predicted to be judged";
  for (int i = 0; i < 12; ++i) drift.judge(0.0, i % 2 == 0 ? 1.0 : 3.0, 2.0);
  EXPECT_EQ(drift.record().labels, 12U);
  EXPECT_NEAR(drift.record().applied_mse, 5.0, 1e-12);  // of 1 and 9
  EXPECT_NEAR(drift.record().held_mse, 4.0, 1e-12);
  for (int i = 0; i < 12; ++i) drift.judge(0.0, 0.0, 2.0);
  EXPECT_NEAR(drift.record().applied_mse, 5.0 * std::pow(11.0 / 12.0, 12), 1e-12);
}

bool takes_state_of(AxisDrift& reader, AxisDrift& writer) {
  std::string bytes;
  core::StateArchive writes(bytes);
  writer.carry(writes);
  core::StateArchive reads{std::string_view(bytes)};
  reader.carry(reads);
  return reads.ok();
}

// State: one that read another's goes on as that one does.
TEST(AxisDriftLaws, ItsStateIsAllOfIt) {
  OneAxis a;
  a.inputs.prior_covers = true;
  a.inputs.model = &a.model;
  a.drift.note_prior(3e-5);
  a.estimate();
  a.drift.judge(0.0, 1.0, 2.0);
  AxisDrift other;
  ASSERT_TRUE(takes_state_of(other, a.drift));
  EXPECT_TRUE(other.follow_prior(4e-5));
  EXPECT_TRUE(a.drift.follow_prior(4e-5));
  EXPECT_EQ(other.applied_radps(), a.drift.applied_radps());
  EXPECT_EQ(other.record().applied_mse, a.drift.record().applied_mse);
}

// Rule: an axis that turns the other way round is no damaged state.
TEST(AxisDriftLaws, AStateWithAnyReasonIsTaken) {
  for (std::size_t reason = 0; reason < core::kReasons; ++reason) {
    OneAxis a;
    a.inputs.gate = static_cast<Reason>(reason);
    a.estimate();
    AxisDrift other;
    EXPECT_TRUE(takes_state_of(other, a.drift)) << core::name(static_cast<Reason>(reason));
  }
}

// Rule: the last stationary mean is held where that is in the order of things, and is a fallback
// where an input is missing.
TEST(AxisDriftLaws, TheLastMeanIsHeldUnlessAnInputIsMissing) {
  for (const auto& [input, mode] :
       {std::pair{Reason::kNone, Mode::kHolding}, std::pair{Reason::kRateNotReady, Mode::kHolding},
        std::pair{Reason::kTemperatureMissing, Mode::kFallback},
        std::pair{Reason::kTemperatureStale, Mode::kFallback},
        std::pair{Reason::kProbeStuck, Mode::kFallback}}) {
    OneAxis a;
    a.inputs.model = &a.model;
    a.inputs.input = input;
    a.estimate();
    EXPECT_EQ(a.drift.rung(), Rung::kStationaryBias);
    EXPECT_EQ(a.drift.mode(), mode) << core::name(input);
  }
}

// Rule: experts that need no thermometer take the held mean's place where a temperature fails, and
// nowhere else.
TEST(AxisDriftLaws, WhereATemperatureFailsTheExpertsThatNeedNoneCompensate) {
  experts::ExpertStack in_time{experts::GoesBy::kTime};
  for (int i = 0; i < 100; ++i)
    in_time.learn({.time_s = 5.0 * i, .duration_s = 5.0, .drift = 1e-7 * i, .variance = 1e-16});
  for (std::size_t r = 0; r < core::kReasons; ++r) {
    const auto input = static_cast<Reason>(r);
    OneAxis a;
    a.model.in_time = in_time.forecast();
    a.inputs.model = &a.model;
    a.inputs.now = core::SensorTime{500'000'000'000};
    a.inputs.input = input;
    a.estimate(Scheme::kStack);
    const bool fails = core::lacks_temperature(input);
    EXPECT_EQ(a.drift.rung(), fails ? Rung::kStack : Rung::kStationaryBias) << core::name(input);
    if (!fails) continue;
    EXPECT_EQ(a.drift.mode(), Mode::kFallback);
    EXPECT_EQ(a.drift.reason(), input);
    EXPECT_NEAR(a.drift.applied_radps(), 1e-7 * 100, 2e-7);
    EXPECT_GT(a.drift.variance(), 0.0);
  }
}

// Drift of 3e-7 rad/s for each unit of temperature, learned and then without a level: restart().
experts::StackForecast without_a_level() {
  experts::ExpertStack stack;
  for (int i = 0; i < 400; ++i) {
    const double temperature = std::sin(0.05 * i);
    stack.learn({.time_s = 5.0 * i,
                 .duration_s = 5.0,
                 .drift = 3e-7 * temperature,
                 .variance = 1e-18,
                 .thermal = {.temperature = temperature, .rate = 0.01 * std::cos(0.05 * i)}});
  }
  stack.restart();
  return stack.forecast();
}

// Rule: a mean whose labels came before the temperature's rate was known is held until there is a
// label with it, and what is stated makes room for what the temperature has changed since, whatever
// the reason for holding; only where the temperature isn't known, then or now, it can't.
TEST(AxisDriftLaws, WhileAMeanFromBeforeTheRateIsHeldTheTemperaturesEffectIsStated) {
  for (const Reason input : {Reason::kNone, Reason::kRateNotReady, Reason::kTemperatureStale}) {
    OneAxis a;
    a.inputs.model = &a.model;
    a.inputs.now = core::SensorTime{60'000'000'000};
    a.inputs.input = input;
    a.model.stack = without_a_level();
    a.model.trust.horizon_s = {10.0, 25.0, 75.0, 250.0, 750.0, 2500.0};
    a.model.drift.held_variance = 1e-16;
    ASSERT_FALSE(a.model.stack.knows());
    const auto variance_at = [&](double temperature) {
      a.thermal.temperature = temperature;
      a.estimate(Scheme::kStack);
      EXPECT_EQ(a.drift.rung(), Rung::kStationaryBias);
      EXPECT_EQ(a.drift.applied_radps(), kHeldRadps);
      return a.drift.variance();
    };
    const double unknown = variance_at(1.5);
    a.model.held_thermal = experts::ThermalState{.temperature = 0.5};
    EXPECT_EQ(variance_at(0.5), unknown) << "nothing has changed";
    if (core::lacks_temperature(input)) {
      EXPECT_EQ(variance_at(1.5), unknown);
      continue;
    }
    EXPECT_NEAR(std::sqrt(variance_at(1.5) - unknown), 3e-7, 0.5e-7) << core::name(input);
    EXPECT_NEAR(std::sqrt(variance_at(-1.5) - unknown), 6e-7, 1e-7) << core::name(input);
  }
}

}  // namespace
}  // namespace zerodrift::compensation
