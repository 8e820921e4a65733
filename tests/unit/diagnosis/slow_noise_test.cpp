// SPDX-License-Identifier: Apache-2.0
// Noise that wanders follows any slow drift: what effects made must not be taken for it, and the
// other way round.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "common/diagnosis/diagnosis.h"
#include "common/diagnosis/noise_of_model.h"
#include "common/twin/effect_catalogue.h"
#include "tests/unit/diagnosis/simulated_series.h"

namespace zerodrift::diagnosis {
namespace {

constexpr core::Axis kX = core::Axis::kX;
const DiagnosisOptions kOptions{.record = "simulated", .date = "2026-01-01"};
constexpr auto kWalk = "rate_random_walk";

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
  const twin::Model stated = test::with(quiet, walk({{"coefficient_deg_per_h_1_5", 0.004}}));
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

TEST(DiagnosisScenario, AWanderingNoiseIsNoEffect) {
  const auto hide = [](const twin::Model& model) {
    return test::with(test::without(model, kWalk), walk({{"coefficient_deg_per_h_1_5", 0.1}}));
  };
  for (const Hidden& hidden : in_models(hide)) {
    const AxisDiagnosis axis = on_one_ramp(hidden);
    for (const NamedEffect& effect : axis.effects) EXPECT_EQ(effect.name, kWalk) << axis.sentence;
    EXPECT_FALSE(axis.unknown) << axis.sentence;
  }
}

}  // namespace
}  // namespace zerodrift::diagnosis
