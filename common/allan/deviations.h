// SPDX-License-Identifier: Apache-2.0
// Batch deviations of a whole record without gaps. (For a record with gaps feed a RollingAllan.)
//
// Definitions of NIST SP 1065 section 5, with the angle theta in the part of the phase x and the
// rate in the part of the fractional frequency y.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "common/allan/allan_point.h"
#include "common/allan/tau_grid.h"

namespace zerodrift::allan {

enum class Statistic : std::uint8_t {
  kAdev,    // Allan, without overlap
  kOadev,   // overlapping Allan: the general-purpose one
  kMdev,    // modified Allan
  kTdev,    // time: mdev * tau / sqrt(3); here an angle, rad
  kHdev,    // Hadamard, without overlap: blind to a rate ramp
  kOhdev,   // overlapping Hadamard
  kTotdev,  // total: the record extended by reflection at both ends; its bias is left in
};

[[nodiscard]] constexpr std::string_view name(Statistic statistic) {
  switch (statistic) {
    case Statistic::kAdev: return "adev";
    case Statistic::kOadev: return "oadev";
    case Statistic::kMdev: return "mdev";
    case Statistic::kTdev: return "tdev";
    case Statistic::kHdev: return "hdev";
    case Statistic::kOhdev: return "ohdev";
    case Statistic::kTotdev: return "totdev";
  }
  return "unknown";
}

// Angles at the sample boundaries, one more than rates: running sum of (rate - mean rate) *
// interval. Taking the mean off changes no deviation and keeps the digits.
[[nodiscard]] std::vector<double> angle_from_rate(std::span<const double> rate_radps,
                                                  double sample_interval_s);

struct DeviationPoint {
  double tau_s = 0.0;
  double deviation = 0.0;   // rad/s; rad for kTdev
  std::uint64_t terms = 0;  // differences summed
};

// One statistic at cluster size m >= 1; nothing where the record is too short. All angles must be
// finite. O(angles).
[[nodiscard]] std::optional<DeviationPoint> deviation(Statistic statistic,
                                                      std::span<const double> angle_rad,
                                                      double sample_interval_s,
                                                      std::size_t cluster_size);

// Overlapping Allan deviation with noise type, degrees of freedom and bounds at the two-sided
// confidence, at every cluster of the grid the record is long enough for. O(angles) a tau.
[[nodiscard]] std::vector<AllanPoint> overlapping_allan(std::span<const double> angle_rad,
                                                        double sample_interval_s, TauGrid grid,
                                                        double confidence = 0.95);

}  // namespace zerodrift::allan
