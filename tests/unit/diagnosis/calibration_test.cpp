// SPDX-License-Identifier: Apache-2.0
// Models that list what a gyro has without saying how much of it: calibrated first, then diagnosed.
#include "common/diagnosis/calibration.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "common/diagnosis/axis_result.h"
#include "common/diagnosis/diagnosis.h"
#include "common/diagnosis/known_effects.h"
#include "common/diagnosis/playback.h"
#include "common/twin/effect_catalogue.h"
#include "tests/unit/diagnosis/simulated_series.h"

namespace zerodrift::diagnosis {
namespace {

constexpr core::Axis kX = core::Axis::kX;
const DiagnosisOptions kOptions{.record = "simulated", .date = "2026-01-01"};

using test::kinds_of;

const twin::EffectSpec& effect_in(const twin::Model& model, const std::string& kind) {
  return *std::find_if(model.effects.begin(), model.effects.end(),
                       [&](const auto& effect) { return effect.kind == kind; });
}

struct Answer {
  AxisDiagnosis axis;
  twin::Model repaired;
};

// A record of one truth, proved on another record.
Answer answer(const twin::Model& given, const twin::Model& truth, const twin::Model& elsewhere) {
  const MeasuredSeries record = test::simulated(truth, test::chamber_profile(), 11);
  const MeasuredSeries other = test::simulated(elsewhere, test::chamber_profile(), 12);
  Diagnosis diagnosis = diagnose(given, record, {other}, kOptions);
  return {*diagnosis.axes[0], std::move(diagnosis.repaired)};
}

Answer answer(const twin::Model& given, const twin::Model& truth) {
  return answer(given, truth, truth);
}

// Law: new parameters are told as the repaired model has them. Before: a slow noise that stood in
// the place of what was found later, and that the model no longer has.
TEST(CalibrationLaws, OnlyWhatTheModelHasInTheEndIsToldAsChanged) {
  twin::Model model;
  model.effects = {{.kind = "bias", .axis = kX, .parameters = {{"bias_deg_h", 2.0}}},
                   {.kind = "shupe",
                    .axis = kX,
                    .parameters = {{"coefficient_deg_h_min_per_degc", 0.9}},
                    .standard_errors = {{"coefficient_deg_h_min_per_degc", 0.1}}},
                   {.kind = "rate_random_walk", .axis = kX},
                   {.kind = "rate_random_walk",
                    .axis = core::Axis::kY,
                    .parameters = {{"coefficient_deg_per_h_1_5", 0.2}}}};
  std::vector<Recalibration> changes{
      {"bias", "bias_deg_h", 0.0, 2.0, 0.3},
      {"shupe", "coefficient_deg_h_min_per_degc", 0.0, 0.7, 0.2},
      {"rate_random_walk", "coefficient_deg_per_h_1_5", 0.0, 0.2, 0.1}};
  keep_what_stands(changes, model, kX);
  ASSERT_EQ(changes.size(), 2U);
  EXPECT_EQ(changes[0].to, 2.0);
  EXPECT_EQ(changes[0].standard_error, 0.3);
  EXPECT_EQ(changes[1].to, 0.9);
  EXPECT_EQ(changes[1].standard_error, 0.1);
}

// Law: no power is left out below one that stays. Before: of a line far from the temperature that
// powers are counted from the first was left out, and the second and third bent into its place.
TEST(CalibrationLaws, APowerStaysWhereAHigherOneDoes) {
  constexpr double kColderDegc = 60.0;
  const std::vector<std::string> powers{"c1_deg_h_per_degc", "c2_deg_h_per_degc2",
                                        "c3_deg_h_per_degc3", "c4_deg_h_per_degc4"};
  twin::Model truth = test::lab_model();
  for (twin::EffectSpec& effect : truth.effects) {
    if (effect.kind == "bias_temperature") effect.parameters = {{powers[0], 0.012}};
  }
  twin::Profile colder = test::chamber_profile();
  colder.initial_temperature_degc -= kColderDegc;
  for (twin::ChamberPoint& point : colder.chamber) point.temperature_degc -= kColderDegc;
  colder.turns.clear();
  const twin::Model given = kinds_of(truth);
  for (const std::uint64_t seed : {11U, 12U, 13U, 14U}) {
    const MeasuredSeries record = test::simulated(truth, colder, seed);
    const Playback playback(record);
    const TrialInput input{given, record, playback, kX, record.valid[0], kOptions};
    const Calibration calibration = calibrate(input, Lags::kAtDefault);
    twin::Parameters found = effect_in(calibration.drift_alone, "bias_temperature").parameters;
    EXPECT_NE(found[powers[0]], 0.0) << seed;
    for (std::size_t i = 1; i < powers.size(); ++i) EXPECT_EQ(found[powers[i]], 0.0) << seed;
  }
}

// Law: the bias states what it scatters by: here as much by the slope's error, as the record is
// warmer than the temperature that the slope is counted from, as by the noise of the mean. Before:
// 11 times that were told, and nothing was in the model. The rms of twelve normal numbers is within
// .43 and 1.66 but for two times in a thousand.
TEST(CalibrationLaws, ABiasStatesWhatItScattersBy) {
  constexpr int kRecords = 12;
  twin::Model truth = test::lab_model();
  std::erase_if(truth.effects, [](const twin::EffectSpec& effect) {
    return effect.kind == "shupe" || effect.kind == "bias_instability" ||
           effect.kind == "rate_random_walk";
  });
  const double bias_deg_h = effect_in(truth, "bias").parameters.at("bias_deg_h");
  const twin::Model given = kinds_of(truth);
  double squares = 0.0;
  for (int i = 0; i < kRecords; ++i) {
    const MeasuredSeries record =
        test::simulated(truth, test::chamber_profile(), 500U + static_cast<std::uint64_t>(i));
    const Playback playback(record);
    const TrialInput input{given, record, playback, kX, record.valid[0], kOptions};
    Trial trial = calibrate(input, Lags::kAtDefault).trial;
    twin::Model repaired;
    hand_over(trial, input, repaired);
    const twin::EffectSpec& bias = effect_in(repaired, "bias");
    ASSERT_TRUE(bias.standard_errors.contains("bias_deg_h")) << i;
    const double error = bias.standard_errors.at("bias_deg_h");
    const auto told = std::find_if(trial.recalibrated.begin(), trial.recalibrated.end(),
                                   [](const auto& change) { return change.name == "bias"; });
    ASSERT_NE(told, trial.recalibrated.end());
    EXPECT_EQ(told->standard_error, error);
    squares += std::pow((bias.parameters.at("bias_deg_h") - bias_deg_h) / error, 2.0);
  }
  const double rms = std::sqrt(squares / kRecords);
  EXPECT_GT(rms, 0.43);
  EXPECT_LT(rms, 1.66);
}

// Law: a bias that was moved and not fitted is as uncertain as the model says.
TEST(CalibrationLaws, ABiasThatWasNotFittedKeepsItsError) {
  constexpr double kStated = 0.02;
  twin::Model truth = test::lab_model();
  for (twin::EffectSpec& effect : truth.effects) {
    if (effect.kind == "bias") effect.standard_errors = {{"bias_deg_h", kStated}};
  }
  const MeasuredSeries record = test::simulated(truth, test::chamber_profile(), 500);
  const Playback playback(record);
  const TrialInput input{truth, record, playback, kX, record.valid[0], kOptions};
  Trial trial{.repaired = truth};
  trial.noise_dct_variances.assign(record.size, 1.0);
  trial.recalibrated = {shift_bias(trial.repaired, kX, 1e-8)};
  twin::Model repaired;
  hand_over(trial, input, repaired);
  EXPECT_EQ(effect_in(repaired, "bias").standard_errors.at("bias_deg_h"), kStated);
  EXPECT_EQ(trial.recalibrated.front().standard_error, kStated);
}

// Within five of its own standard errors.
void expect_found(const twin::Model& repaired, const std::string& kind,
                  const std::string& parameter, double truth) {
  const twin::EffectSpec& spec = effect_in(repaired, kind);
  ASSERT_TRUE(spec.parameters.contains(parameter)) << kind << "." << parameter;
  const auto error = spec.standard_errors.find(parameter);
  ASSERT_NE(error, spec.standard_errors.end()) << kind << "." << parameter;
  EXPECT_NEAR(spec.parameters.at(parameter), truth, 5.0 * error->second) << kind;
}

TEST(CalibrationScenario, KindsAloneGetTheirCoefficientsAndNothingIsMissing) {
  const twin::Model truth = test::lab_model();
  const Answer found = answer(kinds_of(truth), truth);
  EXPECT_EQ(found.axis.verdict, Verdict::kRecalibrated) << found.axis.sentence;
  EXPECT_EQ(found.axis.acceptance, Acceptance::kAccepted);
  expect_found(found.repaired, "shupe", "coefficient_deg_h_min_per_degc", 0.9);
  expect_found(found.repaired, "scale_factor", "error_ppm", 60.0);
  expect_found(found.repaired, "bias_temperature", "c1_deg_h_per_degc", 0.012);
  const twin::EffectSpec& polynomial = effect_in(found.repaired, "bias_temperature");
  EXPECT_EQ(polynomial.parameters.at("lag_s"), 0.0);
  EXPECT_LT(found.axis.held_out.after_rms_radps, 0.3 * found.axis.held_out.before_rms_radps);
}

twin::EffectSpec formula(const std::string& text, const twin::Parameters& parameters) {
  return {.kind = "formula", .axis = kX, .parameters = parameters, .formula = text};
}

// Two of them on one axis, and each gets its own.
TEST(CalibrationScenario, FormulasListedWithoutValuesGetThem) {
  constexpr double kProduct = 5e-5;  // deg/h per degC uT
  constexpr double kSquare = 2e-3;   // deg/h per (m/s^2)^2
  const std::string product = "k * (T_board - 20) * B_x";
  const std::string square = "k * a_z^2";
  const twin::Model given = test::lab_model();
  const twin::Model truth = test::with(test::with(given, formula(product, {{"k", kProduct}})),
                                       formula(square, {{"k", kSquare}}));
  const twin::Model listed =
      test::with(test::with(given, formula(product, {})), formula(square, {}));
  const Answer found = answer(listed, truth);
  EXPECT_EQ(found.axis.verdict, Verdict::kRecalibrated) << found.axis.sentence;
  EXPECT_EQ(found.axis.acceptance, Acceptance::kAccepted);
  const std::size_t first = given.effects.size();
  ASSERT_EQ(found.repaired.effects.size(), first + 2);
  for (const auto& [place, value] : {std::pair{first, kProduct}, std::pair{first + 1, kSquare}}) {
    const twin::EffectSpec& spec = found.repaired.effects[place];
    ASSERT_TRUE(spec.parameters.contains("k")) << spec.formula;
    EXPECT_NEAR(spec.parameters.at("k"), value, 5.0 * spec.standard_errors.at("k"));
    EXPECT_GT(value, 5.0 * spec.standard_errors.at("k")) << "there must be something to find";
  }
  EXPECT_TRUE(found.repaired.validate() == std::nullopt);
}

TEST(CalibrationScenario, AWrongFactorOfAFormulaIsRecalibrated) {
  const std::string text = "k * (T_board - 20) * B_x";
  const twin::Model given = test::with(test::lab_model(), formula(text, {{"k", 2e-5}}));
  const twin::Model truth = test::with(test::lab_model(), formula(text, {{"k", 5e-5}}));
  const Answer found = answer(given, truth);
  EXPECT_EQ(found.axis.verdict, Verdict::kRecalibrated) << found.axis.sentence;
  const twin::EffectSpec& spec = found.repaired.effects.back();
  EXPECT_NEAR(spec.parameters.at("k"), 5e-5, 5.0 * spec.standard_errors.at("k"));
}

TEST(CalibrationAbuse, WhatIsFittedStaysWithinTheLimitsOfItsEffect) {
  // Ten times the rate: beyond any error of a scale factor that a model may have.
  MeasuredSeries record = test::simulated(test::lab_model(), test::chamber_profile(), 11);
  for (std::size_t i = 0; i < record.size; ++i)
    record.rate_radps[0][i] += 9.0 * record.reference_radps[0][i];
  const Diagnosis found = diagnose(kinds_of(test::lab_model()), record, {}, kOptions);
  EXPECT_FALSE(found.repaired.validate().has_value()) << *found.repaired.validate();
}

// A lag of the polynomial would take the place of what is missing.
TEST(CalibrationScenario, WhatIsMissingBesideKindsAloneIsNamedAndNoLagStandsInForIt) {
  const twin::Model truth = test::lab_model();
  const Answer found = answer(kinds_of(test::without(truth, "shupe")), truth);
  ASSERT_EQ(found.axis.effects.size(), 1U) << found.axis.sentence;
  EXPECT_EQ(found.axis.effects[0].name, "shupe");
  expect_found(found.repaired, "shupe", "coefficient_deg_h_min_per_degc", 0.9);
}

TEST(CalibrationScenario, ALagThatAListedEffectHasIsFoundAndNothingIsMissing) {
  twin::Model truth = test::without(test::lab_model(), "shupe");
  for (twin::EffectSpec& effect : truth.effects) {
    if (effect.kind != "bias_temperature") continue;
    effect.parameters["c1_deg_h_per_degc"] = 0.06;
    effect.parameters["lag_s"] = 1200.0;
  }
  const Answer found = answer(kinds_of(truth), truth);
  EXPECT_TRUE(found.axis.effects.empty()) << found.axis.sentence;
  EXPECT_FALSE(found.axis.unknown) << found.axis.sentence;
  // Which of the coil's thermometers it reads goes with the lag: 28 min behind the outer layers is
  // 20 behind the middle.
  const twin::EffectSpec& polynomial = effect_in(found.repaired, "bias_temperature");
  EXPECT_NEAR(polynomial.parameters.at("lag_s"), 1200.0, 600.0);
}

// Each shape is looked for beside all other effects, from several starts.
TEST(CalibrationScenario, TheShapeOfAListedEffectIsFoundBesideTheOthers) {
  const twin::Model truth =
      test::with(test::lab_model(),
                 {.kind = "warm_up",
                  .axis = kX,
                  .parameters = {{"amplitude_deg_h", 0.5}, {"tau_s", 600.0}, {"exponent", 1.0}}});
  const Answer found = answer(kinds_of(truth), truth);
  EXPECT_TRUE(found.axis.effects.empty()) << found.axis.sentence;
  EXPECT_FALSE(found.axis.unknown) << found.axis.sentence;
  const twin::EffectSpec& warm_up = effect_in(found.repaired, "warm_up");
  EXPECT_NEAR(warm_up.parameters.at("amplitude_deg_h"), 0.5, 0.1);
  EXPECT_NEAR(warm_up.parameters.at("tau_s"), 600.0, 120.0);
}

TEST(CalibrationScenario, ComponentsWithoutEvidenceStayZero) {
  const twin::Model truth =
      test::with(test::lab_model(),
                 {.kind = "magnetic", .axis = kX, .parameters = {{"x_deg_h_per_ut", 2e-3}}});
  const Answer found = answer(kinds_of(truth), truth);
  expect_found(found.repaired, "magnetic", "x_deg_h_per_ut", 2e-3);
  const twin::EffectSpec& field = effect_in(found.repaired, "magnetic");
  for (const char* absent : {"y_deg_h_per_ut", "z_deg_h_per_ut"}) {
    EXPECT_EQ(field.parameters.at(absent), 0.0) << absent;
    EXPECT_FALSE(field.standard_errors.contains(absent)) << absent;
  }
}

TEST(CalibrationScenario, ANameThatIsRevertedTakesNoCalibrationWithIt) {
  const twin::Model listed = test::lab_model();
  const twin::Model truth = test::with(
      listed, {.kind = "magnetic", .axis = kX, .parameters = {{"x_deg_h_per_ut", 2e-3}}});
  const Answer found = answer(kinds_of(listed), truth, listed);
  EXPECT_TRUE(found.axis.effects.empty()) << found.axis.sentence;
  EXPECT_NE(found.axis.sentence.find("looks like magnetic"), std::string::npos)
      << found.axis.sentence;
  EXPECT_EQ(found.axis.acceptance, Acceptance::kAccepted);
  expect_found(found.repaired, "shupe", "coefficient_deg_h_min_per_degc", 0.9);
}

// Before: a polynomial that was fitted in the warm refuted itself in the cold, and all else with
// it.
TEST(CalibrationScenario, WhatAnotherRecordSaysElsewhereIsNoJudge) {
  const twin::Model listed = test::lab_model();
  const twin::Model truth = test::with(
      listed, {.kind = "magnetic", .axis = kX, .parameters = {{"x_deg_h_per_ut", 2e-3}}});
  twin::Profile colder = test::chamber_profile();
  colder.initial_temperature_degc -= 40.0;
  for (twin::ChamberPoint& point : colder.chamber) point.temperature_degc -= 40.0;
  const MeasuredSeries record = test::simulated(truth, test::chamber_profile(), 11);
  const MeasuredSeries other = test::simulated(truth, colder, 12);
  const AxisDiagnosis axis = *diagnose(kinds_of(listed), record, {other}, kOptions).axes[0];
  // In three of five records a second name stands beside it.
  ASSERT_FALSE(axis.effects.empty()) << axis.sentence;
  EXPECT_EQ(axis.effects[0].name, "magnetic");
  EXPECT_FALSE(axis.unknown) << axis.sentence;
  EXPECT_NE(axis.sentence.find("at temperatures that it did not reach: they judge nothing"),
            std::string::npos)
      << axis.sentence;
}

// Before: it became an effect that the model lacks, with probability .96.
TEST(CalibrationScenario, AListedEffectIsNoOtherOneThatIsMissing) {
  const twin::Model truth = test::lab_model();
  twin::Model given = truth;
  for (twin::EffectSpec& effect : given.effects) {
    if (effect.kind == "scale_factor") effect.parameters.clear();
  }
  const Answer found = answer(given, truth);
  EXPECT_TRUE(found.axis.effects.empty()) << found.axis.sentence;
  EXPECT_FALSE(found.axis.unknown) << found.axis.sentence;
  expect_found(found.repaired, "scale_factor", "error_ppm", 60.0);
}

// Before: a bump that the catalogue doesn't know.
TEST(CalibrationScenario, ACoefficientThatAListedEffectLacksIsFound) {
  const twin::Model given = test::lab_model();
  twin::Model truth = given;
  for (twin::EffectSpec& effect : truth.effects) {
    if (effect.kind == "bias_temperature") effect.parameters["c4_deg_h_per_degc4"] = 3e-5;
  }
  const Answer found = answer(given, truth);
  EXPECT_EQ(found.axis.verdict, Verdict::kRecalibrated) << found.axis.sentence;
  expect_found(found.repaired, "bias_temperature", "c4_deg_h_per_degc4", 3e-5);
}

}  // namespace
}  // namespace zerodrift::diagnosis
