// SPDX-License-Identifier: Apache-2.0
// Unit conversions. SI inside (rad/s, s, m/s²), deg/h only in reports and records; temperature
// stays in °C.
#pragma once

#include <numbers>

namespace zerodrift::core {

inline constexpr double kRadPerDeg = std::numbers::pi / 180.0;
inline constexpr double kSecondsPerHour = 3600.0;

// deg/h -> rad/s and back.
inline constexpr double kRadPerSecPerDegPerHour = kRadPerDeg / kSecondsPerHour;
constexpr double radps_from_deg_h(double rate_deg_h) {
  return rate_deg_h * kRadPerSecPerDegPerHour;
}
constexpr double deg_h_from_radps(double rate_radps) {
  return rate_radps / kRadPerSecPerDegPerHour;
}

// Standard gravity, m/s², by definition (3rd CGPM, 1901).
inline constexpr double kStandardGravityMps2 = 9.80665;

// Earth's sidereal rotation rate, rad/s (WGS 84).
inline constexpr double kEarthRateRadps = 7.292115e-5;

}  // namespace zerodrift::core
