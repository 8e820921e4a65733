// SPDX-License-Identifier: Apache-2.0
// What an experiment does to the gyro: chamber temperature, power, motion. Plain data; the file
// form is idl/proto/twin.proto (common/config/twin_config.h). Time 0 is the start of the record.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/core/axis.h"
#include "common/twin/model.h"

namespace zerodrift::twin {

struct ChamberPoint {
  double time_s = 0.0;
  double temperature_degc = 0.0;
};

// A turn about one body axis: rate up over ramp_s, constant, down over ramp_s; duration_s in all.
struct Turn {
  double start_s = 0.0;
  double duration_s = 0.0;
  core::Axis axis = core::Axis::kX;
  double rate_radps = 0.0;
  double ramp_s = 0.0;
};

// Where and how the gyro lies at the start, so that Earth rate is part of its true rate. Navigation
// frame north-west-up, body frame forward-left-up: heading clockwise from north, pitch nose up,
// roll right side down, applied in that order.
struct EarthRateSetup {
  double latitude_rad = 0.0;
  double heading_rad = 0.0;
  double pitch_rad = 0.0;
  double roll_rad = 0.0;
};

struct Profile {
  std::string name;
  double duration_s = 0.0;
  double initial_temperature_degc = 20.0;  // everything has soaked at it when the record starts
  double power_on_s = 0.0;                 // may be before the record (negative) or within it
  // Air temperature: from the initial one at time 0 straight to the first point, straight between
  // points, constant after the last. Two points at one time are a step.
  std::vector<ChamberPoint> chamber;
  std::vector<Turn> turns;
  std::optional<EarthRateSetup> earth_rate;  // none: the gyro is simulated without Earth rate

  [[nodiscard]] std::optional<Problem> find_problem() const;
  [[nodiscard]] std::optional<std::string> validate() const;
};

// Air temperature at a time, °C. O(points).
[[nodiscard]] double chamber_temperature_degc(const Profile& profile, double time_s) noexcept;

// Angle turned through since the turn's start, rad.
[[nodiscard]] double turned_angle_rad(const Turn& turn, double time_s) noexcept;

}  // namespace zerodrift::twin
