// SPDX-License-Identifier: Apache-2.0
// Noise that wanders follows any slow drift: what effects made must not be taken for it, and the
// other way round.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "common/core/units.h"
#include "common/diagnosis/diagnosis.h"
#include "common/diagnosis/noise_of_model.h"
#include "common/twin/effect_catalogue.h"
#include "tests/unit/diagnosis/simulated_series.h"

namespace zerodrift::diagnosis {
namespace {

constexpr core::Axis kX = core::Axis::kX;
const DiagnosisOptions kOptions{.record = "simulated", .date = "2026-01-01"};
constexpr auto kWalk = "rate_random_walk";
constexpr auto kCoefficient = "coefficient_deg_per_h_1_5";

twin::EffectSpec walk(std::map<std::string, double> parameters) {
  return {.kind = kWalk, .axis = kX, .parameters = std::move(parameters)};
}

struct Hidden {
  twin::Model given;
  twin::Model truth;
};

// Models that lack a random walk, state it, or list it without a value; what `hide` adds is the
// truth's alone.
template <typename F>
std::vector<Hidden> in_models(F&& hide) {
  const twin::Model quiet =
      test::without(test::without(test::lab_model(), kWalk), "bias_instability");
  const twin::Model stated = test::with(quiet, walk({{kCoefficient, 0.004}}));
  return {
      {quiet, hide(quiet)}, {stated, hide(stated)}, {test::with(quiet, walk({})), hide(stated)}};
}

// One slow ramp up and down: beside it a wandering noise explains nearly everything.
AxisDiagnosis on_one_ramp(const Hidden& hidden) {
  const twin::Profile ramp = config::load_profile(test::shipped("profiles/paper_chamber.yaml"));
  return *diagnose(hidden.given, test::simulated(hidden.truth, ramp, 21),
                   {test::simulated(hidden.truth, ramp, 22)}, kOptions)
              .axes[0];
}

TEST(SlowNoise, IsAllNoiseButWhiteRateAndWhiteAngle) {
  std::vector<std::string> slow;
  for (const twin::EffectDefinition& definition : twin::effect_catalogue()) {
    if (is_slow_noise(definition.kind)) slow.push_back(definition.kind);
  }
  std::sort(slow.begin(), slow.end());
  EXPECT_EQ(slow, (std::vector<std::string>{"bias_instability", "markov", "rate_random_walk",
                                            "telegraph"}));
  EXPECT_FALSE(is_slow_noise("k * T_coil"));
}

TEST(DiagnosisScenario, AnEffectThatGoesOnInAnotherRecordIsNoWanderingNoise) {
  const auto hide = [](const twin::Model& model) {
    return test::with(model, {.kind = "shupe_temperature",
                              .axis = kX,
                              .parameters = {{"coefficient_deg_h_min_per_degc2", 0.05}}});
  };
  for (const Hidden& hidden : in_models(hide)) {
    const AxisDiagnosis axis = on_one_ramp(hidden);
    ASSERT_FALSE(axis.effects.empty()) << axis.sentence;
    EXPECT_EQ(axis.effects[0].name, "shupe_temperature") << axis.sentence;
    EXPECT_LT(axis.held_out.after_rms_radps, 0.1 * axis.held_out.before_rms_radps);
  }
}

// A room through a day, some degrees up and down, with turns meanwhile.
twin::Profile day_with_turns() {
  twin::Profile day;
  day.duration_s = 12000.0;
  day.initial_temperature_degc = 22.0;
  for (double t = 0.0; t <= day.duration_s; t += 500.0) {
    const double sawtooth = 0.6 * (std::fmod(t / 1000.0, 1.0) - 0.5);
    day.chamber.push_back(
        {t, 22.0 + 4.0 * std::sin(2.0 * std::numbers::pi * t / 14000.0) + sawtooth});
  }
  const std::array rates_deg_s{0.5, -5.0, 2.0, -0.5, 10.0, -2.0, 5.0, -10.0};
  for (std::size_t i = 0; i < 28; ++i) {
    day.turns.push_back({.start_s = 200.0 + 400.0 * static_cast<double>(i),
                         .duration_s = 150.0,
                         .axis = kX,
                         .rate_radps = rates_deg_s[i % rates_deg_s.size()] * core::kRadPerDeg,
                         .ramp_s = 6.0});
  }
  return day;
}

// Slow noise of no stated size explains what a room's temperature does as well as the effects do
// that the owner lists; then what is missing is searched beside noise that isn't there.
TEST(DiagnosisScenario, WhatIsListedIsNoWanderingNoise) {
  const auto value = [](const std::string& kind, std::map<std::string, double> parameters) {
    return twin::EffectSpec{.kind = kind, .axis = kX, .parameters = std::move(parameters)};
  };
  twin::Model truth = test::lab_model();
  truth.effects = {
      value("bias", {{"bias_deg_h", 0.9}}),
      value("bias_temperature", {{"c1_deg_h_per_degc", 0.01}, {"c2_deg_h_per_degc2", -1.6e-4}}),
      value("shupe", {{"coefficient_deg_h_min_per_degc", 0.3}}),
      value("scale_factor", {{"error_ppm", 40.0}}),
      value("angle_random_walk", {{"coefficient_deg_per_sqrt_h", 1.8e-3}}),
      value("bias_instability", {{"coefficient_deg_h", 3e-3}}),
      value(kWalk, {{kCoefficient, 8e-3}})};
  const twin::Model listed = test::kinds_of(truth);
  truth = test::with(truth, value("scale_factor_nonlinearity", {{"error_ppm", -600.0}}));
  for (const std::uint64_t seed : {1U, 3U}) {
    const AxisDiagnosis axis =
        *diagnose(listed, test::simulated(truth, day_with_turns(), seed), {}, kOptions).axes[0];
    SCOPED_TRACE(std::to_string(seed) + ' ' + axis.sentence);
    ASSERT_EQ(axis.effects.size(), 1U);
    EXPECT_EQ(axis.effects[0].name, "scale_factor_nonlinearity");
    for (const std::string kind : {"bias_temperature", "shupe", "scale_factor"}) {
      EXPECT_TRUE(std::any_of(axis.recalibrated.begin(), axis.recalibrated.end(),
                              [&](const Recalibration& change) { return change.name == kind; }))
          << kind;
    }
    // With the walk in their place .033 to .038 deg/h are left.
    EXPECT_LT(core::deg_h_from_radps(axis.held_out.after_rms_radps), 0.02);
  }
}

TEST(DiagnosisScenario, AWanderingNoiseIsNoEffect) {
  const auto hide = [](const twin::Model& model) {
    return test::with(test::without(model, kWalk), walk({{kCoefficient, 0.1}}));
  };
  for (const Hidden& hidden : in_models(hide)) {
    const AxisDiagnosis axis = on_one_ramp(hidden);
    for (const NamedEffect& effect : axis.effects) EXPECT_EQ(effect.name, kWalk) << axis.sentence;
    EXPECT_FALSE(axis.unknown) << axis.sentence;
    // An effect with a memory that no candidate has looks the same: "no effect is missing" would be
    // more than is known.
    const auto& given = hidden.given.effects;
    const bool stated = std::any_of(given.begin(), given.end(), [](const twin::EffectSpec& spec) {
      return spec.kind == kWalk && spec.parameters.contains(kCoefficient);
    });
    const bool doubted =
        axis.sentence.find(std::string(kWalk) + " became ") != std::string::npos &&
        axis.sentence.find("The same profile once more decides it") != std::string::npos;
    EXPECT_EQ(doubted, stated) << axis.sentence;
  }
}

// Law: where no input moves there is nothing that such an effect could follow.
TEST(DiagnosisScenario, AWanderingNoiseAtOneTemperatureIsNoise) {
  const twin::Model quiet = test::without(test::lab_model(), kWalk);
  twin::Profile oven;
  oven.duration_s = 14400.0;
  oven.initial_temperature_degc = 25.0;
  oven.power_on_s = -86400.0;
  const auto walking = [&](double coefficient) {
    return test::with(quiet, walk({{kCoefficient, coefficient}}));
  };
  const AxisDiagnosis axis =
      *diagnose(walking(0.004), test::simulated(walking(0.1), oven, 5), {}, kOptions).axes[0];
  EXPECT_EQ(axis.sentence.find(" became "), std::string::npos) << axis.sentence;
}

}  // namespace
}  // namespace zerodrift::diagnosis
