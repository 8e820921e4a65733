// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/next_experiment.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "common/diagnosis/candidates.h"
#include "common/diagnosis/cosine_transform.h"
#include "common/diagnosis/gap.h"
#include "common/diagnosis/playback.h"
#include "common/twin/effect_catalogue.h"
#include "tests/unit/diagnosis/simulated_series.h"

namespace zerodrift::diagnosis {
namespace {

constexpr core::Axis kX = core::Axis::kX;

// The laboratory gyro with nothing but its bias and its noise.
twin::Model plain_model() {
  twin::Model model = test::lab_model();
  for (const char* kind : {"bias_temperature", "shupe", "scale_factor"})
    model = test::without(model, kind);
  return model;
}

NamedEffect named(const std::string& kind, std::map<std::string, double> parameters,
                  const std::string& rival) {
  NamedEffect effect;
  effect.name = kind;
  effect.parameters = std::move(parameters);
  const auto* definition = twin::find_effect(kind);
  if (definition != nullptr) {
    for (const auto point : definition->inputs) effect.inputs.emplace_back(twin::name(point));
  }
  if (!rival.empty()) effect.alternatives = {{rival, 0.3}};
  return effect;
}

AxisDiagnosis confused(const NamedEffect& effect) {
  AxisDiagnosis diagnosis;
  diagnosis.effects = {effect};
  return diagnosis;
}

std::string answer(const NamedEffect& effect, const twin::Model& model = plain_model()) {
  return next_experiment(model, kX, confused(effect));
}

// "... (they would be 12 standard errors apart)."; -1 where there is none.
double standard_errors_in(const std::string& text) {
  const std::string before = "they would be ";
  const auto at = text.find(before);
  return at == std::string::npos ? -1.0 : std::stod(text.substr(at + before.size()));
}

const std::vector<std::string> kMenu{
    "switching on and four hours at constant temperature",
    "slow ramps up and down over the same temperatures",
    "fast ramps up and down with soaks",
    "small temperature cycles",
    "a rate table at constant temperature",
    "a rate table while the temperature ramps",
    "blocks of magnetic field, tilt, vibration and source current at constant temperature"};

int menu_entries_in(const std::string& text) {
  return static_cast<int>(std::count_if(kMenu.begin(), kMenu.end(), [&](const std::string& entry) {
    return text.find(entry) != std::string::npos;
  }));
}

// How far apart the record holds the two: norm of the effect, whitened by the model's noise, that
// is left beside the nearest variant of the rival.
double separation_in(const MeasuredSeries& series, const twin::Model& model,
                     const NamedEffect& effect, const std::string& rival) {
  const Playback playback(series);
  const auto variances = model_noise(model, kX, series.interval_s, series.size);
  CosineTransform transform(series.size);
  const auto whitened = [&](const std::vector<double>& column) {
    Eigen::VectorXd c = transform.forward(column);
    for (Eigen::Index k = 1; k < c.size(); ++k)
      c(k) /= std::sqrt(variances[static_cast<std::size_t>(k)]);
    c(0) = 0.0;
    return c;
  };
  const twin::EffectSpec spec{
      .kind = effect.name, .axis = kX, .parameters = effect.parameters, .inputs = effect.inputs};
  const auto& definition = *twin::find_effect(effect.name);
  const Eigen::VectorXd found =
      whitened(playback.run(definition, context_of(spec, definition, series.interval_s)));
  double nearest = found.norm();
  for (const Candidate& candidate : candidates(series, playback, model, kX, {}).testable) {
    if (candidate.definition->kind != rival) continue;
    for (const Variant& variant : candidate.variants) {
      const auto columns = columns_of(playback, *candidate.definition,
                                      context_of(candidate, variant, series.interval_s));
      Eigen::MatrixXd x(found.size(), static_cast<Eigen::Index>(columns.size()));
      for (std::size_t c = 0; c < columns.size(); ++c)
        x.col(static_cast<Eigen::Index>(c)) = whitened(columns[c]).normalized();
      nearest = std::min(nearest, (found - x * x.colPivHouseholderQr().solve(found)).norm());
    }
  }
  return nearest;
}

// Three hours of one slow ramp, and a turn about an axis between x and y.
MeasuredSeries poor_record() {
  twin::Profile profile;
  profile.duration_s = 10800.0;
  profile.initial_temperature_degc = 20.0;
  profile.power_on_s = -14400.0;
  profile.chamber = {{0.0, 20.0}, {10800.0, 40.0}};
  for (const core::Axis axis : {core::Axis::kX, core::Axis::kY}) {
    for (const double start_s : {2000.0, 7000.0})
      profile.turns.push_back({.start_s = start_s,
                               .duration_s = 1000.0,
                               .axis = axis,
                               .rate_radps = 5.0 * core::kRadPerDeg,
                               .ramp_s = 5.0});
  }
  return test::simulated(plain_model(), profile, 1);
}

struct Confusion {
  NamedEffect effect;
  std::string expected;  // in the answer
};

std::vector<Confusion> confusions() {
  return {{named("coil_lag", {{"coefficient_deg_h_min_per_degc", 0.3}, {"tau_s", 600.0}}, "shupe"),
           "ramps"},
          {named("bias_temperature", {{"c1_deg_h_per_degc", 0.003}}, "rate_ramp"), "ramps"},
          {named("rate_ramp", {{"ramp_deg_per_h2", 0.03}}, "bias_temperature"), ""},
          {named("scale_factor", {{"error_ppm", 5.0}}, "misalignment"), "rate table"}};
}

// Rule: an event does not come again: what shows or doesn't is the other name.
TEST(NextExperimentScenario, AnEventIsToldFromWhatWouldComeAgain) {
  NamedEffect step = named("bias_step", {{"amplitude_deg_h", 0.1}, {"at_s", 4000.0}}, "");
  NamedEffect slope =
      named("bias_temperature", {{"reference_degc", 25.0}, {"c1_deg_h_per_degc", 0.01}}, "");
  const auto as_alternative = [](const NamedEffect& effect) {
    return Alternative{.name = effect.name,
                       .probability = 0.3,
                       .inputs = effect.inputs,
                       .parameters = effect.parameters};
  };
  NamedEffect event_first = step;
  event_first.alternatives = {as_alternative(slope)};
  NamedEffect event_last = slope;
  event_last.alternatives = {as_alternative(step)};
  for (const NamedEffect& effect : {event_first, event_last}) {
    const std::string text = answer(effect);
    EXPECT_EQ(text.find("To tell " + effect.name + " from " + effect.alternatives.front().name), 0U)
        << text;
    EXPECT_NE(text.find("(bias_temperature would stand out by "), std::string::npos) << text;
    EXPECT_NE(text.find("bias_step does not come again)"), std::string::npos) << text;
    EXPECT_EQ(menu_entries_in(text), 1) << text;
    EXPECT_NE(text.find("ramps"), std::string::npos) << text;
  }
}

TEST(NextExperimentScenario, ConfusedEffectsAreFartherApartInWhatIsProposedThanInTheRecord) {
  const twin::Model model = plain_model();
  const MeasuredSeries record = poor_record();
  for (const auto& [effect, expected] : confusions()) {
    const std::string& rival = effect.alternatives.front().name;
    const std::string text = answer(effect, model);
    const double before = separation_in(record, model, effect, rival);
    // The names and the figure, and one entry of the menu.
    EXPECT_EQ(text.rfind("To tell " + effect.name + " from " + rival + ": ", 0), 0U) << text;
    EXPECT_EQ(menu_entries_in(text), 1) << text;
    EXPECT_NE(text.find(expected), std::string::npos) << text;
    EXPECT_GT(standard_errors_in(text), 2.0 * before) << text;
  }
}

TEST(NextExperimentLaws, TheDistanceGrowsWithTheEffectAndFallsWithTheNoise) {
  const twin::Model model = plain_model();
  twin::Model noisy = model;
  for (twin::EffectSpec& effect : noisy.effects) {
    for (auto& [name, value] : effect.parameters) value *= effect.kind == "bias" ? 1.0 : 4.0;
  }
  const auto of_size = [](double ppm) {
    return named("scale_factor", {{"error_ppm", ppm}}, "misalignment");
  };
  const double once = standard_errors_in(answer(of_size(5.0), model));
  ASSERT_GT(once, 0.0);
  // Two figures are given: up to 5 % each. Ten times the effect in four times the noise.
  EXPECT_NEAR(standard_errors_in(answer(of_size(50.0), noisy)) / once, 2.5, 0.25);
}

TEST(NextExperimentLaws, EqualQuestionsGetEqualAnswers) {
  const Confusion confusion = confusions().back();
  EXPECT_EQ(answer(confusion.effect), answer(confusion.effect));
}

TEST(NextExperimentScenario, WhatIsCertainNeedsNoExperiment) {
  EXPECT_EQ(answer(named("scale_factor", {{"error_ppm", 50.0}}, "")), "");
}

// The first one that an experiment can tell is asked about.
TEST(NextExperimentScenario, WhatNoExperimentTellsIsPassedOver) {
  AxisDiagnosis diagnosis;
  diagnosis.effects = {named("markov", {{"sigma_deg_h", 0.05}}, "telegraph"),
                       named("scale_factor", {{"error_ppm", 5.0}}, "misalignment")};
  const std::string text = next_experiment(plain_model(), kX, diagnosis);
  EXPECT_EQ(text.rfind("To tell scale_factor from misalignment: ", 0), 0U) << text;
}

// In a record made while the gyro was tilted in the Earth's field the two look alike.
TEST(NextExperimentScenario, FieldTiltVibrationAndCurrentAreMovedIndependently) {
  struct Pair {
    std::string kind, parameter, rival;
    double value;
  };
  for (const Pair& pair : {Pair{"magnetic", "x_deg_h_per_ut", "acceleration_sensitivity", 1e-3},
                           Pair{"magnetic", "y_deg_h_per_ut", "acceleration_sensitivity", 1e-3},
                           Pair{"magnetic", "z_deg_h_per_ut", "source_intensity", 1e-3}}) {
    const auto& parameters = twin::find_effect(pair.kind)->parameters;
    ASSERT_TRUE(std::any_of(parameters.begin(), parameters.end(),
                            [&](const auto& p) { return p.name == pair.parameter; }));
    std::map<std::string, double> values;
    for (const auto& parameter : parameters) values[parameter.name] = 0.0;
    values[pair.parameter] = pair.value;
    const std::string text = answer(named(pair.kind, values, pair.rival));
    EXPECT_NE(text.find("blocks of magnetic field"), std::string::npos)
        << pair.parameter << " or " << pair.rival << ": " << text;
    // .1 deg/h in half of the blocks, .06 deg/h in a second, 14400 of them: d = 100 and more before
    // the rival's three axes take their part.
    EXPECT_GT(standard_errors_in(text), 20.0) << pair.parameter << " or " << pair.rival;
  }
}

// Over 50 °C a fringe of 25 °C takes 6/(2 pi)² = 15 % of a slope's square: 8 % of its size, and
// more where it may be slower. A magnetic effect explains nothing of it: no experiment moves both.
TEST(NextExperimentLaws, ARivalWhosePeriodIsFreeExplainsSomething) {
  const NamedEffect slope = named("bias_temperature", {{"c1_deg_h_per_degc", 0.02}}, "magnetic");
  const double whole = standard_errors_in(answer(slope));
  ASSERT_GT(whole, 0.0);
  NamedEffect fringe = slope;
  fringe.alternatives = {{"etalon_fringe", 0.3}};
  EXPECT_LT(standard_errors_in(answer(fringe)), 0.96 * whole);
  EXPECT_GT(standard_errors_in(answer(fringe)), 0.0);
}

// What can't be run over an experiment may be near or far.
TEST(NextExperimentAbuse, ARivalThatIsNoWaveformGetsNoFigure) {
  for (const char* rival : {"none_such", "rate_random_walk"}) {
    EXPECT_EQ(answer(named("bias_temperature", {{"c1_deg_h_per_degc", 0.02}}, rival)), "") << rival;
  }
}

AxisDiagnosis untested(const std::vector<NotTestable>& effects) {
  AxisDiagnosis diagnosis;
  diagnosis.not_testable = effects;
  return diagnosis;
}

TEST(NextExperimentScenario, WhatTheRecordCouldNotTestGetsTheExperimentThatTestsMostOfIt) {
  const std::string text =
      next_experiment(plain_model(), kX,
                      untested({{"scale_factor", "no reference rate in the record"},
                                {"misalignment", "no reference rate in the record"},
                                {"magnetic", "no magnetic field in the record"}}));
  EXPECT_EQ(text.rfind("To test what this record could not: a rate table", 0), 0U) << text;
  EXPECT_NE(text.find("scale_factor, misalignment"), std::string::npos) << text;
  EXPECT_EQ(text.find("magnetic,"), std::string::npos) << text;
  EXPECT_EQ(menu_entries_in(text), 1) << text;
  const std::string surroundings = next_experiment(
      plain_model(), kX,
      untested({{"magnetic", ""}, {"vibration_rectification", ""}, {"source_intensity", ""}}));
  EXPECT_NE(surroundings.find("blocks of magnetic field"), std::string::npos) << surroundings;
}

// What is lacking is in the model, not in the record.
TEST(NextExperimentScenario, WhatNoExperimentMakesTestableIsNotPromised) {
  EXPECT_EQ(next_experiment(plain_model(), kX,
                            untested({{"sensor_lag",
                                       "the model has no bias_temperature that a "
                                       "thermometer could lag behind"}})),
            "");
}

TEST(NextExperimentAbuse, NamesThatNobodyKnowsAndEffectsOfNoSizeAreNoQuestion) {
  AxisDiagnosis diagnosis = untested({{"none_such", ""}});
  diagnosis.effects = {named("none_such", {}, "neither_such"),
                       named("scale_factor", {{"error_ppm", 0.0}}, "misalignment")};
  EXPECT_EQ(next_experiment(plain_model(), kX, diagnosis), "");
}

// Nothing to whiten by: no figure can be given.
TEST(NextExperimentAbuse, AModelWithoutNoiseGivesNoAbsurdFigure) {
  twin::Model quiet = plain_model();
  for (const char* kind : {"angle_random_walk", "bias_instability", "rate_random_walk"})
    quiet = test::without(quiet, kind);
  const std::string text =
      answer(named("scale_factor", {{"error_ppm", 5.0}}, "misalignment"), quiet);
  EXPECT_LT(standard_errors_in(text), 1e9) << text;
}

}  // namespace
}  // namespace zerodrift::diagnosis
