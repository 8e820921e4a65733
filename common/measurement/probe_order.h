// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <utility>

#include "common/twin/temperature_point.h"

namespace zerodrift::measurement {

// The order of a series' probes: places of the twin first, in its order; the others by name.
[[nodiscard]] inline bool is_probe_before(const std::string& a, const std::string& b) {
  const auto place = [](const std::string& name) {
    const auto point = twin::temperature_point(name);
    return point ? twin::index(*point) : twin::kTemperaturePointCount;
  };
  return std::pair(place(a), a) < std::pair(place(b), b);
}

}  // namespace zerodrift::measurement
