// SPDX-License-Identifier: Apache-2.0
// What an effect's file is put together from: its parameters, and running instances of effects
// that are functions of their inputs, with at most a low pass as memory.
#pragma once

#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "common/twin/effect.h"
#include "common/twin/low_pass.h"

namespace zerodrift::twin {

struct Limits {
  double minimum = -std::numeric_limits<double>::max();
  double maximum = std::numeric_limits<double>::max();
};

// A parameter that enters non-linearly; `grid` is what a search tries, increasing, within limits.
inline ParameterDefinition shape(std::string name, std::string meaning, double default_value,
                                 Limits limits, std::vector<double> grid,
                                 SearchRule rule = SearchRule::kGrid) {
  return {std::move(name), std::move(meaning),    default_value,   limits.minimum,
          limits.maximum,  ParameterRole::kShape, std::move(grid), rule};
}

// A parameter that is never fitted.
inline ParameterDefinition convention(std::string name, std::string meaning, double default_value,
                                      Limits limits = {}) {
  return {std::move(name), std::move(meaning), default_value,
          limits.minimum,  limits.maximum,     ParameterRole::kConvention};
}

// The lag parameter that temperature effects share: which lag a search tries besides none.
inline ParameterDefinition lag_parameter() {
  return shape("lag_s", "first-order lag of the effect behind the temperature", 0.0, {0.0, 1e5},
               {0.0, 60.0, 180.0, 600.0, 1800.0}, SearchRule::kLag);
}

// The temperature that temperature effects count from.
inline ParameterDefinition reference_parameter() {
  return convention("reference_degc", "temperature without contribution", 25.0, {-273.15, 1e3});
}

// For a temperature effect's first input: LP_lag(T) - T_ref, by the two parameters above.
class LaggedTemperature {
 public:
  explicit LaggedTemperature(const EffectContext& context)
      : input_(context.inputs.at(0)),
        lag_(context.parameter("lag_s"), context.interval_s),
        reference_degc_(context.parameter("reference_degc")) {}

  // °C above the reference. Steps the lag: once a sample.
  double step(const EffectInputs& inputs) noexcept {
    return lag_.step(temperature_degc(inputs, input_)) - reference_degc_;
  }

  void carry(core::StateArchive& archive) { archive(lag_); }

 private:
  TemperaturePoint input_;
  LowPass lag_;
  double reference_degc_;
};

// Makes an effect that has a class of its own.
template <typename Own>
std::unique_ptr<Effect> make(const EffectContext& context) {
  return std::make_unique<Own>(context);
}

// An effect without memory: `rate` gives rad/s for the inputs of a sample.
template <typename Rate>
std::unique_ptr<Effect> without_memory(Rate rate) {
  class Function final : public Effect {
   public:
    explicit Function(Rate rate) : rate_(std::move(rate)) {}
    double step(const EffectInputs& inputs) noexcept override { return rate_(inputs); }

   private:
    Rate rate_;
  };
  return std::make_unique<Function>(std::move(rate));
}

// An effect that follows a vector of the inputs: x v_x + y v_y + z v_z, rad/s per unit of it.
inline std::unique_ptr<Effect> along_axes(const core::PerAxis<double>& radps_per_unit,
                                          core::PerAxis<double> EffectInputs::*vector) {
  return without_memory([=](const EffectInputs& inputs) {
    const core::PerAxis<double>& v = inputs.*vector;
    return radps_per_unit[0] * v[0] + radps_per_unit[1] * v[1] + radps_per_unit[2] * v[2];
  });
}

// An effect that remembers no more than `memory`, which lists its state in carry(): `rate` steps
// it with the inputs of a sample and gives rad/s.
template <typename Memory, typename Rate>
std::unique_ptr<Effect> with_memory(Memory memory, Rate rate) {
  class Function final : public Effect {
   public:
    Function(Memory memory, Rate rate) : memory_(std::move(memory)), rate_(std::move(rate)) {}
    double step(const EffectInputs& inputs) noexcept override { return rate_(memory_, inputs); }
    void carry(core::StateArchive& archive) override { archive(memory_); }

   private:
    Memory memory_;
    Rate rate_;
  };
  return std::make_unique<Function>(std::move(memory), std::move(rate));
}

// An effect of the first input's rate as `follower` passes it on: s F(dT/dt), s by the parameter
// coefficient_deg_h_min_per_degc.
template <typename Follower>
std::unique_ptr<Effect> of_temperature_rate(const EffectContext& context, Follower follower) {
  const TemperaturePoint input = context.inputs.at(0);
  const double radps_per_degc_per_s = context.radps("coefficient_deg_h_min_per_degc") * 60.0;
  return with_memory(std::move(follower), [=](Follower& follows, const EffectInputs& inputs) {
    return radps_per_degc_per_s * follows.step(temperature_rate_degc_per_s(inputs, input));
  });
}

}  // namespace zerodrift::twin
