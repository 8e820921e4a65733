// SPDX-License-Identifier: Apache-2.0
// What holds for every effect of the catalogue.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include "tests/support/allocation_count.h"
#include "tests/unit/twin/examples.h"
#include "tests/unit/twin/excited_inputs.h"

namespace zerodrift::twin {
namespace {

using examples::excited_record;
using examples::run;

class EveryEffect : public testing::TestWithParam<const EffectDefinition*> {
 protected:
  [[nodiscard]] const EffectDefinition& definition() const { return *GetParam(); }

  [[nodiscard]] EffectSpec spec() const { return {.kind = definition().kind}; }

  [[nodiscard]] bool has_amplitudes() const {
    const auto& all = definition().parameters;
    return std::any_of(all.begin(), all.end(), [](const ParameterDefinition& parameter) {
      return parameter.role == ParameterRole::kAmplitude;
    });
  }

  // Amplitudes of the size of the defaults, drawn by `number`.
  [[nodiscard]] Parameters amplitudes(std::uint64_t number) const {
    Parameters drawn;
    const NoiseStream noise(number, "amplitudes");
    for (std::size_t i = 0; i < definition().parameters.size(); ++i) {
      const ParameterDefinition& parameter = definition().parameters[i];
      if (parameter.role != ParameterRole::kAmplitude) continue;
      const double size = parameter.default_value != 0.0 ? parameter.default_value : 0.01;
      const double value = size * noise.gaussian(i);
      drawn[parameter.name] = parameter.minimum >= 0.0 ? std::abs(value) : value;
    }
    return drawn;
  }

  [[nodiscard]] bool needs(std::initializer_list<Need> any) const {
    return std::any_of(any.begin(), any.end(), [this](Need need) {
      const auto& all = definition().needs;
      return std::find(all.begin(), all.end(), need) != all.end();
    });
  }
};

using EveryEffectLaws = EveryEffect;
using EveryEffectAbuse = EveryEffect;

std::vector<const EffectDefinition*> all_effects() {
  std::vector<const EffectDefinition*> all;
  for (const EffectDefinition& definition : effect_catalogue()) all.push_back(&definition);
  return all;
}

std::string name_of(const testing::TestParamInfo<const EffectDefinition*>& info) {
  return info.param->kind;
}

INSTANTIATE_TEST_SUITE_P(Catalogue, EveryEffectLaws, testing::ValuesIn(all_effects()), name_of);
INSTANTIATE_TEST_SUITE_P(Catalogue, EveryEffectAbuse, testing::ValuesIn(all_effects()), name_of);

bool same_bits(const std::vector<double>& a, const std::vector<double>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](double x, double y) {
    return std::bit_cast<std::uint64_t>(x) == std::bit_cast<std::uint64_t>(y);
  });
}

// The names that people write into models and that diagnoses report.
TEST(EffectCatalogueLaws, HoldsEveryEffectOfTheInterfaceAndNoOther) {
  const std::set<std::string> expected{"bias",
                                       "bias_temperature",
                                       "shupe",
                                       "coil_lag",
                                       "gradient",
                                       "gradient_rate",
                                       "shupe_temperature",
                                       "sensor_lag",
                                       "hysteresis",
                                       "warm_up",
                                       "scale_factor",
                                       "scale_factor_temperature",
                                       "scale_factor_nonlinearity",
                                       "scale_factor_asymmetry",
                                       "misalignment",
                                       "dead_band",
                                       "quantization",
                                       "angle_random_walk",
                                       "noise_temperature",
                                       "bias_instability",
                                       "rate_random_walk",
                                       "rate_ramp",
                                       "markov",
                                       "telegraph",
                                       "bias_step",
                                       "line",
                                       "duty_cycle",
                                       "vibration_rectification",
                                       "acceleration_sensitivity",
                                       "magnetic",
                                       "source_intensity",
                                       "temperature_step",
                                       "etalon_fringe",
                                       "modulator_reset",
                                       "spikes",
                                       "saturation",
                                       "dropped_samples",
                                       "rounding",
                                       "clock_offset"};
  const auto names = effect_names();
  EXPECT_EQ(std::set<std::string>(names.begin(), names.end()), expected);
  EXPECT_EQ(names.size(), expected.size()) << "a name is there twice";
}

TEST_P(EveryEffectLaws, ItsEntryIsComplete) {
  EXPECT_EQ(find_effect(definition().kind), &definition());
  EXPECT_FALSE(definition().equation.empty());
  EXPECT_FALSE(definition().source.empty());
  EXPECT_FALSE(definition().parameters.empty());
  EXPECT_TRUE(!definition().needs.empty() || definition().kind == "bias");
  for (const std::string& other : definition().confused_with) {
    EXPECT_NE(other, definition().kind);
    EXPECT_NE(find_effect(other), nullptr) << other;
  }
}

TEST_P(EveryEffectLaws, DefaultsAndGridsLieWithinTheLimits) {
  std::set<std::string> seen;
  for (const ParameterDefinition& parameter : definition().parameters) {
    EXPECT_TRUE(seen.insert(parameter.name).second) << parameter.name << " is there twice";
    EXPECT_GE(parameter.default_value, parameter.minimum) << parameter.name;
    EXPECT_LE(parameter.default_value, parameter.maximum) << parameter.name;
    const auto& grid = parameter.grid;
    EXPECT_EQ(grid.empty(), parameter.role != ParameterRole::kShape) << parameter.name;
    if (grid.empty()) continue;
    // Two are enough where they are all that there is between.
    const bool is_whole = grid.front() == parameter.minimum && grid.back() == parameter.maximum;
    EXPECT_GE(grid.size(), is_whole ? 2U : 3U) << parameter.name;
    EXPECT_LE(grid.size(), 8U) << parameter.name;
    EXPECT_TRUE(std::is_sorted(grid.begin(), grid.end(), std::less_equal<>())) << parameter.name;
    EXPECT_GE(grid.front(), parameter.minimum) << parameter.name;
    EXPECT_LE(grid.back(), parameter.maximum) << parameter.name;
  }
}

TEST_P(EveryEffectLaws, StochasticOnesAndOnlyTheyHaveASpectrum) {
  const Spectrum& spectrum = definition().spectrum;
  ASSERT_EQ(definition().family == Family::kStochastic, static_cast<bool>(spectrum.density));
  if (!spectrum.density) return;
  Parameters parameters = complete_parameters(definition(), {});
  ASSERT_EQ(parameters.count(spectrum.scale), 1U);
  const double density = spectrum.density(parameters, 1.0)(0.01);
  parameters[spectrum.scale] *= 3.0;
  // Two products and a quotient: a few units in the last place.
  EXPECT_NEAR(spectrum.density(parameters, 1.0)(0.01) / density, 9.0, 1e-13);
}

TEST_P(EveryEffectLaws, ContributionsAddUpAsAmplitudesDo) {
  if (!has_amplitudes()) return;  // every parameter is a shape
  constexpr double kInterval = 1.0;
  const auto record = excited_record(3000, kInterval);
  EffectSpec one = spec();
  EffectSpec two = spec();
  EffectSpec sum = spec();
  one.parameters = amplitudes(1);
  two.parameters = amplitudes(2);
  for (const auto& [name, value] : one.parameters) {
    sum.parameters[name] = value + two.parameters.at(name);
  }
  // Also for other shapes than the defaults.
  for (const ParameterDefinition& parameter : definition().parameters) {
    if (parameter.role != ParameterRole::kShape) continue;
    for (EffectSpec* each : {&one, &two, &sum}) {
      each->parameters[parameter.name] = parameter.grid[1];
    }
  }
  const auto a = run(one, record, kInterval);
  const auto b = run(two, record, kInterval);
  const auto both = run(sum, record, kInterval);
  double largest = 0.0;
  for (std::size_t i = 0; i < both.size(); ++i) {
    largest = std::max({largest, std::abs(a[i]), std::abs(b[i])});
  }
  ASSERT_GT(largest, 0.0);
  for (std::size_t i = 0; i < both.size(); ++i) {
    // Rounding; sums over 3000 steps (rate_random_walk) collect at most 3000 half units in the
    // last place.
    ASSERT_NEAR(both[i], a[i] + b[i], 4e-13 * largest) << "sample " << i;
  }
}

TEST_P(EveryEffectLaws, ZeroAmplitudesGiveZero) {
  if (!has_amplitudes()) return;  // every parameter is a shape
  EffectSpec zero = spec();
  for (const auto& [name, value] : amplitudes(1)) zero.parameters[name] = 0.0;
  for (const double added : run(zero, excited_record(3000, 1.0), 1.0)) ASSERT_EQ(added, 0.0);
}

TEST_P(EveryEffectLaws, TwoInstancesAgreeToTheBit) {
  const auto record = excited_record(3000, 0.1);
  EXPECT_TRUE(same_bits(run(spec(), record, 0.1), run(spec(), record, 0.1)));
}

TEST_P(EveryEffectLaws, RunsFiniteAtAnyIntervalAndDoesSomething) {
  for (const double interval_s : {0.005, 1.0, 60.0}) {
    const auto effect = make_effect(spec(), interval_s, NoiseStream(7, "effect"));
    bool does_something = false;
    // 20 000 samples: enough for one of the spikes, which come twice an hour, at 0.1 s and more.
    for (std::uint64_t i = 0; i < 20'000; ++i) {
      const double added = effect->step(examples::excited_inputs(i, interval_s));
      ASSERT_TRUE(std::isfinite(added)) << "sample " << i << " at " << interval_s << " s";
      does_something = does_something || added != 0.0 || effect->status() == SampleStatus::kLost;
    }
    const bool is_rare = definition().kind == "spikes" || definition().search.happens_once;
    const bool too_short = is_rare && interval_s < 0.1;
    EXPECT_TRUE(does_something || too_short) << "at " << interval_s << " s";
  }
}

TEST_P(EveryEffectLaws, StepsDoNotAllocate) {
  const auto record = excited_record(2000, 0.01);
  const auto effect = make_effect(spec(), 0.01, NoiseStream(7, "effect"));
  const std::size_t before = allocation_count();
  EXPECT_GT(before, 0U);
  double sum = 0.0;
  for (const EffectInputs& inputs : record) sum += effect->step(inputs);
  EXPECT_EQ(allocation_count(), before);
  EXPECT_TRUE(std::isfinite(sum));
}

// What an effect doesn't need, it doesn't feel; what it needs, it does.
TEST_P(EveryEffectLaws, FeelsTheInputsItNeedsAndNoOther) {
  constexpr double kInterval = 1.0;
  const auto record = excited_record(2000, kInterval);
  EffectSpec all = spec();
  all.parameters = amplitudes(3);
  const auto as_is = run(all, record, kInterval);
  const auto feels = [&](auto change) {
    auto changed = record;
    for (EffectInputs& inputs : changed) change(inputs);
    return !same_bits(run(all, changed, kInterval), as_is);
  };
  EXPECT_EQ(feels([](EffectInputs& i) {
              for (double& t : i.thermal.temperature_degc) t *= 0.9;
              for (std::size_t p = 0; p < kTemperaturePointCount; ++p) {
                i.thermal.temperature_rate_degc_per_s[p] *= 0.9;
              }
            }),
            needs({Need::kTemperature, Need::kTemperatureDifference, Need::kTemperatureCycles}));
  EXPECT_EQ(feels([](EffectInputs& i) { i.true_rate_radps[0] *= 0.9; }),
            needs({Need::kReferenceRate, Need::kSlowReferenceRate}));
  EXPECT_EQ(feels([](EffectInputs& i) { i.true_rate_radps[1] *= 0.9; }),
            needs({Need::kCrossAxisRate}));
  EXPECT_EQ(feels([](EffectInputs& i) { i.true_rate_radps[2] *= 0.9; }),
            needs({Need::kCrossAxisRate}));
  for (std::size_t axis = 0; axis < core::kAxisCount; ++axis) {
    EXPECT_EQ(feels([axis](EffectInputs& i) { i.magnetic_ut[axis] *= 0.9; }),
              needs({Need::kMagnetic}));
    EXPECT_EQ(feels([axis](EffectInputs& i) { i.acceleration_mps2[axis] *= 0.9; }),
              needs({Need::kAcceleration}));
  }
  EXPECT_EQ(feels([](EffectInputs& i) { i.vibration_g *= 0.9; }), needs({Need::kVibration}));
  EXPECT_EQ(feels([](EffectInputs& i) { i.source_current_ma *= 0.9; }),
            needs({Need::kSourceCurrent}));
  EXPECT_EQ(feels([](EffectInputs& i) { i.supply_v *= 0.9; }), needs({Need::kSupply}));
}

TEST_P(EveryEffectAbuse, InputsThatAreNotFiniteLeaveNoTrace) {
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    auto record = excited_record(200, 1.0);
    for (const std::size_t i : {0U, 50U, 51U}) {
      record[i].thermal.temperature_degc.fill(bad);
      record[i].thermal.temperature_rate_degc_per_s.fill(bad);
      record[i].true_rate_radps.fill(bad);
      record[i].rate_radps = bad;
      record[i].magnetic_ut.fill(bad);
      record[i].acceleration_mps2.fill(bad);
      record[i].vibration_g = bad;
      record[i].source_current_ma = bad;
      record[i].supply_v = bad;
    }
    const auto added = run(spec(), record, 1.0);
    for (std::size_t i = 0; i < added.size(); ++i) {
      if (i == 0 || i == 50 || i == 51) continue;
      ASSERT_TRUE(std::isfinite(added[i])) << "sample " << i;
    }
  }
}

TEST_P(EveryEffectAbuse, AbsurdParametersAreRefusedByName) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  for (const ParameterDefinition& parameter : definition().parameters) {
    for (const double absurd : {nan, infinity, -infinity}) {
      EffectSpec wrong = spec();
      wrong.parameters[parameter.name] = absurd;
      const auto problem = wrong.find_problem();
      ASSERT_TRUE(problem) << parameter.name;
      EXPECT_EQ(problem->key, "parameters." + parameter.name);
      EXPECT_THROW((void)make_effect(wrong, 1.0, NoiseStream(1, "")), std::invalid_argument);
    }
  }
}

TEST_P(EveryEffectAbuse, ValuesAtTheLimitsRunWithoutHarm) {
  const auto record = excited_record(50, 1.0);
  for (const ParameterDefinition& parameter : definition().parameters) {
    for (const double limit : {parameter.minimum, parameter.maximum}) {
      if (std::abs(limit) > 1e300) continue;  // no limit: the product with an input may overflow
      EffectSpec extreme = spec();
      extreme.parameters[parameter.name] = limit;
      for (const double added : run(extreme, record, 1.0)) {
        ASSERT_TRUE(std::isfinite(added)) << parameter.name << " = " << limit;
      }
    }
  }
}

TEST(MakeEffectAbuse, UnknownEffectsAndImpossibleIntervalsAreNamed) {
  const NoiseStream noise(1, "");
  try {
    (void)make_effect({.kind = "shuppe"}, 1.0, noise);
    FAIL() << "no exception";
  } catch (const std::invalid_argument& error) {
    EXPECT_STREQ(error.what(), "kind: the catalogue has no effect 'shuppe'; did you mean 'shupe'?");
  }
  for (const double interval_s : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN(), 1e9}) {
    EXPECT_THROW((void)make_effect({.kind = "bias"}, interval_s, noise), std::invalid_argument);
  }
}

}  // namespace
}  // namespace zerodrift::twin
