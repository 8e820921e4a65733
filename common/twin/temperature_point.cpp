// SPDX-License-Identifier: Apache-2.0
#include "common/twin/temperature_point.h"

#include <algorithm>

namespace zerodrift::twin {

std::span<const std::string> temperature_point_names() {
  static const PerPoint<std::string> kNames{"chamber",    "case",  "coil_outer",
                                            "coil_inner", "board", "coil"};
  return kNames;
}

std::string_view name(TemperaturePoint point) {
  return temperature_point_names()[index(point)];
}

std::optional<TemperaturePoint> temperature_point(std::string_view name) {
  const auto names = temperature_point_names();
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end()) return std::nullopt;
  return static_cast<TemperaturePoint>(found - names.begin());
}

}  // namespace zerodrift::twin
