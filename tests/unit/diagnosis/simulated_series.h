// SPDX-License-Identifier: Apache-2.0
// Records of the shipped laboratory model on the shipped diagnosis profile, with effects added or
// taken away, as series.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "common/config/twin_config.h"
#include "common/diagnosis/design_trial.h"

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

// What it lists, without coefficients.
inline twin::Model kinds_of(twin::Model model) {
  for (twin::EffectSpec& effect : model.effects) {
    effect.parameters.clear();
    effect.standard_errors.clear();
  }
  return model;
}

inline MeasuredSeries simulated(const twin::Model& model, const twin::Profile& profile,
                                std::uint64_t seed) {
  return simulated_series(model, profile, core::Axis::kX, seed);
}

}  // namespace zerodrift::diagnosis::test
