// SPDX-License-Identifier: Apache-2.0
// The three axes of the gyro's body frame b (right-handed; forward-left-up unless a deployment says
// otherwise).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace zerodrift::core {

enum class Axis : std::uint8_t { kX = 0, kY = 1, kZ = 2 };

inline constexpr std::size_t kAxisCount = 3;
inline constexpr std::array<Axis, kAxisCount> kAxes{Axis::kX, Axis::kY, Axis::kZ};

constexpr std::size_t index(Axis axis) {
  return static_cast<std::size_t>(axis);
}

constexpr std::string_view name(Axis axis) {
  constexpr std::array<std::string_view, kAxisCount> kNames{"x", "y", "z"};
  return kNames[index(axis)];
}

// One value an axis, in the order x, y, z.
template <typename T>
using PerAxis = std::array<T, kAxisCount>;

}  // namespace zerodrift::core
