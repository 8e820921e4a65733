// SPDX-License-Identifier: Apache-2.0
// When the k-th sample of a regular stream happens, without accumulating rounding.
#pragma once

#include <cmath>
#include <cstdint>

#include "common/core/time.h"

namespace zerodrift::twin {

// round(k 10⁹ / rate) nanoseconds.
inline core::SensorTime sample_time(std::uint64_t k, double rate_hz) noexcept {
  const long double time_ns =
      static_cast<long double>(k) * 1e9L / static_cast<long double>(rate_hz);
  return core::SensorTime{std::llround(time_ns)};
}

}  // namespace zerodrift::twin
