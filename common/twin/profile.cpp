// SPDX-License-Identifier: Apache-2.0
#include "common/twin/profile.h"

#include <algorithm>
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
  if (auto problem = problem_of_chamber(chamber)) return problem;
  for (std::size_t i = 0; i < turns.size(); ++i) {
    if (auto problem = problem_of_turn(turns[i], i)) return problem;
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
