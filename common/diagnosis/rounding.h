// SPDX-License-Identifier: Apache-2.0
// Rates and references that are given in steps which are large beside what the gyro does. While a
// reading stays the same its error does: over the record that looks like an effect of the rate.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/core/axis.h"
#include "common/diagnosis/measured_series.h"

namespace zerodrift::diagnosis {

struct Rounding {
  // The largest ones that matter; 0: none does.
  double rate_step_radps = 0.0;
  double reference_step_radps = 0.0;
  double rms_radps = 0.0;                    // of the errors that matter and stay in the record
  std::vector<std::uint8_t> of_reference{};  // 1: the reference's rounding matters here
  bool leaves_enough = false;                // of the record, where that is left out

  [[nodiscard]] bool matters() const { return rate_step_radps > 0.0 || reference_step_radps > 0.0; }
  [[nodiscard]] bool leaves_out(std::size_t i) const {
    return leaves_enough && of_reference[i] != 0;
  }
};

// A step of q makes errors of q/sqrt(12) rms. Those of the rate average out where the noise carries
// it over the steps: what is left falls as exp(-2 pi² sigma²/q²), sigma without the rounding
// itself. Those of a reference stay as long as it does. They matter where they are a fifth or more
// of the mean square by which means differ from those around them, over a minute (rate) or over the
// time of a constant reference; where they are more than four times as large, a reference is as
// exact as it is round (a table commanded to turn at 10 deg/s), and says nothing. Where the
// reference's rounding matters it is left out, ramps too, if two thirds of the record are left.
// `residual_radps`: measured minus twin. O(n log n).
[[nodiscard]] Rounding find_rounding(const MeasuredSeries& series, core::Axis axis,
                                     std::span<const double> residual_radps);

}  // namespace zerodrift::diagnosis
