// SPDX-License-Identifier: Apache-2.0
// The places whose temperature the thermal plant knows, and their names in model files.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace zerodrift::twin {

enum class TemperaturePoint : std::size_t {
  kChamber = 0,  // air around the gyro
  kCase = 1,
  kCoilOuter = 2,  // outer layers of the fibre coil
  kCoilInner = 3,  // inner layers
  kBoard = 4,      // electronics and light source
  kCoil = 5,       // mean of the coil's outer and inner layers
};

inline constexpr std::size_t kTemperaturePointCount = 6;

// One value a place, in the order of the enumerators.
template <typename T>
using PerPoint = std::array<T, kTemperaturePointCount>;

constexpr std::size_t index(TemperaturePoint point) {
  return static_cast<std::size_t>(point);
}

// "chamber", "case", "coil_outer", "coil_inner", "board", "coil", in the order of the enumerators.
[[nodiscard]] std::span<const std::string> temperature_point_names();
[[nodiscard]] std::string_view name(TemperaturePoint point);
[[nodiscard]] std::optional<TemperaturePoint> temperature_point(std::string_view name);

}  // namespace zerodrift::twin
