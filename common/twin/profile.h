// SPDX-License-Identifier: Apache-2.0
// What an experiment does to the gyro: chamber temperature, power, motion, field, tilt, vibration,
// source current and supply. Plain data; the file
// form is idl/proto/twin.proto (common/config/twin_config.h). Time 0 is the start of the record.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
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

// What else than temperature and motion an experiment may change.
enum class ExcitedQuantity {
  kMagneticUt,        // along an axis
  kAccelerationMps2,  // specific force along an axis: gravity is an excitation of the whole record,
                      // a tilt one of each axis it changes
  kVibrationG,        // rms
  kSourceCurrentMa,
  kSupplyV,
};

// "magnetic_ut", "acceleration_mps2", "vibration_g", "source_current_ma", "supply_v", in the order
// of the enumerators.
[[nodiscard]] std::span<const std::string> excited_quantity_names();
[[nodiscard]] std::optional<ExcitedQuantity> excited_quantity(std::string_view name);
// Field and acceleration.
[[nodiscard]] bool has_axis(ExcitedQuantity quantity) noexcept;

// Adds a value to a quantity for a while: up over ramp_s, constant, down over ramp_s; duration_s in
// all. Excitations of one quantity add up, on 0 for field, acceleration and vibration, on the
// nominal value (effect.h) for source current and supply.
struct Excitation {
  double start_s = 0.0;
  double duration_s = 0.0;
  ExcitedQuantity quantity = ExcitedQuantity::kMagneticUt;
  core::Axis axis = core::Axis::kX;  // where the quantity has one
  double value = 0.0;                // in the quantity's unit
  double ramp_s = 0.0;
};

// Switched off and, later, on again.
struct PowerCycle {
  double off_s = 0.0;
  double on_s = 0.0;
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
  std::vector<PowerCycle> power_cycles;    // after power_on_s, one after the other
  // Air temperature: from the initial one at time 0 straight to the first point, straight between
  // points, constant after the last. Two points at one time are a step.
  std::vector<ChamberPoint> chamber;
  std::vector<Turn> turns;
  std::vector<Excitation> excitations;
  std::optional<EarthRateSetup> earth_rate;  // none: the gyro is simulated without Earth rate

  [[nodiscard]] std::optional<Problem> find_problem() const;
  [[nodiscard]] std::optional<std::string> validate() const;
};

// Air temperature at a time, °C. O(points).
[[nodiscard]] double chamber_temperature_degc(const Profile& profile, double time_s) noexcept;

enum class Power { kNotYetOn, kOn, kOff };  // kOff: between the times of a power cycle

struct PowerState {
  Power power = Power::kNotYetOn;
  double since_on_s = 0.0;  // since the last power-on; negative before the first
};

// O(power cycles).
[[nodiscard]] PowerState power_at(const Profile& profile, double time_s) noexcept;

// What an excitation adds at a time, in its quantity's unit.
[[nodiscard]] double excited_value(const Excitation& excitation, double time_s) noexcept;

// Angle turned through since the turn's start, rad.
[[nodiscard]] double turned_angle_rad(const Turn& turn, double time_s) noexcept;

}  // namespace zerodrift::twin
