// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <limits>

#include "common/core/plausible.h"
#include "common/navigation/gyro_navigation.h"

namespace zerodrift::navigation {

double StreamErrors::heading_rms() const noexcept {
  return samples > 0 ? std::sqrt(heading_square_sum / static_cast<double>(samples))
                     : std::numeric_limits<double>::quiet_NaN();
}

double StreamErrors::nees_mean() const noexcept {
  return samples > 0 ? nees_sum / static_cast<double>(samples)
                     : std::numeric_limits<double>::quiet_NaN();
}

std::optional<std::string> GyroNavigationOptions::validate() const {
  const auto wrong = [](const char* key, double found, const char* expected) {
    return std::string(key) + " is " + std::to_string(found) + ", must be " + expected;
  };
  if (const auto problem = filter.validate()) return problem;
  if (const auto problem = rest.validate()) return problem;
  for (const double angle : {attitude.roll_rad, attitude.pitch_rad, attitude.heading_rad}) {
    if (!std::isfinite(angle)) return "attitude is not finite, must be three angles in rad";
  }
  if (!(alignment_s >= 0.0 && alignment_s <= 86400.0))
    return wrong("alignment_s", alignment_s, "0 to 86400");
  if (!(longest_bridged_s >= 0.0 && longest_bridged_s <= 10.0))
    return wrong("longest_bridged_s", longest_bridged_s, "0 to 10");
  if (!(fastest_turn_radps >= 0.0 && fastest_turn_radps <= core::kLargestRateRadps))
    return wrong("fastest_turn_radps", fastest_turn_radps, "0 to 1000");
  if (!(reference_period_s >= 0.001 && reference_period_s <= 60.0))
    return wrong("reference_period_s", reference_period_s, "0.001 to 60");
  if (!(largest_reference_sigma_radps >= 0.0))
    return wrong("largest_reference_sigma_radps", largest_reference_sigma_radps, "0 or more");
  if (!heading_known && !filter.latitude_rad)
    return "latitude_rad is missing, must be given where the heading is to be found";
  return std::nullopt;
}

}  // namespace zerodrift::navigation
