// SPDX-License-Identifier: Apache-2.0
// What the temperature was up to a given span ago, kept as one mean a step.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "common/core/ring_buffer.h"
#include "common/core/state_archive.h"
#include "common/core/time.h"

namespace zerodrift::thermal {

struct Reading {
  core::SensorTime time{0};
  double temperature_degc = 0.0;

  void carry(core::StateArchive& archive) { archive(time, temperature_degc); }
};

// Keeps mean time and mean temperature of each interval [i step, (i + 1) step) that had readings.
// Cost of a reading O(1), of a look-up O(log(span / step)). Allocates once, in the constructor.
class DecimatedHistory {
 public:
  // span_s >= 0, step_s > 0, max_interpolation_s > 0 (asserted): longest distance bridged between
  // neighbouring points.
  DecimatedHistory(double span_s, double step_s, double max_interpolation_s);

  // Times must be usable and ascend (asserted; TemperatureTrack refuses others).
  void add(const Reading& reading) noexcept;
  void reset() noexcept;

  // Temperature in °C at `time`, by linear interpolation between the kept means and the newest
  // reading. Nothing before the first point, after the newest reading, or where the neighbours are
  // too far apart.
  [[nodiscard]] std::optional<double> at(core::SensorTime time) const noexcept;

  // Its state (core/state_archive.h); only one whose newest reading is `newest`.
  void carry(core::StateArchive& archive, const std::optional<Reading>& newest);

 private:
  void close_step() noexcept;
  [[nodiscard]] std::size_t first_point_after(core::SensorTime time) const noexcept;
  [[nodiscard]] std::optional<double> interpolate(const Reading& before, const Reading& after,
                                                  core::SensorTime time) const noexcept;

  core::SensorTime step_;
  core::SensorTime max_interpolation_;
  core::RingBuffer<Reading> points_;
  std::optional<Reading> newest_;
  std::int64_t open_step_ = 0;
  std::uint64_t open_readings_ = 0;
  double open_offset_sum_s_ = 0.0;  // times since the open step's start
  double open_temperature_sum_degc_ = 0.0;
};

}  // namespace zerodrift::thermal
