// SPDX-License-Identifier: Apache-2.0
// What one axis learns from, and what its data path works with.
#pragma once

#include <optional>

#include "common/compensation/drift_forecast.h"
#include "common/compensation/label_builder.h"
#include "common/compensation/thermal_coverage.h"
#include "common/core/state_archive.h"
#include "common/experts/stack_forecast.h"

namespace zerodrift::compensation {

// One axis's part of a label.
struct AxisLabel {
  core::SensorTime time{0};  // its end
  double duration_s = 0.0;
  double drift_radps = 0.0;
  double variance = 0.0;  // (rad/s)²
  std::optional<FeatureArray> features{};
  experts::ThermalState thermal{};  // zeros before the first temperature; its rate may be missing

  [[nodiscard]] bool has_temperature() const noexcept {
    return features || thermal != experts::ThermalState{};
  }
  void carry(core::StateArchive& archive);
};

// The online SVR, frozen, with what experience says of its forecasts.
struct SvrModel {
  SvrModel(std::size_t dimension, std::size_t capacity) : drift(dimension, capacity) {}

  // Only of one that holds something (drift_forecast.h) or knows nothing at all.
  void carry(core::StateArchive& archive) { archive(drift, trust); }

  DriftModel drift;
  TrustTable trust;
};

// What one axis's data path works with, frozen.
struct AxisModel : SvrModel {
  using SvrModel::SvrModel;

  // The time as a stack takes it: before its newest label where the age of that isn't known.
  [[nodiscard]] double stack_time_s(core::SensorTime now) const noexcept;

  experts::StackForecast stack{};    // knows nothing where the scheme isn't the stack
  experts::StackForecast in_time{};  // likewise; of the experts that need no thermometer
  ThermalCoverage coverage{};        // of all labels that had a temperature
  // The mean over the labels whose drift is held; nothing where one of them had no temperature.
  std::optional<experts::ThermalState> held_thermal{};
};

// The SVR's forecast, of drift_forecast.h, as the stack takes it.
[[nodiscard]] inline experts::SvrForecast as_expert(const Forecast& svr) noexcept {
  return {.drift = svr.drift_radps,
          .interpolates = !svr.beyond_learned,
          .holds = svr.kind != ForecastKind::kModel};
}

// The forecast of an axis's stack, which must know something. O(samples * dimension) once the
// online SVR is trained, else O(terms); no allocation.
[[nodiscard]] Forecast stack_forecast(const AxisModel& model, const FeatureArray& features,
                                      const experts::ThermalState& thermal,
                                      core::SensorTime now) noexcept;
// The same of the experts that need no thermometer, which must know something. O(terms).
[[nodiscard]] Forecast forecast_in_time(const AxisModel& model, core::SensorTime now) noexcept;

}  // namespace zerodrift::compensation
