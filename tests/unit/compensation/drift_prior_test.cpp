// SPDX-License-Identifier: Apache-2.0
// The twin's effects as a prior: the same figures as stepping them by hand, and what becomes of
// their states when temperatures are missing.
#include "common/compensation/drift_prior.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "common/twin/effect_catalogue.h"
#include "tests/unit/compensation/prior_models.h"

namespace zerodrift::compensation {
namespace {

using testing::effect;
using testing::model_of;
using testing::model_with_states;

const std::vector<std::string> kProbes{"coil", "coil_outer", "coil_inner"};
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// A coil that swings by 20 °C; the outer layers lead, the inner ones follow.
std::vector<PriorReading> readings_at(double time_s) {
  std::vector<PriorReading> readings;
  for (const double lead_s : {0.0, 60.0, -60.0}) {
    const double phase = 2e-3 * (time_s + lead_s);
    readings.push_back({20.0 + 10.0 * std::sin(phase), 2e-2 * std::cos(phase)});
  }
  return readings;
}

const std::vector<PriorReading> kNoReadings(kProbes.size());

void run(DriftPrior& prior, int from_s, int to_s) {
  for (int s = from_s; s <= to_s; ++s)
    prior.step(from_seconds(s), from_seconds(0.0), readings_at(s));
}

std::string refusal(const twin::Model& model, const std::vector<std::string>& probes) {
  try {
    const DriftPrior prior(model, probes);
  } catch (const std::invalid_argument& problem) {
    return problem.what();
  }
  return "no error";
}

// Rule: the prior is the sum of the model's effects, each stepped once a second over the same
// temperatures, to the bit; and held between the seconds.
TEST(DriftPriorLaws, EqualsTheModelsEffectsSteppedOverTheSameTemperatures) {
  const twin::Model model = model_with_states();
  DriftPrior prior(model, kProbes);
  std::vector<std::unique_ptr<twin::Effect>> effects;
  for (const auto& spec : model.effects)
    effects.push_back(twin::make_effect(spec, 1.0, twin::NoiseStream(0, "none")));
  double smallest = std::numeric_limits<double>::max();
  double largest = std::numeric_limits<double>::lowest();
  for (int s = 0; s < 4000; ++s) {
    const auto readings = readings_at(s + 0.25);
    twin::EffectInputs in;
    in.sample = static_cast<std::uint64_t>(s);
    in.time_s = in.since_power_on_s = s;
    for (const auto& [point, probe] : {std::pair{twin::TemperaturePoint::kCoil, 0U},
                                       std::pair{twin::TemperaturePoint::kCoilOuter, 1U},
                                       std::pair{twin::TemperaturePoint::kCoilInner, 2U}}) {
      in.thermal.temperature_degc[twin::index(point)] = readings[probe].temperature_degc;
      in.thermal.temperature_rate_degc_per_s[twin::index(point)] = readings[probe].rate_degc_per_s;
    }
    double sum = 0.0;
    for (const auto& running : effects) sum += running->step(in);
    for (const double part : {0.25, 0.5, 0.75}) {
      const auto now = from_seconds(s + part);
      EXPECT_EQ(prior.is_due(now), part == 0.25);
      if (prior.is_due(now)) prior.step(now, from_seconds(0.0), readings);
      ASSERT_EQ(prior.drift_radps(Axis::kX), sum) << s;
    }
    smallest = std::min(smallest, sum);
    largest = std::max(largest, sum);
  }
  EXPECT_GT(largest - smallest, 1.0 * testing::kDegH) << "there must be something to compare";
  EXPECT_EQ(prior.status(Axis::kX), PriorStatus::kReady);
  EXPECT_TRUE(prior.covers(Axis::kX));
  EXPECT_FALSE(prior.covers(Axis::kY));
}

TEST(DriftPriorLaws, TheCoilIsTheMeanOfItsLayersWhereOnlyTheyAreMeasured) {
  const auto model = model_of({effect("bias_temperature", Axis::kZ, {{"c1_deg_h_per_degc", 1.0}})});
  DriftPrior of_layers(model, std::vector<std::string>{"coil_inner", "coil_outer"});
  DriftPrior of_coil(model, std::vector<std::string>{"coil"});
  of_layers.step(from_seconds(1), from_seconds(0),
                 std::vector<PriorReading>{{20.0, 0.0}, {30.0, 0.0}});
  of_coil.step(from_seconds(1), from_seconds(0), std::vector<PriorReading>{{25.0, 0.0}});
  EXPECT_EQ(of_layers.drift_radps(Axis::kZ), of_coil.drift_radps(Axis::kZ));
  EXPECT_EQ(prior_probes(model, std::vector<std::string>{"coil_inner", "coil_outer"}),
            (std::vector<std::string>{"coil_outer", "coil_inner"}));
  EXPECT_EQ(prior_probes(model, std::vector<std::string>{"case", "coil_outer"}),
            (std::vector<std::string>{"coil"}));
}

// Rule: without temperatures value and states stand still; a pause of a minute is stepped through
// (equal to having stepped each second with the temperatures after it), a longer one begins anew.
TEST(DriftPriorLaws, APauseIsSteppedThroughOrBeginsAnew) {
  for (const int pause_s : {60, 61}) {
    DriftPrior prior(model_with_states(), kProbes);
    run(prior, 0, 1000);
    const auto before = prior.drift_radps(Axis::kX);
    const int after_s = 1000 + pause_s;
    for (int s = 1001; s < after_s; ++s)
      prior.step(from_seconds(s), from_seconds(0.0), kNoReadings);
    EXPECT_EQ(prior.drift_radps(Axis::kX), before);
    EXPECT_EQ(prior.status(Axis::kX), PriorStatus::kTemperatureMissing);
    prior.step(from_seconds(after_s), from_seconds(0.0), readings_at(after_s));
    EXPECT_EQ(prior.status(Axis::kX), PriorStatus::kReady);

    DriftPrior expected(model_with_states(), kProbes);
    if (pause_s <= DriftPrior::kLongestPauseSteps) {
      run(expected, 0, 1000);
      for (int s = 1001; s < after_s; ++s)
        expected.step(from_seconds(s), from_seconds(0.0), readings_at(after_s));
    }
    expected.step(from_seconds(after_s), from_seconds(0.0), readings_at(after_s));
    EXPECT_EQ(prior.drift_radps(Axis::kX), expected.drift_radps(Axis::kX)) << pause_s;
  }
}

// Rule: a source that started anew begins states anew, again and again; the value stands until
// then.
TEST(DriftPriorLaws, ARestartBeginsStatesAnew) {
  DriftPrior prior(model_with_states(), kProbes);
  for (int restart = 0; restart < 40; ++restart) {
    run(prior, 0, 100 + restart);
    const auto before = prior.drift_radps(Axis::kX);
    prior.restart();
    EXPECT_EQ(prior.drift_radps(Axis::kX), before);
  }
  DriftPrior fresh(model_with_states(), kProbes);
  run(prior, 0, 500);
  run(fresh, 0, 500);
  EXPECT_EQ(prior.drift_radps(Axis::kX), fresh.drift_radps(Axis::kX));
}

// Rule: where a temperature rate isn't known yet there is no value of an effect that reads it, and
// one of an effect that doesn't; as soon as it is known there is.
TEST(DriftPriorLaws, WaitsForARateOnlyWhereOneIsRead) {
  DriftPrior prior(model_of({effect("shupe", Axis::kX, {{"coefficient_deg_h_min_per_degc", 1.0}}),
                             effect("bias_temperature", Axis::kY, {{"c1_deg_h_per_degc", 1.0}})}),
                   kProbes);
  prior.step(from_seconds(1), from_seconds(0),
             std::vector<PriorReading>{{20.0, kNan}, {20.0, kNan}, {20.0, kNan}});
  EXPECT_EQ(prior.drift_radps(Axis::kX), std::nullopt);
  EXPECT_EQ(prior.status(Axis::kX), PriorStatus::kRateNotReady);
  EXPECT_TRUE(prior.drift_radps(Axis::kY).has_value());
  prior.step(from_seconds(2), from_seconds(0), readings_at(2));
  EXPECT_TRUE(prior.drift_radps(Axis::kX).has_value());
}

// Rule: of all effects of the catalogue, those take part that temperatures and time drive; a new
// effect of the catalogue is in or out by what it needs.
TEST(DriftPriorLaws, WhatNeedsMoreThanTemperatureAndTimeIsLeftOutByName) {
  std::vector<std::string> in;
  for (const auto& definition : twin::effect_catalogue()) {
    const auto model = model_of({effect(definition.kind, Axis::kZ,
                                        {{definition.parameters.front().name,
                                          definition.parameters.front().default_value}}),
                                 effect("bias", Axis::kX, {{"bias_deg_h", 1.0}})});
    const auto left_out = effects_left_out(model);
    if (left_out.empty()) {
      in.push_back(definition.kind);
    } else {
      EXPECT_EQ(left_out, (std::vector<std::string>{definition.kind + " of axis z"}));
    }
    EXPECT_EQ(refusal(model, {"chamber", "case", "coil_outer", "coil_inner", "board", "coil"}),
              "no error")
        << definition.kind;
  }
  EXPECT_EQ(in, (std::vector<std::string>{"bias", "bias_temperature", "shupe", "coil_lag",
                                          "gradient", "gradient_rate", "shupe_temperature",
                                          "sensor_lag", "hysteresis", "warm_up", "rate_ramp",
                                          "temperature_step", "etalon_fringe"}));
}

// Rule: the identity tells what gives another prior, and nothing else.
TEST(DriftPriorLaws, TheIdentityIsThatOfTheFigures) {
  const auto with = [](auto change) {
    twin::Model model = model_with_states();
    change(model);
    return prior_identity(model);
  };
  const std::string identity = prior_identity(model_with_states());
  EXPECT_EQ(identity.substr(0, identity.rfind(',')), "test, 10 effects");
  EXPECT_EQ(with([](auto& m) { m.gyro = "another name for people"; }), identity);
  EXPECT_EQ(with([](auto& m) { m.effects[1].origin.by = "diagnose"; }), identity);
  EXPECT_EQ(with([](auto& m) { m.effects[1].standard_errors["lag_s"] = 1.0; }), identity);
  EXPECT_EQ(with([](auto& m) { m.effects[1].parameters["c2_deg_h_per_degc2"] = 0.0; }), identity)
      << "the default, said";
  EXPECT_EQ(with([](auto& m) { m.effects[1].inputs = {"coil"}; }), identity) << "likewise";
  EXPECT_EQ(with([](auto& m) {
              m.effects.push_back(
                  effect("angle_random_walk", Axis::kX, {{"coefficient_deg_per_sqrt_h", 1e-3}}));
            }),
            identity);
  EXPECT_NE(with([](auto& m) { m.effects[1].parameters["lag_s"] = 181.0; }), identity);
  EXPECT_NE(with([](auto& m) { m.effects[1].inputs = {"coil_outer"}; }), identity);
  EXPECT_NE(with([](auto& m) { m.effects[0].axis = Axis::kY; }), identity);
  EXPECT_NE(with([](auto& m) { m.effects[7].formula += " * abs(T_case / 20)"; }), identity);
  EXPECT_NE(with([](auto& m) { m.effects.pop_back(); }), identity);
}

TEST(DriftPriorAbuse, AModelThatCanBeNoPriorIsRefusedByName) {
  const auto field = effect("magnetic", Axis::kX, {{"x_deg_h_per_ut", 1e-3}});
  const auto not_fitted = effect("bias", Axis::kX, {});
  for (const auto& effects : {std::vector<twin::EffectSpec>{}, {field}, {not_fitted}}) {
    EXPECT_EQ(refusal(model_of(effects), kProbes),
              "prior: found no effect that temperature or the time since power-on drives, expected "
              "at least one with parameters");
  }
  EXPECT_EQ(refusal(model_of({effect("gradient", Axis::kZ, {{"coefficient_deg_h_per_degc", 1.0}},
                                     {"case", "coil"})}),
                    kProbes),
            "prior: gradient of axis z reads the temperature of 'case', expected one of coil, "
            "coil_outer, coil_inner; name it under probes");
  EXPECT_EQ(
      refusal(model_of({effect("bias", Axis::kX, {{"bias_deg_h", kNan}})}), kProbes).substr(0, 17),
      "prior: effects[0]");
  EXPECT_EQ(
      refusal(model_of({effect("biass", Axis::kX, {{"bias_deg_h", 1.0}})}), kProbes).substr(0, 17),
      "prior: effects[0]");
  std::vector<twin::EffectSpec> many(65, effect("bias", Axis::kY, {{"bias_deg_h", 1.0}}));
  EXPECT_EQ(refusal(model_of(many), kProbes),
            "prior: found 65 effects of axis y, expected at most 64");
}

// Rule: infinite and absent temperatures, and times far apart, leave a finite value or none.
TEST(DriftPriorAbuse, NoReadingMakesItInfinite) {
  DriftPrior prior(model_with_states(), kProbes);
  const double infinity = std::numeric_limits<double>::infinity();
  testing::Random random(3);
  const double bad[] = {kNan, infinity, -infinity, 1e308, 20.0, -273.15};
  for (int n = 0; n < 5000; ++n) {
    auto readings = readings_at(n);
    for (auto& reading : readings) {
      if (random.below(4) == 0) reading.temperature_degc = bad[random.below(6)];
      if (random.below(4) == 0) reading.rate_degc_per_s = bad[random.below(6)];
    }
    const auto time = core::SensorTime(static_cast<std::int64_t>(random.next() / 4U)) -
                      core::SensorTime(std::int64_t{1} << 61);
    prior.step(n % 50 == 0 ? time : from_seconds(n), from_seconds(0.0), readings);
    const auto drift = prior.drift_radps(Axis::kX);
    ASSERT_TRUE(!drift || std::isfinite(*drift)) << n;
  }
}

}  // namespace
}  // namespace zerodrift::compensation
