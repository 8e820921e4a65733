// SPDX-License-Identifier: Apache-2.0
// What a gyro at rest measures: the Earth's rotation, resolved in its body frame.
//
// Local level frame n: north-east-down. Earth rate in n: (W cos L, 0, -W sin L), L geodetic
// latitude, W the sidereal rate (Groves, Principles of GNSS, Inertial, and Multisensor Integrated
// Navigation Systems, 2nd ed., eq. 2.123). Attitude: heading, then pitch, then roll take n to the
// forward-right-down body frame (z-y'-x'' rotations, Groves eq. 2.22). Heading clockwise from north
// seen from above, pitch positive nose up, roll positive right side down. A forward-left-up body
// frame has the same attitude angles; its y and z components change sign.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "common/core/axis.h"
#include "common/core/units.h"

namespace zerodrift::navigation {

enum class BodyFrame : std::uint8_t { kForwardLeftUp, kForwardRightDown };

struct Attitude {
  double roll_rad = 0.0;
  double pitch_rad = 0.0;
  double heading_rad = 0.0;
};

// Earth rate in b, rad/s. Angles any finite value; O(1), noexcept.
[[nodiscard]] core::PerAxis<double> earth_rate_radps_b(
    double latitude_rad, const Attitude& attitude,
    BodyFrame frame = BodyFrame::kForwardLeftUp) noexcept;

// Standard deviation of the Earth rate on any axis when attitude is unknown and zero is assumed:
// the whole Earth rate, 15.04 deg/h. A bound, since no axis can see more; a random attitude gives W
// / sqrt(3) rms.
inline constexpr double kUnknownAttitudeSigmaRadps = core::kEarthRateRadps;

// What is known of where the gyro stands. Without latitude and attitude, Earth rate is uncertainty.
struct EarthRateOptions {
  std::optional<double> latitude_rad{};  // geodetic, north positive, [-pi/2, pi/2]
  std::optional<Attitude> attitude{};
  double attitude_sigma_rad = 0.0;  // of a small rotation about each axis, independent
  BodyFrame frame = BodyFrame::kForwardLeftUp;

  // Nothing when usable, else one line that names the wrong key.
  [[nodiscard]] std::optional<std::string> validate() const;
};

struct EarthRate {
  core::PerAxis<double> rate_radps_b{};
  core::PerAxis<double> variance{};  // (rad/s)²
};

// With latitude and attitude: the Earth rate, and its variance to first order in a small attitude
// error phi, d(w) = w x phi, so variance_i = sigma² (|w|² - w_i²), never above the unknown
// attitude's. Without either: zero rate and kUnknownAttitudeSigmaRadps² on each axis. Throws
// std::invalid_argument with validate()'s line.
[[nodiscard]] EarthRate earth_rate(const EarthRateOptions& options);

}  // namespace zerodrift::navigation
