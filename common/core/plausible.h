// SPDX-License-Identifier: Apache-2.0
// Figures that tell a measurement from a corrupt number or another unit.
#pragma once

namespace zerodrift::core {

// Beyond these a number is no measurement, whatever the sensor.
inline constexpr double kLargestRateRadps = 1e3;  // 57 000 deg/s
inline constexpr double kLargestTemperatureDegc = 1e6;

// Electronics of a gyro are dead above the one (the military range), and no store is colder than
// the other (MIL-STD-810, severe cold).
inline constexpr double kColdestStoreDegc = -62.0;
inline constexpr double kHottestElectronicsDegc = 125.0;

}  // namespace zerodrift::core
