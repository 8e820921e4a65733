// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace zerodrift::twin {

// What an effect follows, roughly. A mismatch of form of one effect may feign another one of its
// family, not one of another input.
enum class InputFamily : std::uint8_t {
  kNone,
  kTime,
  kTemperature,
  kRate,
  kMagnetic,
  kAcceleration,
  kVibration,
  kSourceCurrent,
  kSupply,
};

}  // namespace zerodrift::twin
