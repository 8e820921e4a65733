// SPDX-License-Identifier: Apache-2.0
// Beyond these no sensor of what a gyro is exposed to measures: such a reading is corrupt, or of
// another quantity.
#pragma once

#include <cstddef>

#include "common/core/axis.h"
#include "common/core/units.h"

namespace zerodrift::core {

struct MeasurableRange {
  double lowest;
  double highest;
  const char* unit;
  const char* text;  // in a unit that is easily read

  [[nodiscard]] constexpr bool holds(double value) const noexcept {
    return value >= lowest && value <= highest;
  }
};

inline constexpr MeasurableRange kMeasurableMagneticUt{-1e5, 1e5, "µT", "-100 to 100 mT"};
inline constexpr MeasurableRange kMeasurableAccelerationMps2{
    -1e3 * kStandardGravityMps2, 1e3 * kStandardGravityMps2, "m/s²", "-1000 to 1000 g"};
inline constexpr MeasurableRange kMeasurableVibrationG{0.0, 1e3, "g", "0 to 1000 g"};
inline constexpr MeasurableRange kMeasurableSourceCurrentMa{0.0, 1e5, "mA", "0 to 100 A"};
inline constexpr MeasurableRange kMeasurableSupplyV{-1e3, 1e3, "V", "-1000 to 1000 V"};

// Of a channel of core::Environment, by its number.
[[nodiscard]] constexpr const MeasurableRange& measurable_environment(std::size_t channel) {
  if (channel < kAxisCount) return kMeasurableMagneticUt;
  if (channel < 2 * kAxisCount) return kMeasurableAccelerationMps2;
  if (channel == 2 * kAxisCount) return kMeasurableVibrationG;
  return channel == 2 * kAxisCount + 1 ? kMeasurableSourceCurrentMa : kMeasurableSupplyV;
}

}  // namespace zerodrift::core
