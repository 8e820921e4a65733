// SPDX-License-Identifier: Apache-2.0
#include "common/navigation/strapdown.h"

#include <cmath>

namespace zerodrift::navigation {
namespace {

constexpr double kSameInterval = 0.01;  // relative

}  // namespace

void Strapdown::correct(const Vector3& rotation_n) noexcept {
  n_from_b_ = (quaternion_of(rotation_n) * n_from_b_).normalized();
}

void Strapdown::advance(const Vector3& delta_angle_b, double interval_s,
                        const Vector3& transport_rate_n) noexcept {
  Vector3 turned = delta_angle_b;
  if (std::abs(interval_s - previous_interval_s_) <= kSameInterval * interval_s)
    turned += previous_.cross(delta_angle_b) / 12.0;
  const Vector3 frame_turned = (earth_rate_ + transport_rate_n) * interval_s;
  n_from_b_ = (quaternion_of(-frame_turned) * n_from_b_ * quaternion_of(turned)).normalized();
  previous_ = delta_angle_b;
  previous_interval_s_ = interval_s;
}

}  // namespace zerodrift::navigation
