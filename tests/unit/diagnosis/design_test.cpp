// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/design.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/diagnosis/design_trial.h"
#include "common/diagnosis/search_problem.h"
#include "common/twin/effect_catalogue.h"
#include "tests/unit/diagnosis/simulated_series.h"

namespace zerodrift::diagnosis {
namespace {

constexpr core::Axis kX = core::Axis::kX;
constexpr double kHourS = 3600.0;

void ignore(double) {}

twin::ChamberLimits laboratory() {
  return {.duration_s = 3.0 * kHourS,
          .low_degc = 0.0,
          .high_degc = 50.0,
          .ramp_degc_per_s = 2.0 / 60.0,
          .rate_radps = 20.0 * core::kRadPerDeg,
          .magnetic_ut = 250.0,
          .tilt_rad = 30.0 * core::kRadPerDeg,
          .vibration_g = 4.0,
          .source_current_ma = 10.0,
          .supply_v = 0.25,
          .off_s = 300.0};
}

// The laboratory gyro with its bias and its noise alone.
twin::Model plain_model() {
  twin::Model model = test::lab_model();
  for (const char* kind : {"bias_temperature", "shupe", "scale_factor"})
    model = test::without(model, kind);
  return model;
}

using Values = std::map<std::string, double>;

NamedEffect effect(const std::string& kind, const Values& values) {
  return {.name = kind, .probability = 0.5, .parameters = values};
}

std::vector<Question> confused(const NamedEffect& one, const NamedEffect& other,
                               const twin::Model& model = plain_model()) {
  NamedEffect named = one;
  named.alternatives = {{.name = other.name, .probability = 0.5, .parameters = other.parameters}};
  auto questions = open_questions(model, kX, {named}, {});
  EXPECT_TRUE(questions.front().left_out.empty());
  return questions;
}

std::vector<Question> slope_or_ramp(double times = 1.0) {
  return confused(
      effect("bias_temperature", {{"reference_degc", 25.0}, {"c1_deg_h_per_degc", 0.004 * times}}),
      effect("rate_ramp", {{"ramp_deg_per_h2", 0.03 * times}}));
}

std::string text_of(const twin::Profile& profile) {
  std::string text;
  for (const auto& point : profile.chamber)
    text += std::to_string(point.time_s) + ' ' + std::to_string(point.temperature_degc) + '\n';
  for (const auto& turn : profile.turns)
    text += std::to_string(turn.start_s) + ' ' + std::to_string(turn.rate_radps) + '\n';
  for (const auto& one : profile.excitations)
    text += std::to_string(one.start_s) + ' ' + std::to_string(one.value) + '\n';
  return text;
}

TEST(ExperimentPlanLaws, EveryExperimentOfTheMenuFitsTheLimitsAndIsAProfile) {
  for (const double hours : {0.2, 1.0, 5.0}) {
    twin::ChamberLimits limits = laboratory();
    limits.duration_s = hours * kHourS;
    EXPECT_GE(experiment_menu(limits).size(), 7U);
    for (const ExperimentPlan& plan : experiment_menu(limits)) {
      const twin::Profile profile = profile_of(plan, limits);
      EXPECT_EQ(profile.validate().value_or("sound"), "sound") << plan.what;
      EXPECT_EQ(twin::find_excess(profile, limits).value_or("fits"), "fits") << plan.what;
      // A chamber is told nothing that comes after the end.
      for (const auto& point : profile.chamber)
        EXPECT_LE(point.time_s, profile.duration_s) << plan.what;
    }
  }
}

TEST(ExperimentPlanLaws, ALaboratoryThatMovesNothingStillSwitchesOn) {
  const twin::ChamberLimits nothing{.duration_s = kHourS};
  ASSERT_EQ(experiment_menu(nothing).size(), 1U);
  const twin::Profile profile = profile_of(experiment_menu(nothing).front(), nothing);
  EXPECT_TRUE(profile.turns.empty() && profile.chamber.empty() && profile.power_cycles.empty());
}

// A rate that stands at 1 deg/s for half of the time, in white noise: d² = sum of (w - mean)² / s².
TEST(DesignGolden, TheDistanceOfAScaleFactorFromNothingIsThatOfItsWaveform) {
  twin::Model model = plain_model();
  for (const char* kind : {"bias_instability", "rate_random_walk"})
    model = test::without(model, kind);
  double n = 0.0;
  for (const auto& spec : model.effects) {
    if (spec.kind == "angle_random_walk") n = spec.parameters.at("coefficient_deg_per_sqrt_h");
  }
  ASSERT_GT(n, 0.0);
  constexpr double kPpm = 3.0;
  std::vector<Question> questions =
      open_questions(model, kX, {}, {effect("scale_factor", {{"error_ppm", kPpm}})});
  ASSERT_EQ(questions.size(), 1U);
  twin::Profile profile;
  profile.duration_s = 2000.0;
  profile.turns = {{1000.0, 1000.0, kX, core::kRadPerDeg, 5.0}};
  const Judgement judgement = judge_profile(questions, profile);
  ASSERT_EQ(judgement.separations.size(), 1U);
  const double w_deg_h = kPpm * 1e-6 * 3600.0;
  const double samples = 2000.0 / 2.0;  // a grid of 2 s
  const double sigma_deg_h = n * std::sqrt(3600.0) / std::sqrt(2.0);
  const double d = 0.5 * w_deg_h * std::sqrt(samples) / sigma_deg_h;
  const SearchOptions search;
  const double mismatch = search.form_mismatch_share * d * d / search.mismatch_freedom;
  // The ramps of 5 s take 1 % of the time away.
  EXPECT_NEAR(judgement.separations[0].standard_errors, d / std::sqrt(1.0 + mismatch), 0.02 * d);
}

TEST(DesignLaws, EqualSeedsDesignEqualExperiments) {
  const auto questions = slope_or_ramp();
  const DesignOptions options{.seed = 3, .proposals = 40};
  const Design once = design(questions, laboratory(), options, ignore);
  const Design again = design(questions, laboratory(), options, ignore);
  EXPECT_EQ(text_of(once.profile), text_of(again.profile));
  EXPECT_EQ(once.judgement.entropy_nats, again.judgement.entropy_nats);
}

TEST(DesignLaws, WhatIsDesignedFitsTheLimitsAndExpectsNoMoreEntropyThanTheMenu) {
  const auto questions = confused(effect("scale_factor", {{"error_ppm", 2.0}}),
                                  effect("misalignment", {{"next_axis_urad", 2.0}}));
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const Design result = design(questions, laboratory(), {.seed = seed, .proposals = 60}, ignore);
    EXPECT_EQ(result.profile.validate().value_or("sound"), "sound");
    EXPECT_EQ(twin::find_excess(result.profile, laboratory()).value_or("fits"), "fits");
    EXPECT_LE(result.judgement.entropy_nats, result.of_menu.entropy_nats);
    // What nobody asks about rests; gravity is always there.
    for (const auto& one : result.profile.excitations)
      EXPECT_EQ(one.quantity, twin::ExcitedQuantity::kAccelerationMps2);
  }
}

TEST(DesignLaws, TheExpectedEntropyFallsAsTheEffectGrows) {
  const twin::Profile profile = test::chamber_profile();
  double before = 1e9;
  for (const double times : {0.01, 0.1, 0.3, 1.0}) {
    const double now = judge_profile(slope_or_ramp(times), profile).entropy_nats;
    EXPECT_LT(now, before) << times;
    before = now;
  }
}

// Of two that can't be seen at all each is as probable as before: ln 2 and what is beyond the set.
TEST(DesignLaws, OfWhatIsTooSmallNothingIsLearned) {
  const double nats = judge_profile(slope_or_ramp(1e-9), test::chamber_profile()).entropy_nats;
  EXPECT_GE(nats, std::log(2.0));
  EXPECT_LE(nats, std::log(2.0) + 0.06);  // a tenth of a half each at most
}

TEST(DesignScenario, WhatOneRampConfusesIsToldOnTheDesignedExperiment) {
  const auto questions = slope_or_ramp(4.0);
  twin::Profile ramp;
  ramp.duration_s = 3.0 * kHourS;
  ramp.initial_temperature_degc = 10.0;
  ramp.chamber = {{0.0, 10.0}, {3.0 * kHourS, 30.0}};
  const Design result = design(questions, laboratory(), {.proposals = 10}, ignore);
  EXPECT_LT(result.judgement.entropy_nats, judge_profile(questions, ramp).entropy_nats);
  EXPECT_TRUE(result.inseparable.empty());
  const auto told = [&](const twin::Profile& profile) {
    std::size_t sum = 0;
    for (const Share& share : measured_shares(questions, profile, 1, 5, ignore)) {
      EXPECT_EQ(share.records, 1U);
      sum += share.resolved;
    }
    return sum;
  };
  EXPECT_EQ(told(result.profile), 2U);
}

TEST(DesignScenario, WhatTheLimitsCantSeparateIsToldWithTheChannelThatWould) {
  twin::ChamberLimits limits = laboratory();
  limits.rate_radps.reset();
  const auto questions = confused(effect("scale_factor", {{"error_ppm", 100.0}}),
                                  effect("misalignment", {{"next_axis_urad", 100.0}}));
  const Design result = design(questions, limits, {.proposals = 5}, ignore);
  ASSERT_EQ(result.inseparable.size(), 1U);
  EXPECT_EQ(result.inseparable[0].pair.first, "scale_factor");
  EXPECT_EQ(result.inseparable[0].pair.second, "misalignment");
  EXPECT_EQ(result.inseparable[0].channel, "rate_table.largest_deg_s");
}

// In a laboratory without a chamber. The menu's best experiment with one holds the two 1.2 standard
// errors apart, one that is designed several times as far.
TEST(DesignScenario, AChannelIsNamedForWhatADesignWouldMakeOfIt) {
  const auto questions = confused(
      effect("shupe", {{"coefficient_deg_h_min_per_degc", 1.6}}),
      effect("shupe_temperature", {{"coefficient_deg_h_min_per_degc2", -0.21}, {"lag_s", 1700.0}}),
      test::without(test::lab_model(), "shupe"));
  const Design result = design(questions, {.duration_s = 2.0 * kHourS}, {.proposals = 40}, ignore);
  ASSERT_EQ(result.inseparable.size(), 1U);
  EXPECT_EQ(result.inseparable[0].channel, "temperature");
}

TEST(OpenQuestions, WhatIsCertainAsksNothingAndWhatWasTakenBackRivalsNothing) {
  const NamedEffect found = effect("warm_up", {{"amplitude_deg_h", 0.1}, {"tau_s", 1800.0}});
  EXPECT_TRUE(open_questions(plain_model(), kX, {found}, {}).empty());
  const auto questions = open_questions(plain_model(), kX, {}, {found});
  ASSERT_EQ(questions.size(), 1U);
  ASSERT_EQ(questions[0].explanations.size(), 2U);
  EXPECT_EQ(questions[0].explanations[0].name(), "warm_up");
  EXPECT_TRUE(questions[0].explanations[1].is_nothing());
  EXPECT_DOUBLE_EQ(questions[0].explanations[0].probability, 0.5);
}

TEST(OpenQuestions, WhatElseWasFoundIsKnownAndWhatCanNotBeRunIsLeftOut) {
  NamedEffect open = effect("warm_up", {{"amplitude_deg_h", 0.1}, {"tau_s", 1800.0}});
  open.alternatives = {
      {.name = "markov", .probability = 0.2},
      {.name = "none_such", .probability = 0.1, .parameters = {{"a", 1.0}}},
      {.name = "rate_ramp", .probability = 0.2, .parameters = {{"ramp_deg_per_h2", 0.01}}}};
  const auto questions =
      open_questions(plain_model(), kX, {open, effect("scale_factor", {{"error_ppm", 10.0}})}, {});
  ASSERT_EQ(questions.size(), 1U);
  EXPECT_EQ(questions[0].explanations.size(), 2U);
  EXPECT_EQ(questions[0].left_out, (std::vector<std::string>{"markov", "none_such"}));
  EXPECT_EQ(questions[0].model.effects.size(), plain_model().effects.size() + 1);
}

// Rule: another record has no event of this one, so there it stands for nothing.
TEST(OpenQuestions, AnEventDoesNotComeAgain) {
  const NamedEffect slope =
      effect("bias_temperature", {{"reference_degc", 25.0}, {"c1_deg_h_per_degc", 0.01}});
  NamedEffect step = effect("bias_step", {{"amplitude_deg_h", 0.1}, {"at_s", 4000.0}});
  EXPECT_TRUE(open_questions(plain_model(), kX, {slope, step}, {}).empty());
  NamedEffect other = slope;
  other.alternatives = {
      {.name = "rate_ramp", .probability = 0.5, .parameters = {{"ramp_deg_per_h2", 0.1}}}};
  const Question beside = open_questions(plain_model(), kX, {other, step}, {}).front();
  EXPECT_EQ(beside.model.effects.size(), plain_model().effects.size());
  step.alternatives = {{.name = slope.name, .probability = 0.5, .parameters = slope.parameters}};
  const std::vector<Question> questions = open_questions(plain_model(), kX, {step}, {step});
  ASSERT_EQ(questions.size(), 2U);
  for (const Question& question : questions) {
    const auto& alike = question.look_alikes;
    EXPECT_EQ(std::count(alike.begin(), alike.end(), "bias_step"), 0);
    ASSERT_EQ(question.explanations.size(), 2U);
    EXPECT_EQ(std::count_if(question.explanations.begin(), question.explanations.end(),
                            [](const Explanation& e) { return e.is_nothing(); }),
              1);
  }
  EXPECT_NEAR(questions.back().explanations.front().probability, 0.75, 1e-12);
  const Judgement judged =
      judge_profile(questions, profile_of(experiment_menu(laboratory())[2], laboratory()));
  EXPECT_LT(judged.entropy_nats, 2.0 * std::log(2.0));
}

TEST(DesignAbuse, AModelWithoutNoiseIsRefused) {
  twin::Model quiet = plain_model();
  for (const char* kind : {"angle_random_walk", "bias_instability", "rate_random_walk"})
    quiet = test::without(quiet, kind);
  const auto questions = confused(effect("scale_factor", {{"error_ppm", 10.0}}),
                                  effect("rate_ramp", {{"ramp_deg_per_h2", 0.01}}), quiet);
  try {
    (void)judge_profile(questions, test::chamber_profile());
    FAIL() << "no refusal";
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("lists no noise of axis x"), std::string::npos);
  }
}

}  // namespace
}  // namespace zerodrift::diagnosis
