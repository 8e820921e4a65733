// SPDX-License-Identifier: Apache-2.0
// The monitor's events as one clear line each: which gyro, axis and stream, at which tau, figures
// in deg/h.
#pragma once

#include <cstdint>
#include <string>

#include "common/allan/noise_watch.h"
#include "common/core/axis.h"

namespace zerodrift::services {

enum class Stream : std::uint32_t { kRaw = 0, kCompensated = 1 };  // as in allan_report

constexpr const char* name(Stream stream) {
  return stream == Stream::kRaw ? "raw" : "compensated";
}

// "gyro 3 axis x raw: "
[[nodiscard]] std::string subject(std::uint32_t gyro_id, core::Axis axis, Stream stream);

[[nodiscard]] std::string noise_grew(const allan::Finding& finding, double window_s);
[[nodiscard]] std::string noise_is_back(const allan::Finding& finding, double window_s);
[[nodiscard]] std::string worse_than_raw(const allan::Finding& finding, double window_s);
[[nodiscard]] std::string no_longer_worse(const allan::Finding& finding, double window_s);

}  // namespace zerodrift::services
