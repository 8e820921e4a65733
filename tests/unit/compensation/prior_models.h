// SPDX-License-Identifier: Apache-2.0
// Models of the twin as priors for the tests of this folder.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "common/twin/model.h"
#include "tests/unit/compensation/synthetic_gyro.h"

namespace zerodrift::compensation::testing {

inline twin::EffectSpec effect(const std::string& kind, core::Axis axis,
                               std::map<std::string, double> parameters,
                               std::vector<std::string> inputs = {}) {
  twin::EffectSpec spec;
  spec.kind = kind;
  spec.axis = axis;
  spec.parameters = std::move(parameters);
  spec.inputs = std::move(inputs);
  return spec;
}

inline twin::Model model_of(std::vector<twin::EffectSpec> effects) {
  twin::Model model;
  model.gyro_id = "test";
  model.effects = std::move(effects);
  return model;
}

// The model of make_record(spec): the same drift, term by term.
inline twin::Model model_of(const GyroSpec& spec) {
  std::vector<twin::EffectSpec> effects;
  for (const auto axis : core::kAxes) {
    const double sign = axis == core::Axis::kY ? -1.0 : 1.0;
    effects.push_back(effect("bias", axis, {{"bias_deg_h", sign * spec.offset_deg_h}}));
    effects.push_back(effect("bias_temperature", axis,
                             {{"reference_degc", 25.0},
                              {"c1_deg_h_per_degc", sign * spec.per_degc_deg_h},
                              {"c2_deg_h_per_degc2", sign * spec.per_degc2_deg_h}}));
    effects.push_back(effect(
        "shupe", axis, {{"coefficient_deg_h_min_per_degc", sign * spec.shupe_deg_h_per_degc_min}}));
  }
  return model_of(std::move(effects));
}

inline twin::EffectSpec formula(const std::string& text, core::Axis axis,
                                std::map<std::string, double> parameters) {
  twin::EffectSpec spec = effect("formula", axis, std::move(parameters));
  spec.formula = text;
  return spec;
}

// Every effect with a state, on axis x.
inline twin::Model model_with_states() {
  using core::Axis;
  return model_of(
      {effect("bias", Axis::kX, {{"bias_deg_h", 1.0}}),
       effect("bias_temperature", Axis::kX, {{"c1_deg_h_per_degc", 0.05}, {"lag_s", 180.0}}),
       effect("shupe", Axis::kX, {{"coefficient_deg_h_min_per_degc", 2.0}}),
       effect("coil_lag", Axis::kX, {{"coefficient_deg_h_min_per_degc", -1.0}, {"tau_s", 600.0}}),
       effect("gradient", Axis::kX, {{"coefficient_deg_h_per_degc", 0.2}}),
       effect("gradient_rate", Axis::kX,
              {{"gradient_deg_h_min_per_degc", 0.5}, {"curvature_deg_h_min2_per_degc", 0.1}}),
       effect("hysteresis", Axis::kX, {{"k1_deg_h_per_degc", 0.08}}),
       formula("k * lag(T_coil_outer, tau) - j * play(T_coil, 2) + m * rate(time_on) * T_coil + "
               "spline(lag(T_coil, 60), 15, 45, a, b, c)",
               Axis::kX,
               {{"k", 0.1},
                {"tau", 240.0},
                {"j", 0.05},
                {"m", 0.02},
                {"a", 0.1},
                {"b", -0.2},
                {"c", 0.1}}),
       effect("warm_up", Axis::kX, {{"amplitude_deg_h", -0.7}, {"tau_s", 900.0}}),
       effect("rate_ramp", Axis::kX, {{"ramp_deg_per_h2", 0.3}})});
}

}  // namespace zerodrift::compensation::testing
