// SPDX-License-Identifier: Apache-2.0
#include "common/navigation/gyrocompass.h"

#include <algorithm>
#include <cmath>

namespace zerodrift::navigation {
namespace {

constexpr double kSmallestCosine = 0.02;  // of the latitude: a hundred km from a pole
constexpr double kLargestSigma = 0.3;     // rad; first order holds below

}  // namespace

CompassResult gyrocompass(const CompassInput& input) noexcept {
  CompassResult result;
  if (!std::all_of(input.measured.begin(), input.measured.end(), [](bool m) { return m; }))
    return result;
  const double cosine = std::cos(input.latitude_rad);
  if (cosine < kSmallestCosine) return {.verdict = CompassVerdict::kNearPole};
  const Quaternion level_from_b =
      n_from_b({.roll_rad = input.roll_rad, .pitch_rad = input.pitch_rad});
  const Vector3 level = level_from_b * input.rate_radps;
  const double horizontal = core::kEarthRateRadps * cosine;
  const double vertical = core::kEarthRateRadps * std::sin(input.latitude_rad);
  result.heading_rad = std::atan2(-level.y(), level.x());
  result.excess_radps = std::hypot(level.x(), level.y()) - horizontal;
  // Across north, in the level plane, and what of each body axis lies there.
  const Vector3 across(std::sin(result.heading_rad), std::cos(result.heading_rad), 0.0);
  const Vector3 share = level_from_b.conjugate() * across;
  const double leak = vertical * input.tilt_sigma_rad;
  const double variance = share.cwiseProduct(input.drift_sigma_radps).squaredNorm() + leak * leak;
  result.sigma_rad = std::sqrt(variance) / horizontal;
  result.verdict =
      result.sigma_rad <= kLargestSigma ? CompassVerdict::kFound : CompassVerdict::kDriftTooLarge;
  return result;
}

}  // namespace zerodrift::navigation
