// SPDX-License-Identifier: Apache-2.0
#include "common/twin/true_motion.h"

#include <Eigen/Geometry>
#include <cmath>

#include "common/core/units.h"

namespace zerodrift::twin {
namespace {

using Eigen::AngleAxisd;
using Eigen::Vector3d;

Vector3d initial_earth_rate_radps(const std::optional<EarthRateSetup>& setup) {
  if (!setup) return Vector3d::Zero();
  const Vector3d north_west_up(std::cos(setup->latitude_rad), 0.0, std::sin(setup->latitude_rad));
  const Eigen::Matrix3d nRb = (AngleAxisd(-setup->heading_rad, Vector3d::UnitZ()) *
                               AngleAxisd(-setup->pitch_rad, Vector3d::UnitY()) *
                               AngleAxisd(setup->roll_rad, Vector3d::UnitX()))
                                  .toRotationMatrix();
  return nRb.transpose() * (core::kEarthRateRadps * north_west_up);
}

// A vector fixed in space, seen from a body that turned through `angle` (rotation vector).
Vector3d seen_after(const Vector3d& vector, const Vector3d& angle) {
  const double magnitude = angle.norm();
  if (magnitude == 0.0) return vector;
  return AngleAxisd(-magnitude, angle / magnitude) * vector;
}

}  // namespace

TrueMotion::TrueMotion(const Profile& profile, double interval_s)
    : turns_(profile.turns),
      interval_s_(interval_s),
      earth_rate_radps_(initial_earth_rate_radps(profile.earth_rate)) {}

core::PerAxis<double> TrueMotion::step(core::SensorTime time) noexcept {
  const double end_s = core::seconds(time);
  Vector3d angle = Vector3d::Zero();
  for (const Turn& turn : turns_) {
    if (end_s <= turn.start_s || end_s - interval_s_ >= turn.start_s + turn.duration_s) continue;
    angle[static_cast<Eigen::Index>(turn.axis)] +=
        turned_angle_rad(turn, end_s) - turned_angle_rad(turn, end_s - interval_s_);
  }
  const Vector3d middle = seen_after(earth_rate_radps_, 0.5 * angle);
  earth_rate_radps_ = seen_after(earth_rate_radps_, angle);
  const Vector3d rate = angle / interval_s_ + middle;
  return {rate.x(), rate.y(), rate.z()};
}

}  // namespace zerodrift::twin
