// SPDX-License-Identifier: Apache-2.0
// Inputs that move everything an effect may depend on, and one effect run over inputs.
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "common/twin/effect_catalogue.h"

namespace zerodrift::twin::examples {

// Temperatures swing by 30 °C around 20 °C, each with its own phase; rates reach from 1e-7 to 20
// rad/s (beyond any default limit) and every fifth is within any default dead band; the rest
// swings.
inline EffectInputs excited_inputs(std::uint64_t sample, double interval_s) {
  EffectInputs inputs;
  inputs.sample = sample;
  const double t = static_cast<double>(sample) * interval_s;
  inputs.time_s = t;
  inputs.since_power_on_s = t;
  constexpr double kTurnsPerS = 1.0 / 3000.0;
  const double k = static_cast<double>(sample);
  for (std::size_t i = 0; i < kTemperaturePointCount; ++i) {
    const double phase = 6.283 * kTurnsPerS * t + 0.3 * static_cast<double>(i);
    inputs.thermal.temperature_degc[i] = 20.0 + 30.0 * std::sin(phase);
    inputs.thermal.temperature_rate_degc_per_s[i] = 30.0 * 6.283 * kTurnsPerS * std::cos(phase);
  }
  for (std::size_t i = 0; i < core::kAxisCount; ++i) {
    const double axis = static_cast<double>(i);
    inputs.true_rate_radps[i] =
        sample % 5 == i ? 1e-7 : 20.0 * std::sin(0.37 * k + axis) * std::abs(std::sin(0.011 * k));
    inputs.magnetic_ut[i] = 50.0 * std::sin(0.21 * k + axis);
    inputs.acceleration_mps2[i] = 9.8 * std::sin(0.13 * k + axis);
  }
  inputs.rate_radps = inputs.true_rate_radps[0];
  inputs.vibration_g = 1.0 + std::sin(0.17 * k);
  inputs.source_current_ma = kNominalSourceCurrentMa + 5.0 * std::sin(0.19 * k);
  inputs.supply_v = kNominalSupplyV + 0.2 * std::sin(0.23 * k);
  return inputs;
}

inline std::vector<EffectInputs> excited_record(std::size_t samples, double interval_s) {
  std::vector<EffectInputs> record;
  for (std::size_t i = 0; i < samples; ++i) record.push_back(excited_inputs(i, interval_s));
  return record;
}

// What the effect adds, rad/s.
inline std::vector<double> run(Effect& effect, const std::vector<EffectInputs>& record) {
  std::vector<double> added;
  for (const EffectInputs& inputs : record) added.push_back(effect.step(inputs));
  return added;
}

inline std::vector<double> run(const EffectSpec& spec, const std::vector<EffectInputs>& record,
                               double interval_s) {
  return run(*make_effect(spec, interval_s, NoiseStream(7, "effect")), record);
}

}  // namespace zerodrift::twin::examples
