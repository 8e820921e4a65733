// SPDX-License-Identifier: Apache-2.0
#include "common/twin/profile.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace zerodrift::twin {
namespace {

constexpr double kAbsoluteZeroDegc = -273.15;

bool is_temperature(double value_degc) {
  return std::isfinite(value_degc) && value_degc > kAbsoluteZeroDegc;
}

std::string at(const char* list, std::size_t i, const char* key) {
  return std::string(list) + '[' + std::to_string(i) + "]." + key;
}

std::string found(double value) {
  return ", found " + std::to_string(value);
}

std::optional<Problem> problem_of_chamber(const std::vector<ChamberPoint>& chamber) {
  double previous_s = 0.0;
  for (std::size_t i = 0; i < chamber.size(); ++i) {
    if (!std::isfinite(chamber[i].time_s) || chamber[i].time_s < previous_s) {
      return Problem{at("chamber", i, "time_s"),
                     "times must be >= 0 and must not decrease" + found(chamber[i].time_s)};
    }
    if (!is_temperature(chamber[i].temperature_degc)) {
      return Problem{at("chamber", i, "temperature_degc"),
                     "must be above -273.15 °C" + found(chamber[i].temperature_degc)};
    }
    previous_s = chamber[i].time_s;
  }
  return std::nullopt;
}

std::optional<Problem> problem_of_turn(const Turn& turn, std::size_t i) {
  if (!std::isfinite(turn.start_s) || turn.start_s < 0.0) {
    return Problem{at("turns", i, "start_s"), "must be >= 0 s" + found(turn.start_s)};
  }
  if (!std::isfinite(turn.duration_s) || turn.duration_s <= 0.0) {
    return Problem{at("turns", i, "duration_s"), "must be > 0 s" + found(turn.duration_s)};
  }
  if (!std::isfinite(turn.rate_radps)) {
    return Problem{at("turns", i, "rate_deg_s"), "must be finite" + found(turn.rate_radps)};
  }
  if (!(turn.ramp_s >= 0.0 && 2.0 * turn.ramp_s <= turn.duration_s)) {
    return Problem{at("turns", i, "ramp_s"),
                   "must be within 0 and half of duration_s" + found(turn.ramp_s)};
  }
  return std::nullopt;
}

std::optional<Problem> problem_of_excitation(const Excitation& excitation, std::size_t i) {
  if (!std::isfinite(excitation.start_s) || excitation.start_s < 0.0) {
    return Problem{at("excitations", i, "start_s"), "must be >= 0 s" + found(excitation.start_s)};
  }
  if (!std::isfinite(excitation.duration_s) || excitation.duration_s <= 0.0) {
    return Problem{at("excitations", i, "duration_s"),
                   "must be > 0 s" + found(excitation.duration_s)};
  }
  if (!(std::abs(excitation.value) <= 1e9)) {
    return Problem{at("excitations", i, "value"),
                   "must be within -1e9 and 1e9" + found(excitation.value)};
  }
  if (!(excitation.ramp_s >= 0.0 && 2.0 * excitation.ramp_s <= excitation.duration_s)) {
    return Problem{at("excitations", i, "ramp_s"),
                   "must be within 0 and half of duration_s" + found(excitation.ramp_s)};
  }
  return std::nullopt;
}

std::optional<Problem> problem_of_power_cycles(const Profile& profile) {
  double on_s = profile.power_on_s;
  for (std::size_t i = 0; i < profile.power_cycles.size(); ++i) {
    const PowerCycle& cycle = profile.power_cycles[i];
    if (!(cycle.off_s > on_s)) {
      return Problem{at("power_cycles", i, "off_s"), "must be after the power-on before it, at " +
                                                         std::to_string(on_s) + " s" +
                                                         found(cycle.off_s)};
    }
    if (!(cycle.on_s > cycle.off_s && cycle.on_s <= 1e9)) {
      return Problem{at("power_cycles", i, "on_s"), "must be after off_s" + found(cycle.on_s)};
    }
    on_s = cycle.on_s;
  }
  return std::nullopt;
}

std::optional<Problem> problem_of_earth_rate(const EarthRateSetup& setup) {
  if (!(std::abs(setup.latitude_rad) <= std::numbers::pi / 2.0 + 1e-12)) {
    return Problem{"earth_rate.latitude_deg", "must be within -90 and 90 degrees"};
  }
  if (!std::isfinite(setup.heading_rad + setup.pitch_rad + setup.roll_rad)) {
    return Problem{"earth_rate", "heading_deg, pitch_deg and roll_deg must be finite"};
  }
  return std::nullopt;
}

}  // namespace

std::span<const std::string> excited_quantity_names() {
  static const std::array<std::string, 5> kNames{"magnetic_ut", "acceleration_mps2", "vibration_g",
                                                 "source_current_ma", "supply_v"};
  return kNames;
}

std::optional<ExcitedQuantity> excited_quantity(std::string_view name) {
  const auto names = excited_quantity_names();
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end()) return std::nullopt;
  return static_cast<ExcitedQuantity>(found - names.begin());
}

bool has_axis(ExcitedQuantity quantity) noexcept {
  return quantity == ExcitedQuantity::kMagneticUt || quantity == ExcitedQuantity::kAccelerationMps2;
}

std::optional<Problem> Profile::find_problem() const {
  if (!(duration_s > 0.0 && duration_s <= 1e8)) {
    return Problem{"duration_s", "must be within 0 and 1e8 s" + found(duration_s)};
  }
  if (!is_temperature(initial_temperature_degc)) {
    return Problem{"initial_temperature_degc",
                   "must be above -273.15 °C" + found(initial_temperature_degc)};
  }
  if (!(std::abs(power_on_s) <= 1e6)) {
    return Problem{"power_on_s", "must be within -1e6 and 1e6 s" + found(power_on_s)};
  }
  if (auto problem = problem_of_power_cycles(*this)) return problem;
  if (auto problem = problem_of_chamber(chamber)) return problem;
  for (std::size_t i = 0; i < turns.size(); ++i) {
    if (auto problem = problem_of_turn(turns[i], i)) return problem;
  }
  for (std::size_t i = 0; i < excitations.size(); ++i) {
    if (auto problem = problem_of_excitation(excitations[i], i)) return problem;
  }
  return earth_rate ? problem_of_earth_rate(*earth_rate) : std::nullopt;
}

std::optional<std::string> Profile::validate() const {
  const auto problem = find_problem();
  return problem ? std::optional<std::string>(problem->text()) : std::nullopt;
}

double chamber_temperature_degc(const Profile& profile, double time_s) noexcept {
  ChamberPoint from{0.0, profile.initial_temperature_degc};
  if (time_s < 0.0) return from.temperature_degc;
  for (const ChamberPoint& to : profile.chamber) {
    if (time_s < to.time_s) {
      const double share = (time_s - from.time_s) / (to.time_s - from.time_s);
      return from.temperature_degc + share * (to.temperature_degc - from.temperature_degc);
    }
    from = to;
  }
  return from.temperature_degc;
}

PowerState power_at(const Profile& profile, double time_s) noexcept {
  PowerState state{Power::kNotYetOn, time_s - profile.power_on_s};
  if (state.since_on_s < 0.0) return state;
  state.power = Power::kOn;
  for (const PowerCycle& cycle : profile.power_cycles) {
    if (time_s < cycle.off_s) break;
    state.power = time_s < cycle.on_s ? Power::kOff : Power::kOn;
    if (state.power == Power::kOn) state.since_on_s = time_s - cycle.on_s;
  }
  return state;
}

double excited_value(const Excitation& excitation, double time_s) noexcept {
  const double elapsed_s = time_s - excitation.start_s;
  const double left_s = excitation.duration_s - elapsed_s;
  if (elapsed_s < 0.0 || left_s <= 0.0) return 0.0;
  const double from_edge_s = std::min(elapsed_s, left_s);
  if (from_edge_s >= excitation.ramp_s) return excitation.value;
  return excitation.value * from_edge_s / excitation.ramp_s;
}

double turned_angle_rad(const Turn& turn, double time_s) noexcept {
  const double elapsed_s = std::clamp(time_s - turn.start_s, 0.0, turn.duration_s);
  if (elapsed_s < turn.ramp_s) {
    return turn.rate_radps * elapsed_s * elapsed_s / (2.0 * turn.ramp_s);
  }
  const double left_s = turn.duration_s - elapsed_s;
  if (left_s >= turn.ramp_s) return turn.rate_radps * (elapsed_s - turn.ramp_s / 2.0);
  const double whole_rad = turn.rate_radps * (turn.duration_s - turn.ramp_s);
  return whole_rad - turn.rate_radps * left_s * left_s / (2.0 * turn.ramp_s);
}

}  // namespace zerodrift::twin
