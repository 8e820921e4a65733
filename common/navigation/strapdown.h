// SPDX-License-Identifier: Apache-2.0
// Attitude from delta-angles.
#pragma once

#include "common/navigation/rotation.h"

namespace zerodrift::navigation {

// Integrates what a gyro measures into the attitude of its body frame against n.
//
// Each step turns the body by the rotation vector a + 1/12 a' x a, a the delta-angle and a' the one
// before it over an interval of the same length: Savage's recursive coning algorithm (Strapdown
// Inertial Navigation Integration Algorithm Design Part 1, J. Guidance 21 (1998), eq. 47 and 49)
// with one delta-angle a computation interval. What it leaves of a coning motion's drift falls with
// the fourth power of the interval; without the term with the second. n turns by Earth rate and
// transport rate (Groves eq. 5.76). Where intervals differ by more than 1 % or a delta-angle is
// missing there is no a'.
//
// O(1) a step, no allocation. One thread.
class Strapdown {
 public:
  // Zero: n stands still against the stars.
  explicit Strapdown(const Vector3& earth_rate_radps_n) : earth_rate_(earth_rate_radps_n) {}

  void set(const Quaternion& n_from_b) noexcept { n_from_b_ = n_from_b.normalized(); }
  // A small rotation of the estimate about the axes of n: n_from_b becomes exp(rotation) n_from_b.
  void correct(const Vector3& rotation_n) noexcept;

  // `delta_angle_b`: integral of the body's rate against inertial space, rad, forward-right-down,
  // over `interval_s`. `transport_rate_n`: see there; zero where the velocity isn't known.
  void advance(const Vector3& delta_angle_b, double interval_s,
               const Vector3& transport_rate_n = Vector3::Zero()) noexcept;
  // What came last is not next to what comes: no coning term across it.
  void interrupt() noexcept { previous_interval_s_ = 0.0; }

  [[nodiscard]] const Quaternion& n_from_b() const noexcept { return n_from_b_; }

 private:
  Vector3 earth_rate_;
  Quaternion n_from_b_ = Quaternion::Identity();
  Vector3 previous_ = Vector3::Zero();
  double previous_interval_s_ = 0.0;
};

}  // namespace zerodrift::navigation
