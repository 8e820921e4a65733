// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/refutation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "common/diagnosis/diagnosis.h"
#include "common/diagnosis/verdict.h"
#include "tests/unit/diagnosis/simulated_series.h"

namespace zerodrift::diagnosis {
namespace {

constexpr core::Axis kX = core::Axis::kX;
const DiagnosisOptions kOptions{.record = "simulated", .date = "2026-01-01"};

twin::EffectSpec field() {
  return {.kind = "magnetic", .axis = kX, .parameters = {{"x_deg_h_per_ut", 1e-3}}};
}
twin::EffectSpec tilt() {
  return {.kind = "acceleration_sensitivity", .axis = kX, .parameters = {{"x_deg_h_per_g", 0.05}}};
}

TEST(Refutation, OfOtherParametersCountsWhereMoreIsLeftThanNoise) {
  Trial trial;
  trial.recalibrated = {{.name = "bias"}, {.name = "shupe"}, {.name = "rate_random_walk"}};
  const auto unknown = unlike_other_parameters(trial, 5e-9, 2e-9);
  ASSERT_TRUE(unknown);
  EXPECT_EQ(unknown->description,
            "on this record it looks like other parameters of shupe, which held-out data speak "
            "against");
  EXPECT_NEAR(unknown->rms_radps, std::sqrt(21.0) * 1e-9, 1e-15);
  EXPECT_FALSE(unlike_other_parameters(trial, 5e-9, 2.5e-9));
  EXPECT_FALSE(unlike_other_parameters(trial, 5e-9, 0.0));
  trial.recalibrated = {{.name = "bias"}, {.name = "rate_random_walk"}};
  EXPECT_FALSE(unlike_other_parameters(trial, 5e-9, 2e-9));
}

// Before: "100 % of the records judge nothing", and then that data of no part had agreed.
TEST(Verdict, SaysWhoJudgedWhereTheOtherRecordsCouldNot) {
  EXPECT_EQ(about_reach(0.001, HeldOut::kRecords), "");
  EXPECT_NE(about_reach(0.3, HeldOut::kRecords).find("30 % of the records"), std::string::npos);
  const std::string none = about_reach(1.0, HeldOut::kBlocks);
  EXPECT_EQ(none.find('%'), std::string::npos) << none;
  EXPECT_NE(none.find("parts of this record were kept back in their place"), std::string::npos);
}

// A trial that named both, and the names that a record of `truth` refutes.
std::vector<std::string> refuted_on(const twin::Model& truth) {
  const twin::Model known = test::lab_model();
  Trial trial{.repaired = test::with(test::with(known, field()), tilt())};
  trial.effects = {{.name = "magnetic"}, {.name = "acceleration_sensitivity"}, {.name = "markov"}};
  const MeasuredSeries series = test::simulated(truth, test::chamber_profile(), 12);
  const Playback playback(series);
  Split split{.kind = HeldOut::kRecords};
  split.held_out.push_back({&series, &playback, series.valid[0]});
  return refuted_names(known, trial, split, kX);
}

using Names = std::vector<std::string>;

TEST(Refutation, IsOfTheNamesThatHeldOutDataSpeakAgainst) {
  const twin::Model known = test::lab_model();
  EXPECT_EQ(refuted_on(test::with(known, field())), Names{"acceleration_sensitivity"});
  EXPECT_EQ(refuted_on(test::with(known, tilt())), Names{"magnetic"});
}

TEST(Refutation, OfAllNamesWhereHeldOutDataSpeakAgainstNoneOfThemAlone) {
  const twin::Model both = test::with(test::with(test::lab_model(), field()), tilt());
  EXPECT_EQ(refuted_on(both), (Names{"magnetic", "acceleration_sensitivity"}));
}

// What the record says against a second answer counts as much as what held-out data say for it.
TEST(Refutation, LetsAnotherAnswerStandThatIsLikelierByAllData) {
  const twin::Model known = test::lab_model();
  const MeasuredSeries series =
      test::simulated(test::with(known, tilt()), test::chamber_profile(), 12);
  const Playback playback(series);
  Split split{.kind = HeldOut::kRecords};
  split.held_out.push_back({&series, &playback, series.valid[0]});
  Trial first{.repaired = test::with(known, field())};
  Trial second{.repaired = test::with(known, tilt())};
  const double for_it =
      likelier_by_nats(split.held_out, known, second.repaired, first.repaired, kX);
  ASSERT_GT(for_it, 10.0);
  second.log_evidence = 20.0;
  first.log_evidence = 20.0 + 0.9 * for_it;
  EXPECT_TRUE(outweighs(second, first, known, split, kX));
  first.log_evidence = 20.0 + 1.1 * for_it;
  EXPECT_FALSE(outweighs(second, first, known, split, kX));
  second.unknown = UnknownEffect{};
  EXPECT_TRUE(outweighs(second, first, known, split, kX));
}

TEST(Refutation, LeavesSomethingUnknownThatLooksLikeTheNames) {
  Trial trial;
  trial.effects = {{.name = "magnetic", .alternatives = {{.name = "line"}}, .share_of_gap = 9e-18},
                   {.name = "markov", .share_of_gap = 1.0},
                   {.name = "shupe", .share_of_gap = 16e-18}};
  const auto unknown = unknown_like(trial);
  ASSERT_TRUE(unknown);
  EXPECT_EQ(unknown->description,
            "on this record it looks like magnetic (or line) and shupe, which held-out data speak "
            "against");
  EXPECT_NEAR(unknown->rms_radps, 5e-9, 1e-15);
  trial.effects.clear();
  EXPECT_FALSE(unknown_like(trial));
}

TEST(Refutation, LeavesSomethingUnknownThatLooksLikeNoiseWhereNoiseAloneWasNamed) {
  Trial trial;
  trial.effects = {{.name = "markov", .share_of_gap = 1.0}};
  const auto unknown = unknown_like(trial);
  ASSERT_TRUE(unknown);
  EXPECT_EQ(unknown->description,
            "on this record it looks like markov, which held-out data speak against");
  EXPECT_TRUE(std::isnan(unknown->rms_radps));
}

TEST(Refutation, IsAnsweredByNamesAndShapesAndNotByABiasOrItsNoise) {
  Trial trial;
  trial.recalibrated = {{.name = "bias"}, {.name = "angle_random_walk"}};
  EXPECT_FALSE(answers(trial));
  trial.recalibrated.push_back({.name = "shupe"});
  EXPECT_TRUE(answers(trial));
  trial.recalibrated.clear();
  trial.effects = {{.name = "markov"}};
  EXPECT_TRUE(answers(trial));
}

// Nobody turned a field on over the record that was kept back: it says nothing of a sensitivity to
// one, and blocks of the first record do.
TEST(DiagnosisScenario, ARecordThatWouldNotShowAnEffectDoesNotSpeakAgainstIt) {
  const twin::Model given = test::lab_model();
  const twin::Model truth = test::with(given, field());
  const MeasuredSeries record = test::simulated(truth, test::chamber_profile(), 11);
  for (const std::uint64_t seed : {12U, 13U}) {
    MeasuredSeries other = test::simulated(given, test::chamber_profile(), seed);
    for (auto& component : other.magnetic_ut) std::fill(component.begin(), component.end(), 0.0);
    const AxisDiagnosis axis = *diagnose(given, record, {other}, kOptions).axes[0];
    ASSERT_EQ(axis.effects.size(), 1U) << axis.sentence;
    EXPECT_EQ(axis.effects[0].name, "magnetic");
    EXPECT_EQ(axis.acceptance, Acceptance::kAccepted) << axis.sentence;
    if (axis.held_out_kind == HeldOut::kRecords) continue;  // by luck, a little likelier
    EXPECT_NE(axis.sentence.find("would not show what is found here"), std::string::npos)
        << axis.sentence;
  }
}

// Before: a rectified vibration, a clock's offset and others of motion were "unknown", since the
// two blocks that were kept back had none of it.
TEST(DiagnosisScenario, BlocksWithoutTheInputOfAnEffectDoNotSpeakAgainstIt) {
  const twin::Model given = test::lab_model();
  MeasuredSeries record = test::simulated(test::with(given, field()), test::chamber_profile(), 11);
  const MeasuredSeries without = test::simulated(given, test::chamber_profile(), 11);
  for (const std::size_t block : {3U, 7U}) {
    for (std::size_t i = record.size * block / 10; i < record.size * (block + 1) / 10; ++i) {
      record.rate_radps[0][i] = without.rate_radps[0][i];
      for (auto& component : record.magnetic_ut) component[i] = 0.0;
    }
  }
  const AxisDiagnosis axis = *diagnose(given, record, {}, kOptions).axes[0];
  ASSERT_EQ(axis.effects.size(), 1U) << axis.sentence;
  EXPECT_EQ(axis.effects[0].name, "magnetic");
  EXPECT_EQ(axis.held_out_kind, HeldOut::kBlocks);
  EXPECT_EQ(axis.acceptance, Acceptance::kAccepted) << axis.sentence;
  EXPECT_EQ(axis.sentence.find("other records"), std::string::npos) << axis.sentence;
}

// A field at the record's beginning alone: no block between its ends would show it, and the other
// record has none.
TEST(DiagnosisScenario, WhatNothingWouldShowIsUndecidableAndTakesNoCalibrationWithIt) {
  const twin::Model listed = test::lab_model();
  MeasuredSeries record = test::simulated(test::with(listed, field()), test::chamber_profile(), 11);
  const MeasuredSeries without = test::simulated(listed, test::chamber_profile(), 11);
  MeasuredSeries other = test::simulated(listed, test::chamber_profile(), 12);
  for (auto& component : other.magnetic_ut) std::fill(component.begin(), component.end(), 0.0);
  for (std::size_t i = record.size / kBlocks; i < record.size; ++i) {
    record.rate_radps[0][i] = without.rate_radps[0][i];
    for (auto& component : record.magnetic_ut) component[i] = 0.0;
  }
  const Diagnosis given = diagnose(listed, record, {other}, kOptions);
  const AxisDiagnosis& axis = *given.axes[0];
  EXPECT_EQ(axis.acceptance, Acceptance::kUnproven);
  EXPECT_EQ(axis.verdict, Verdict::kUndecidable) << axis.sentence;
  EXPECT_NE(axis.sentence.find("Another record in which it would show"), std::string::npos)
      << axis.sentence;
  EXPECT_EQ(given.repaired.effects.size(), listed.effects.size());
  const Diagnosis kinds = diagnose(test::kinds_of(listed), record, {other}, kOptions);
  EXPECT_EQ(kinds.axes[0]->acceptance, Acceptance::kAccepted) << kinds.axes[0]->sentence;
  EXPECT_FALSE(kinds.axes[0]->unknown) << kinds.axes[0]->sentence;
  const auto shupe =
      std::find_if(kinds.repaired.effects.begin(), kinds.repaired.effects.end(),
                   [](const auto& effect) { return effect.kind == "shupe" && effect.axis == kX; });
  ASSERT_NE(shupe, kinds.repaired.effects.end());
  ASSERT_FALSE(shupe->parameters.empty()) << kinds.axes[0]->sentence;
  EXPECT_NEAR(shupe->parameters.at("coefficient_deg_h_min_per_degc"), 0.9, 0.1);
}

// Law: what is significant in a record and is not in the one that was kept back is neither "nothing
// is missing" nor an effect of that name.
void expect_what_is_in_one_record_alone_to_be_unknown(const twin::Model& given) {
  const twin::Model truth = test::lab_model();
  const MeasuredSeries other = test::simulated(truth, test::chamber_profile(), 12);
  const std::vector<twin::EffectSpec> hidden{
      field(),
      {.kind = "noise_temperature", .axis = kX, .parameters = {{"growth_per_degc", 0.04}}},
      {.kind = "hysteresis", .axis = kX, .parameters = {{"k1_deg_h_per_degc", -0.05}}},
      {.kind = "warm_up",
       .axis = kX,
       .parameters = {{"amplitude_deg_h", 0.3}, {"tau_s", 1800.0}, {"exponent", 1.0}}}};
  for (const twin::EffectSpec& effect : hidden) {
    const MeasuredSeries record =
        test::simulated(test::with(truth, effect), test::chamber_profile(), 11);
    const AxisDiagnosis axis = *diagnose(given, record, {other}, kOptions).axes[0];
    EXPECT_EQ(axis.verdict, Verdict::kUnknownEffect) << effect.kind << ": " << axis.sentence;
    EXPECT_TRUE(axis.effects.empty()) << effect.kind << ": " << axis.sentence;
  }
}

TEST(DiagnosisScenario, WhatIsInOneRecordAloneIsNeitherNamedNorNothing) {
  expect_what_is_in_one_record_alone_to_be_unknown(test::lab_model());
}

// Before: "No effect is missing", as a bias and the noise's size were fitted beside it.
TEST(DiagnosisScenario, WhatIsInOneRecordAloneIsNotNothingBesideKindsAlone) {
  expect_what_is_in_one_record_alone_to_be_unknown(test::kinds_of(test::lab_model()));
}

// Law: what fits one record with other parameters, and not the next one, is no consistency.
TEST(DiagnosisScenario, ParametersThatChangeFromRecordToRecordAreSomethingUnknown) {
  const twin::Model given = test::lab_model();
  twin::Model once = given;
  for (twin::EffectSpec& effect : once.effects) {
    if (effect.kind == "bias_temperature") effect.parameters["c1_deg_h_per_degc"] = 0.03;
  }
  const MeasuredSeries record = test::simulated(once, test::chamber_profile(), 11);
  const MeasuredSeries other = test::simulated(given, test::chamber_profile(), 12);
  const AxisDiagnosis axis = *diagnose(given, record, {other}, kOptions).axes[0];
  EXPECT_EQ(axis.verdict, Verdict::kUnknownEffect) << axis.sentence;
  EXPECT_NE(axis.sentence.find("other parameters of bias_temperature, which held-out data speak "
                               "against"),
            std::string::npos)
      << axis.sentence;
}

TEST(DiagnosisScenario, WhatOnlyTheOtherRecordShowsIsUndecidable) {
  const twin::Model given = test::lab_model();
  const MeasuredSeries record = test::simulated(given, test::chamber_profile(), 11);
  const MeasuredSeries other = test::simulated(
      test::with(given, {.kind = "magnetic", .axis = kX, .parameters = {{"x_deg_h_per_ut", 3e-3}}}),
      test::chamber_profile(), 12);
  const AxisDiagnosis axis = *diagnose(given, record, {other}, kOptions).axes[0];
  EXPECT_EQ(axis.verdict, Verdict::kUndecidable) << axis.sentence;
  EXPECT_NE(axis.sentence.find("the records for validation differ from the twin by"),
            std::string::npos)
      << axis.sentence;
}

// Either is named for the other where it has to explain both: a wandering drift hides the line, and
// looks like effects of slow inputs.
TEST(DiagnosisScenario, NoiseAndAnEffectThatItHidesAreBothNamed) {
  const twin::Model given = test::without(test::lab_model(), "rate_random_walk");
  const twin::Model wandering =
      test::with(given, {.kind = "rate_random_walk",
                         .axis = kX,
                         .parameters = {{"coefficient_deg_per_h_1_5", 0.12}}});
  const std::vector<twin::EffectSpec> hidden{
      {.kind = "magnetic", .axis = kX, .parameters = {{"x_deg_h_per_ut", 1e-3}}},
      {.kind = "line",
       .axis = kX,
       .parameters = {{"amplitude_deg_h", 0.01}, {"frequency_hz", 0.088}}}};
  for (const twin::EffectSpec& effect : hidden) {
    const twin::Model truth = test::with(wandering, effect);
    const MeasuredSeries record = test::simulated(truth, test::chamber_profile(), 11);
    const MeasuredSeries other = test::simulated(truth, test::chamber_profile(), 12);
    const AxisDiagnosis axis = *diagnose(given, record, {other}, kOptions).axes[0];
    std::vector<std::string> names;
    for (const NamedEffect& found : axis.effects) names.push_back(found.name);
    std::sort(names.begin(), names.end());
    EXPECT_EQ(names, (Names{effect.kind, "rate_random_walk"})) << axis.sentence;
  }
}

}  // namespace
}  // namespace zerodrift::diagnosis
