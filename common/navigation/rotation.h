// SPDX-License-Identifier: Apache-2.0
// Rotations as this folder needs them: vectors and quaternions, body frames, Euler angles.
//
// Inside, the body frame is forward-right-down and n is north-east-down; `n_from_b` takes vectors
// of b to n. Everything is O(1), noexcept and allocates nothing.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "common/core/axis.h"
#include "common/navigation/earth_rate.h"

namespace zerodrift::navigation {

using Vector3 = Eigen::Vector3d;
using Matrix3 = Eigen::Matrix3d;
using Quaternion = Eigen::Quaterniond;

// Between forward-left-up and forward-right-down: y and z change sign, either way. A frame's own
// components come out unchanged.
[[nodiscard]] inline Vector3 to_forward_right_down(const core::PerAxis<double>& vector,
                                                   BodyFrame frame) noexcept {
  const double sign = frame == BodyFrame::kForwardLeftUp ? -1.0 : 1.0;
  return {vector[0], sign * vector[1], sign * vector[2]};
}
[[nodiscard]] inline core::PerAxis<double> from_forward_right_down(const Vector3& vector,
                                                                   BodyFrame frame) noexcept {
  const double sign = frame == BodyFrame::kForwardLeftUp ? -1.0 : 1.0;
  return {vector.x(), sign * vector.y(), sign * vector.z()};
}

// skew(a) b = a x b.
[[nodiscard]] inline Matrix3 skew(const Vector3& a) noexcept {
  Matrix3 m;
  m << 0.0, -a.z(), a.y(), a.z(), 0.0, -a.x(), -a.y(), a.x(), 0.0;
  return m;
}

// The quaternion of a rotation vector (rad); by series below 1e-4 rad, where the closed form loses
// digits (Groves 2nd ed., eq. 5.69 to 5.73).
[[nodiscard]] Quaternion quaternion_of(const Vector3& rotation) noexcept;
// Its inverse, |rotation| <= pi.
[[nodiscard]] Vector3 rotation_vector(const Quaternion& quaternion) noexcept;

// Roll, pitch and heading as in earth_rate.h (Groves eq. 2.22 and 2.23). At a pitch of +-90 degrees
// roll is 0 and heading takes all of the rotation.
[[nodiscard]] Quaternion n_from_b(const Attitude& attitude) noexcept;
[[nodiscard]] Attitude attitude_of(const Quaternion& n_from_b) noexcept;

// The angle's equivalent within -pi to pi.
[[nodiscard]] double wrapped(double angle_rad) noexcept;

// Earth rate in n, rad/s.
[[nodiscard]] Vector3 earth_rate_radps_n(double latitude_rad) noexcept;

}  // namespace zerodrift::navigation
