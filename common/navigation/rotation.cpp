// SPDX-License-Identifier: Apache-2.0
#include "common/navigation/rotation.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace zerodrift::navigation {
namespace {

constexpr double kSmallAngle = 1e-4;       // rad; the series' next term is below 1e-18 there
constexpr double kVertical = 1.0 - 1e-12;  // of the sine of a pitch that leaves roll undefined

}  // namespace

Quaternion quaternion_of(const Vector3& rotation) noexcept {
  const double angle = rotation.norm();
  const double square = angle * angle;
  const double half_sinc =
      angle < kSmallAngle ? 0.5 - square / 48.0 : std::sin(0.5 * angle) / angle;
  const double cosine = angle < kSmallAngle ? 1.0 - square / 8.0 : std::cos(0.5 * angle);
  return {cosine, half_sinc * rotation.x(), half_sinc * rotation.y(), half_sinc * rotation.z()};
}

Vector3 rotation_vector(const Quaternion& quaternion) noexcept {
  const double sign = quaternion.w() < 0.0 ? -1.0 : 1.0;
  const Vector3 vector = sign * quaternion.vec();
  const double sine = vector.norm();
  if (sine == 0.0) return 2.0 * vector;
  return 2.0 * std::atan2(sine, sign * quaternion.w()) / sine * vector;
}

Quaternion n_from_b(const Attitude& attitude) noexcept {
  return Quaternion(Eigen::AngleAxisd(attitude.heading_rad, Vector3::UnitZ()) *
                    Eigen::AngleAxisd(attitude.pitch_rad, Vector3::UnitY()) *
                    Eigen::AngleAxisd(attitude.roll_rad, Vector3::UnitX()));
}

Attitude attitude_of(const Quaternion& n_from_b) noexcept {
  const Matrix3 c = n_from_b.toRotationMatrix();
  const double sine = std::clamp(-c(2, 0), -1.0, 1.0);
  if (std::abs(sine) > kVertical)
    return {.pitch_rad = std::asin(sine), .heading_rad = std::atan2(-c(0, 1), c(1, 1))};
  return {.roll_rad = std::atan2(c(2, 1), c(2, 2)),
          .pitch_rad = std::asin(sine),
          .heading_rad = std::atan2(c(1, 0), c(0, 0))};
}

double wrapped(double angle_rad) noexcept {
  return std::remainder(angle_rad, 2.0 * std::numbers::pi);
}

Vector3 earth_rate_radps_n(double latitude_rad) noexcept {
  return core::kEarthRateRadps * Vector3(std::cos(latitude_rad), 0.0, -std::sin(latitude_rad));
}

}  // namespace zerodrift::navigation
