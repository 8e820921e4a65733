// SPDX-License-Identifier: Apache-2.0
// The true angular rate of the profile: turns plus, where the profile says so, Earth rate.
#pragma once

#include <Eigen/Core>

#include "common/core/axis.h"
#include "common/core/time.h"
#include "common/twin/profile.h"

namespace zerodrift::twin {

class TrueMotion {
 public:
  TrueMotion(const Profile& profile, double interval_s);

  // Mean rate of the body against inertial space over the interval that ends at `time`, frame b,
  // rad/s. Times are consecutive samples. Turns are exact (difference of the angle turned through);
  // Earth rate turns with the body and is taken at the interval's middle. O(turns).
  [[nodiscard]] core::PerAxis<double> step(core::SensorTime time) noexcept;

 private:
  std::vector<Turn> turns_;
  double interval_s_;
  Eigen::Vector3d earth_rate_radps_;  // frame b, at the end of the last interval
};

}  // namespace zerodrift::twin
