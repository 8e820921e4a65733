// SPDX-License-Identifier: Apache-2.0
#include "common/twin/chamber_limits.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <vector>

#include "common/core/units.h"
#include "common/twin/effect.h"

namespace zerodrift::twin {
namespace {

// A bound written in degrees and a profile that keeps it differ by rounding.
constexpr double kRounding = 1e-9;
constexpr double kLeastRangeDegc = 1.0;  // that is worth a chamber

std::string text_of(double value) {
  std::ostringstream text;
  text << value;
  return text.str();
}

std::optional<std::string> excess(const char* key, double found, const std::optional<double>& most,
                                  double per_unit = 1.0) {
  if (!(found > 0.0)) return std::nullopt;
  const std::string head = std::string(key) + ": found " + text_of(found / per_unit);
  if (!most) return head + ", expected none: these limits don't have the key";
  if (found <= *most * (1.0 + kRounding)) return std::nullopt;
  return head + ", expected at most " + text_of(*most / per_unit);
}

std::optional<std::string> excess_of_temperature(const Profile& profile,
                                                 const ChamberLimits& limits) {
  double lowest = profile.initial_temperature_degc;
  double highest = lowest;
  double steepest = 0.0;
  ChamberPoint from{0.0, profile.initial_temperature_degc};
  for (const ChamberPoint& to : profile.chamber) {
    if (from.time_s >= profile.duration_s) break;
    const double change = std::abs(to.temperature_degc - from.temperature_degc);
    if (change > 0.0) steepest = std::max(steepest, change / (to.time_s - from.time_s));
    lowest = std::min(lowest, to.temperature_degc);
    highest = std::max(highest, to.temperature_degc);
    from = to;
  }
  if (!(highest > lowest)) return std::nullopt;  // whatever it is, nothing moves it
  if (!limits.moves_temperature())
    return "temperature: found a change, expected none: these limits don't have the key";
  if (lowest < *limits.low_degc - kRounding) {
    return "temperature.low_degc: found " + text_of(lowest) + ", expected at least " +
           text_of(*limits.low_degc);
  }
  if (highest > *limits.high_degc + kRounding) {
    return "temperature.high_degc: found " + text_of(highest) + ", expected at most " +
           text_of(*limits.high_degc);
  }
  return excess("temperature.ramp_degc_per_min", steepest, limits.ramp_degc_per_s, 1.0 / 60.0);
}

// Largest magnitude that a quantity has at any time: it changes at edges of excitations alone.
double largest(const Profile& profile, ExcitedQuantity quantity, core::Axis axis) {
  std::vector<Excitation> same;
  for (const Excitation& one : profile.excitations) {
    if (one.quantity == quantity && (!has_axis(quantity) || one.axis == axis)) same.push_back(one);
  }
  double most = 0.0;
  for (const Excitation& at : same) {
    for (const double time_s : {at.start_s + at.ramp_s, at.start_s + at.duration_s - at.ramp_s}) {
      double sum = 0.0;
      for (const Excitation& other : same) sum += excited_value(other, time_s);
      most = std::max(most, std::abs(sum));
    }
  }
  return most;
}

std::optional<std::string> excess_of_surroundings(const Profile& profile,
                                                  const ChamberLimits& limits) {
  using enum ExcitedQuantity;
  const auto of = [&](ExcitedQuantity quantity) {
    double most = 0.0;
    for (const core::Axis axis : core::kAxes)
      most = std::max(most, largest(profile, quantity, axis));
    return most;
  };
  if (auto found = excess("magnetic.largest_ut", of(kMagneticUt), limits.magnetic_ut)) return found;
  double tilt = 0.0;
  for (const core::Axis axis : {core::Axis::kX, core::Axis::kY}) {
    const double share = largest(profile, kAccelerationMps2, axis) / core::kStandardGravityMps2;
    tilt = std::max(tilt, std::asin(std::min(share, 1.0)));
  }
  if (auto found = excess("tilt.largest_deg", tilt, limits.tilt_rad, core::kRadPerDeg))
    return found;
  if (auto found = excess("vibration.largest_g", of(kVibrationG), limits.vibration_g)) return found;
  if (auto found =
          excess("source_current.change_ma", of(kSourceCurrentMa), limits.source_current_ma))
    return found;
  return excess("supply.change_v", of(kSupplyV), limits.supply_v);
}

}  // namespace

std::optional<Problem> ChamberLimits::find_problem() const {
  if (low_degc.has_value() != high_degc.has_value() ||
      low_degc.has_value() != ramp_degc_per_s.has_value()) {
    const char* missing = !low_degc ? "low_degc" : !high_degc ? "high_degc" : "ramp_degc_per_min";
    return Problem{"temperature", std::string("found no ") + missing +
                                      ", expected low_degc, high_degc and ramp_degc_per_min "
                                      "together, or none of them"};
  }
  if (low_degc && !(*low_degc < *high_degc)) {
    return Problem{
        "temperature.high_degc",
        "found " + text_of(*high_degc) + ", expected more than low_degc, " + text_of(*low_degc)};
  }
  return std::nullopt;
}

std::optional<std::string> find_excess(const Profile& profile, const ChamberLimits& limits) {
  if (profile.duration_s > limits.duration_s * (1.0 + kRounding)) {
    return "duration_s: found " + text_of(profile.duration_s) + ", expected at most " +
           text_of(limits.duration_s);
  }
  if (auto found = excess_of_temperature(profile, limits)) return found;
  double fastest = 0.0;
  for (const Turn& turn : profile.turns) fastest = std::max(fastest, std::abs(turn.rate_radps));
  if (auto found = excess("rate_table.largest_deg_s", fastest, limits.rate_radps, core::kRadPerDeg))
    return found;
  if (!profile.power_cycles.empty() && !limits.off_s)
    return "power.off_s: found a power cycle, expected none: these limits don't have the key";
  return excess_of_surroundings(profile, limits);
}

}  // namespace zerodrift::twin
