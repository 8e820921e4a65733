// SPDX-License-Identifier: Apache-2.0
#include "common/navigation/earth_rate.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace zerodrift::navigation {
namespace {

struct Pair {
  double first;
  double second;
};

// Components of one plane vector in axes turned by `angle` from the first axis towards the second.
Pair in_turned_axes(double first, double second, double angle_rad) noexcept {
  const double c = std::cos(angle_rad);
  const double s = std::sin(angle_rad);
  return {c * first + s * second, c * second - s * first};
}

}  // namespace

core::PerAxis<double> earth_rate_radps_b(double latitude_rad, const Attitude& attitude,
                                         BodyFrame frame) noexcept {
  const double north = core::kEarthRateRadps * std::cos(latitude_rad);
  const double down = -core::kEarthRateRadps * std::sin(latitude_rad);
  const Pair after_heading = in_turned_axes(north, 0.0, attitude.heading_rad);             // x to y
  const Pair after_pitch = in_turned_axes(down, after_heading.first, attitude.pitch_rad);  // z to x
  const Pair after_roll =
      in_turned_axes(after_heading.second, after_pitch.first, attitude.roll_rad);  // y to z
  const double forward = after_pitch.second;
  const double right = after_roll.first;
  const double body_down = after_roll.second;
  if (frame == BodyFrame::kForwardRightDown) return {forward, right, body_down};
  return {forward, -right, -body_down};
}

std::optional<std::string> EarthRateOptions::validate() const {
  if (latitude_rad && !(std::abs(*latitude_rad) <= std::numbers::pi / 2.0)) {
    return "latitude_rad is " + std::to_string(*latitude_rad) + ", must be -pi/2 to pi/2";
  }
  if (attitude && !(std::isfinite(attitude->roll_rad) && std::isfinite(attitude->pitch_rad) &&
                    std::isfinite(attitude->heading_rad))) {
    return "attitude is not finite, must be three angles in rad";
  }
  if (attitude && !latitude_rad) {
    return "latitude_rad is missing, must be given beside attitude";
  }
  if (!(attitude_sigma_rad >= 0.0 && attitude_sigma_rad <= std::numbers::pi)) {
    return "attitude_sigma_rad is " + std::to_string(attitude_sigma_rad) + ", must be 0 to pi";
  }
  return std::nullopt;
}

EarthRate earth_rate(const EarthRateOptions& options) {
  if (const auto problem = options.validate()) throw std::invalid_argument(*problem);
  constexpr double kUnknownVariance = kUnknownAttitudeSigmaRadps * kUnknownAttitudeSigmaRadps;
  EarthRate result;
  result.variance.fill(kUnknownVariance);
  if (!options.latitude_rad || !options.attitude) return result;

  result.rate_radps_b = earth_rate_radps_b(*options.latitude_rad, *options.attitude, options.frame);
  const double attitude_variance = options.attitude_sigma_rad * options.attitude_sigma_rad;
  for (std::size_t i = 0; i < core::kAxisCount; ++i) {
    const double rate = result.rate_radps_b[i];
    const double across = std::max(0.0, kUnknownVariance - rate * rate);
    result.variance[i] = std::min(kUnknownVariance, attitude_variance * across);
  }
  return result;
}

}  // namespace zerodrift::navigation
