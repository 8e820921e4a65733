// SPDX-License-Identifier: Apache-2.0
// Beyond these figures a number is no measurement, whatever the sensor: it is corrupt.
#pragma once

namespace zerodrift::core {

inline constexpr double kLargestRateRadps = 1e3;  // 57 000 deg/s
inline constexpr double kLargestTemperatureDegc = 1e6;

}  // namespace zerodrift::core
