// SPDX-License-Identifier: Apache-2.0
// Small models and profiles the tests share.
#pragma once

#include <map>
#include <string>

#include "common/twin/model.h"
#include "common/twin/profile.h"

namespace zerodrift::twin::examples {

inline EffectSpec effect(const std::string& kind, const std::map<std::string, double>& parameters,
                         core::Axis axis = core::Axis::kX) {
  EffectSpec spec;
  spec.kind = kind;
  spec.axis = axis;
  spec.parameters = parameters;
  return spec;
}

inline Model model_of(const std::vector<EffectSpec>& effects) {
  Model model;
  model.gyro_id = "test";
  model.effects = effects;
  model.probes = {{
                      .name = "coil",
                      .node = TemperaturePoint::kCoil,
                      .lag_s = 5.0,
                      .noise_degc = 0.005,
                      .quantisation_degc = 0.01,
                  },
                  {.name = "board", .node = TemperaturePoint::kBoard, .rate_hz = 4.0}};
  return model;
}

// Constant 20 °C.
inline Profile still(double duration_s) {
  Profile profile;
  profile.duration_s = duration_s;
  return profile;
}

// -15 °C, from 60 s on to 50 °C by 1 °C/min, and back after an hour at 50 °C.
inline Profile heating_and_cooling() {
  Profile profile;
  profile.duration_s = 16000.0;
  profile.initial_temperature_degc = -15.0;
  profile.chamber = {{60.0, -15.0}, {3960.0, 50.0}, {7560.0, 50.0}, {11460.0, -15.0}};
  return profile;
}

}  // namespace zerodrift::twin::examples
