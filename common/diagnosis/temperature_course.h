// SPDX-License-Identifier: Apache-2.0
// The course of a temperature from its readings: how warm, how fast it changes and how that does.
#pragma once

#include <cstddef>
#include <vector>

namespace zerodrift::diagnosis {

// Straight lines over the holes (NaN), ends held. Empty where nothing was measured.
[[nodiscard]] std::vector<double> bridged(std::vector<double> values);

// At each place of the readings' grid; empty where nothing was measured. Holes are bridged by
// straight lines, ends held.
struct TemperatureCourse {
  std::vector<double> degc{};
  std::vector<double> degc_per_s{};
};

// Local polynomials by least squares (Savitzky & Golay 1964) around each instant: no lag, since who
// has a record may look ahead. A quadratic over +- `half_window_s`; where its slope differs from
// that of a quartic over 1/sqrt(2) of the window by more than the errors of both, the quartic: a
// quadratic smears the edge of a quick ramp, and the quartic is the noisier by a factor of four
// where nothing is quick. Where the readings' own errors are most of what the quadratic's slope
// differs by from that of one twice as wide, the wider one, up to four times `half_window_s`: the
// error of a slope, which the noise of no gyro has, falls with the window's length to the power
// 1.5. A first-order lag of `lag_s` is taken off, T = y + lag y', T' = y' + lag y"; the errors are
// those of T', so that a longer lag widens windows. `readings_degc`: one an interval, NaN where
// there is none. O(readings window). Coarse readings lose their steps first (coarse_readings.h): a
// slope needs at least four readings on each side that differ. What the steps leave of errors asks
// for a wider window as noise does.
inline constexpr std::size_t kReadingsEachSide = 4;
[[nodiscard]] TemperatureCourse temperature_course(const std::vector<double>& readings_degc,
                                                   double interval_s, double half_window_s,
                                                   double lag_s = 0.0);

}  // namespace zerodrift::diagnosis
