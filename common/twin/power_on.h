// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace zerodrift::twin {

// Whether a gyro was off before a sample, by the time since power-on (0: off) of the sample before
// it (0 at the first) and of its own: what starts with the power starts anew with this sample.
[[nodiscard]] constexpr bool was_off(double before_s, double now_s) noexcept {
  return before_s == 0.0 || now_s < before_s;
}

}  // namespace zerodrift::twin
