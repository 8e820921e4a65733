// SPDX-License-Identifier: Apache-2.0
// North from the Earth's rotation.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "common/navigation/rotation.h"

namespace zerodrift::navigation {

// The mean of a while at rest, drift taken off as far as known; forward-right-down.
struct CompassInput {
  Vector3 rate_radps = Vector3::Zero();
  Vector3 drift_sigma_radps = Vector3::Zero();  // of what is left of it, which no averaging lessens
  std::array<bool, 3> measured{};
  double latitude_rad = 0.0;
  double roll_rad = 0.0;
  double pitch_rad = 0.0;
  double tilt_sigma_rad = 0.0;
};

enum class CompassVerdict : std::uint8_t {
  kFound,
  kAxisMissing,    // both horizontal components are needed: a vertical axis alone knows no north
  kNearPole,       // Earth's rate is nearly vertical
  kDriftTooLarge,  // against the horizontal Earth rate: heading would be worse than 0.3 rad
};

constexpr std::string_view text(CompassVerdict verdict) {
  switch (verdict) {
    case CompassVerdict::kFound: return "heading found";
    case CompassVerdict::kAxisMissing:
      return "an axis is not measured; a vertical axis alone knows no north";
    case CompassVerdict::kNearPole: return "too near a pole: Earth's rate is nearly vertical";
    case CompassVerdict::kDriftTooLarge:
      return "the drift's uncertainty is too large against the horizontal Earth rate";
  }
  return "unknown";
}

struct CompassResult {
  CompassVerdict verdict = CompassVerdict::kAxisMissing;
  double heading_rad = 0.0;
  double sigma_rad = 0.0;
  double excess_radps = 0.0;  // of the horizontal rate over the Earth's
};

// Levelled by roll and pitch, the horizontal rate is W cos L (cos heading, -sin heading), so
// heading = atan2(-w_y, w_x) and its sigma is that of the drift across north over W cos L (Groves
// eq. 5.101 and 5.102): 0.1 deg/h are half a degree at 40 degrees of latitude. A tilt lets the
// vertical rate in: W sin L times it.
[[nodiscard]] CompassResult gyrocompass(const CompassInput& input) noexcept;

}  // namespace zerodrift::navigation
