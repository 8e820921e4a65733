// SPDX-License-Identifier: Apache-2.0
#include "common/navigation/arguments.h"

#include <stdexcept>

#include "common/core/units.h"

namespace zerodrift::navigation {
namespace {

[[noreturn]] void refuse(const std::string& option, const std::string& found,
                         const std::string& expected) {
  throw std::invalid_argument(option + ": found " + found + ", expected " + expected);
}

void require_within(const char* option, double value, double low, double high) {
  if (value >= low && value <= high) return;
  refuse(option, std::to_string(value), std::to_string(low) + " to " + std::to_string(high));
}

}  // namespace

GyroNavigationOptions NavigationArguments::complete() const {
  require_within("--latitude", latitude_deg.value_or(0.0), -90.0, 90.0);
  require_within("--heading", heading_deg.value_or(0.0), -360.0, 360.0);
  require_within("--roll", roll_deg, -180.0, 180.0);
  require_within("--pitch", pitch_deg, -90.0, 90.0);
  require_within("--heading-sigma", heading_sigma_deg, 0.0, 180.0);
  require_within("--tilt-sigma", tilt_sigma_deg, 0.0, 90.0);
  require_within("--alignment", alignment_s, 0.0, 86400.0);
  if (frame != "flu" && frame != "frd") refuse("--frame", "'" + frame + "'", "flu or frd");
  if (updates != "rest" && updates != "none")
    refuse("--updates", "'" + updates + "'", "rest or none");
  if (!heading_deg && !latitude_deg) {
    throw std::invalid_argument(
        "--heading: missing; without it --latitude is needed, to find north by Earth's rate");
  }
  GyroNavigationOptions options;
  using core::kRadPerDeg;
  if (latitude_deg) options.filter.latitude_rad = *latitude_deg * kRadPerDeg;
  options.heading_known = heading_deg.has_value();
  options.attitude = {.roll_rad = roll_deg * kRadPerDeg,
                      .pitch_rad = pitch_deg * kRadPerDeg,
                      .heading_rad = heading_deg.value_or(0.0) * kRadPerDeg};
  options.filter.heading_sigma_rad = heading_sigma_deg * kRadPerDeg;
  options.filter.tilt_sigma_rad = tilt_sigma_deg * kRadPerDeg;
  options.alignment_s = alignment_s;
  options.frame = frame == "frd" ? BodyFrame::kForwardRightDown : BodyFrame::kForwardLeftUp;
  options.updates = updates == "none" ? Updates::kNone : Updates::kAtRest;
  options.residual_feedback = residual_feedback;
  return options;
}

}  // namespace zerodrift::navigation
