// SPDX-License-Identifier: Apache-2.0
// The twin's effects run over what a record says it was exposed to.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/core/axis.h"
#include "common/diagnosis/measured_series.h"
#include "common/twin/effect.h"
#include "common/twin/model.h"
#include "common/twin/temperature_point.h"

namespace zerodrift::diagnosis {

class Playback {
 public:
  // Probes with a conventional name stand for that place; another one for the first place that has
  // none (coil, case, board, ...). The coil's mean is made from outer and inner where both are
  // measured. A place nobody measures borrows the nearest one's temperature, 25 °C if there is
  // none. O(intervals).
  explicit Playback(const MeasuredSeries& series);

  // Measured, or made from what is measured; not borrowed.
  [[nodiscard]] bool measures(twin::TemperaturePoint point) const;
  [[nodiscard]] std::vector<twin::TemperaturePoint> measured_points() const;
  // The coil, where its outer and inner layers are measured and it isn't.
  [[nodiscard]] bool is_mean_of_faces(twin::TemperaturePoint point) const {
    return point == twin::TemperaturePoint::kCoil && coil_is_mean_;
  }
  // Whose temperature a place has; empty where there is none at all.
  [[nodiscard]] std::optional<twin::TemperaturePoint> source_of(twin::TemperaturePoint point) const;

  [[nodiscard]] std::span<const twin::EffectInputs> inputs() const { return inputs_; }
  [[nodiscard]] double interval_s() const { return interval_s_; }

  // What one effect that is a waveform adds in each interval, rad/s; 0 where it isn't finite.
  // `context` gives all parameters and inputs.
  [[nodiscard]] std::vector<double> run(const twin::EffectDefinition& definition,
                                        const twin::EffectContext& context) const;

  // The same record as means over blocks of so many intervals; what is left over at the end is left
  // out. O(intervals).
  [[nodiscard]] Playback averaged(std::size_t block) const;

  // Sum of the model's waveforms of one axis, rad/s. Effects without parameters, and those of a
  // newer catalogue, add nothing.
  [[nodiscard]] std::vector<double> drift(const twin::Model& model, core::Axis axis) const;

 private:
  void assign_probes(const MeasuredSeries& series);
  void set_thermal(const MeasuredSeries& series, std::size_t i, twin::ThermalState& state) const;

  double interval_s_ = 1.0;
  twin::PerPoint<std::optional<std::size_t>> probe_{};  // index of the probe that stands for it
  bool coil_is_mean_ = false;
  std::vector<twin::EffectInputs> inputs_;
};

// A context with the catalogue's defaults, no noise.
[[nodiscard]] twin::EffectContext default_context(const twin::EffectDefinition& definition,
                                                  core::Axis axis, double interval_s);

// The context of an effect of a model: its parameters and inputs where given, defaults elsewhere.
[[nodiscard]] twin::EffectContext context_of(const twin::EffectSpec& spec,
                                             const twin::EffectDefinition& definition,
                                             double interval_s);

// Of a measured place over the record, °C.
[[nodiscard]] std::vector<double> temperatures(const Playback& playback,
                                               twin::TemperaturePoint point);

}  // namespace zerodrift::diagnosis
