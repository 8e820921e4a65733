// SPDX-License-Identifier: Apache-2.0
// How the gyro sits in the vehicle: rate in the vehicle's frame b = matrix * rate as the gyro gives
// it. Applied once, where a raw rate enters the compensation, so that references, Earth rate, what
// is learned and what is given out are all in b; the topic of raw rates stays as the gyro speaks.
//
// O(1) a sample; noexcept.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "common/core/samples.h"

namespace zerodrift::compensation {

// One of the three, or none: the gyro's axes are the vehicle's.
struct MountingOptions {
  std::vector<std::string> axes{};       // which axis of the gyro each of b's is: "-y", "x", "z"
  std::vector<double> matrix{};          // row by row, orthogonal to kOrthogonalTo
  std::vector<double> general_matrix{};  // row by row, its axes not quite square; to kGeneralTo
};
inline constexpr double kOrthogonalTo = 1e-3;  // of each element of M Mᵀ - 1
inline constexpr double kGeneralTo = 0.1;      // 3 degrees, or 5 % of scale

class Mounting {
 public:
  // Nothing when usable, else one line that begins with the wrong key.
  [[nodiscard]] static std::optional<std::string> find_wrong(const MountingOptions& options);

  // Of usable options.
  explicit Mounting(const MountingOptions& options);

  // The identity gives back every bit. NaN where an axis that it needs is NaN.
  [[nodiscard]] core::PerAxis<double> rate_radps_b(
      const core::PerAxis<double>& gyro_radps) const noexcept;
  // An axis of b is valid where all it is made of are, and clipped where one of them is.
  [[nodiscard]] core::AngularRateSample in_b(const core::AngularRateSample& sample) const noexcept;

 private:
  std::array<core::PerAxis<double>, core::kAxisCount> rows_{};
  bool identity_ = true;
};

}  // namespace zerodrift::compensation
