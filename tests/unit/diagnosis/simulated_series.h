// SPDX-License-Identifier: Apache-2.0
// Records of the shipped laboratory model on the shipped diagnosis profile, with effects added or
// taken away, as series.
#pragma once

#include <cmath>
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include "common/config/twin_config.h"
#include "common/core/units.h"
#include "common/diagnosis/measured_series.h"
#include "common/twin/simulation.h"

namespace zerodrift::diagnosis::test {

inline std::filesystem::path shipped(const std::string& name) {
  return std::filesystem::path(ZERODRIFT_SOURCE_DIR) / "config" / name;
}

// Axis x alone: what a test of one axis needs.
inline twin::Model lab_model() {
  twin::Model model = config::load_model(shipped("models/lab_fog.yaml")).model;
  std::erase_if(model.effects, [](const auto& effect) { return effect.axis != core::Axis::kX; });
  return model;
}

inline twin::Profile chamber_profile() {
  return config::load_profile(shipped("profiles/diagnosis_chamber.yaml"));
}

inline twin::Model with(twin::Model model, twin::EffectSpec effect) {
  model.effects.push_back(std::move(effect));
  return model;
}

inline twin::Model without(twin::Model model, const std::string& kind) {
  std::erase_if(model.effects, [&](const auto& effect) { return effect.kind == kind; });
  return model;
}

inline MeasuredSeries simulated(const twin::Model& model, const twin::Profile& profile,
                                std::uint64_t seed) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  twin::GyroSimulation gyro(model, profile, seed, 1.0);
  SeriesOptions options{.has_reference = true};
  std::vector<twin::ThermometerSimulation> thermometers;
  for (const twin::ProbeSpec& probe : model.probes) {
    options.probes.push_back(probe.name);
    thermometers.emplace_back(model, profile, seed, probe.name);
  }
  SeriesBuilder builder(options);
  std::vector<double> readings(thermometers.size());
  while (const auto sample = gyro.next()) {
    for (std::size_t p = 0; p < thermometers.size(); ++p)
      readings[p] = thermometers[p].next()->temperature_degc;
    const twin::EffectInputs& in = gyro.inputs();
    MeasuredRow row{.time_s = core::seconds(sample->time), .temperature_degc = readings};
    row.rate_radps = {sample->valid[0] ? sample->rate_radps[0] : kNone, kNone, kNone};
    row.reference_radps = gyro.true_rate_radps();
    row.magnetic_ut = in.magnetic_ut;
    row.acceleration_mps2 = in.acceleration_mps2;
    row.vibration_g = in.vibration_g;
    row.source_current_ma = in.source_current_ma;
    row.supply_v = sample->valid[0] ? in.supply_v : 0.0;
    builder.add(row);
  }
  return builder.finish();
}

}  // namespace zerodrift::diagnosis::test
