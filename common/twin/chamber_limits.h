// SPDX-License-Identifier: Apache-2.0
// What a laboratory can do to a gyro: the bounds that an experiment keeps. Plain data; the file's
// keys are in common/config/chamber_limits_config.h.
#pragma once

#include <optional>
#include <string>

#include "common/twin/profile.h"

namespace zerodrift::twin {

// A bound that is absent: that channel can't be moved. Each is the largest magnitude, both ways.
struct ChamberLimits {
  double duration_s = 0.0;     // of the longest experiment
  double ambient_degc = 20.0;  // where no chamber moves it
  std::optional<double> low_degc{};
  std::optional<double> high_degc{};
  std::optional<double> ramp_degc_per_s{};
  double soak_s = 900.0;                      // shortest hold at a temperature
  std::optional<double> rate_radps{};         // rate table, about each axis
  std::optional<double> magnetic_ut{};        // coils, along each axis
  std::optional<double> tilt_rad{};           // about x and about y, from z upwards
  std::optional<double> vibration_g{};        // rms
  std::optional<double> source_current_ma{};  // away from the nominal value
  std::optional<double> supply_v{};           // away from the nominal value
  std::optional<double> off_s{};              // how long the gyro stays off when it is switched off

  [[nodiscard]] bool moves_temperature() const { return low_degc.has_value(); }
  // The first contradiction by its key in the file, or none.
  [[nodiscard]] std::optional<Problem> find_problem() const;
};

// What a profile does that the limits don't allow, as "rate_table.largest_deg_s: found 20, expected
// at most 10"; nothing where it fits. O(points + turns + excitations²).
[[nodiscard]] std::optional<std::string> find_excess(const Profile& profile,
                                                     const ChamberLimits& limits);

}  // namespace zerodrift::twin
