// SPDX-License-Identifier: Apache-2.0
// What a GyroNavigation tells the compensation in return, and people.
#include <algorithm>
#include <cmath>

#include "common/core/units.h"
#include "common/navigation/gyro_navigation.h"

namespace zerodrift::navigation {

std::string text(const HeadingDoubt& doubt) {
  const auto whole_deg = [](double rad) {
    return std::to_string(std::lround(rad / core::kRadPerDeg));
  };
  return "the Earth's rate says " + whole_deg(doubt.found_rad) + " deg, given is " +
         whole_deg(doubt.given_rad) +
         ": its horizontal part is not given back until the filter starts with the heading of now, "
         "or with none; if the drift is what is wrong, reset the compensation";
}

std::optional<core::RateReferenceSample> GyroNavigation::take_reference() noexcept {
  if (references_.empty()) return std::nullopt;
  const core::RateReferenceSample reference = references_.front();
  references_.pop();
  return reference;
}

void GyroNavigation::prepare_references(const NavigationSample& sample) noexcept {
  if (stop_.residual_due && options_.residual_feedback) prepare_residual(sample);
  stop_.residual_due = false;
  if (reference_due_ != core::kNever && sample.time < reference_due_) return;
  const core::SensorTime period = core::from_seconds(options_.reference_period_s);
  reference_due_ = (sample.time / period + 1) * period;
  references_.push_overwriting(rest_reference(sample));
}

core::RateReferenceSample GyroNavigation::rest_reference(const NavigationSample& sample) noexcept {
  core::RateReferenceSample reference;
  reference.time = sample.time;
  reference.kind = core::ReferenceKind::kRest;
  if (!at_rest() || !stop_.stands || !options_.filter.latitude_rad) return reference;
  const AttitudeFilter& own = filter(Stream::kCompensated);
  // What was learned of north through rates that were compensated with references from here is not
  // given back as knowledge.
  Matrix3 covariance = own.covariance().topLeftCorner<3, 3>();
  const double tilt = options_.filter.tilt_sigma_rad;
  const Vector3 at_start(tilt, tilt, start_heading_sigma_rad_);
  for (Eigen::Index i = 0; i < 3; ++i)
    covariance(i, i) = std::max(covariance(i, i), at_start[i] * at_start[i]);
  const Vector3 variance = own.earth_rate_variance_b(covariance);
  reference.rate_radps = from_forward_right_down(own.earth_rate_b(), options_.frame);
  const double largest = options_.largest_reference_sigma_radps;
  bool any = false;
  for (std::size_t i = 0; i < 3; ++i) {
    reference.variance[i] = variance[static_cast<Eigen::Index>(i)];
    reference.valid[i] =
        measured_at_[i] == sample.time && reference.variance[i] <= largest * largest;
    any = any || reference.valid[i];
  }
  if (any) ++counts_.references;
  return reference;
}

void GyroNavigation::prepare_residual(const NavigationSample& sample) noexcept {
  const AttitudeFilter& own = filter(Stream::kCompensated);
  core::RateReferenceSample residual;
  residual.time = sample.time;
  residual.kind = core::ReferenceKind::kNavigationResidual;
  residual.model_epoch = sample.model_epoch;
  const auto left = from_forward_right_down(own.drift_radps(), options_.frame);
  for (std::size_t i = 0; i < 3; ++i) {
    residual.rate_radps[i] = sample.applied_drift_radps[i] + left[i];
    const auto d = static_cast<Eigen::Index>(3 + i);
    residual.variance[i] = own.covariance()(d, d);
    residual.valid[i] = measured_at_[i] == sample.time;
  }
  references_.push_overwriting(residual);
  ++counts_.residuals;
}

}  // namespace zerodrift::navigation
