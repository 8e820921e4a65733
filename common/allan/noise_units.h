// SPDX-License-Identifier: Apache-2.0
// Noise coefficients between SI (inside) and the units of gyro data sheets (reports).
#pragma once

#include "common/core/units.h"

namespace zerodrift::allan {

// N: 1 rad/√s in deg/√h. An hour has 3600 s, its root 60.
inline constexpr double kDegPerRootHour = 60.0 / core::kRadPerDeg;
// K: 1 rad/s^1.5 in deg/h^1.5.
inline constexpr double kDegPerHourPerRootHour = 3600.0 * 60.0 / core::kRadPerDeg;
// R: 1 rad/s² in deg/h².
inline constexpr double kDegPerHourPerHour = 3600.0 * 3600.0 / core::kRadPerDeg;

constexpr double angle_random_walk_deg_rth(double n_rad_rts) {
  return n_rad_rts * kDegPerRootHour;
}
constexpr double angle_random_walk_rad_rts(double n_deg_rth) {
  return n_deg_rth / kDegPerRootHour;
}
constexpr double rate_random_walk_deg_h_rth(double k_radps_rts) {
  return k_radps_rts * kDegPerHourPerRootHour;
}
constexpr double rate_random_walk_radps_rts(double k_deg_h_rth) {
  return k_deg_h_rth / kDegPerHourPerRootHour;
}
// B is a rate: core::deg_h_from_radps. Q is an angle: radians times 1 / core::kRadPerDeg.

}  // namespace zerodrift::allan
