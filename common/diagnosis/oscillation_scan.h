// SPDX-License-Identifier: Apache-2.0
// Where a series oscillates along something: time (a line), a temperature (fringes) or the angle
// turned through (resets of a modulator). A fine scan for the handful of frequencies that are worth
// an exact evaluation; a coarse grid would step over the peaks.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace zerodrift::diagnosis {

struct OscillationPeaks {
  std::vector<double> frequencies{};  // cycles per unit of the phase variable, strongest first
  std::vector<double> ratios{};       // of each one's power to the median around it
  double looked_at = 1.0;             // independent frequencies
};

// Peaks of |sum w exp(2 pi i f u)|² over its running median, in steps of half of 1/range(u) or
// finer, from `lowest_cycles` cycles over the range of u to `highest_frequency`, or as far as
// `most_bins` bins of a quarter of a cycle reach. `weighted`: the residual divided by its noise
// covariance, so that coloured noise leaves a flat background. O(samples + bins log bins).
struct OscillationScan {
  double lowest_cycles = 1.0;
  double highest_frequency = 0.5;
  std::size_t most_bins = std::size_t{1} << 21;
  std::size_t peaks = 6;
};
[[nodiscard]] OscillationPeaks oscillation_peaks(std::span<const double> weighted,
                                                 std::span<const double> phase_variable,
                                                 const OscillationScan& scan);

// The same along an angle that the series is a mean over: `turn` of it in each interval, `middle`
// of the interval. Octave by octave, since at a period R only those intervals tell in which the
// phase moves, |turn| > R/300 (else a slow drift looks the same), but doesn't average out, |turn| <
// 0.8 R; they count as sin(pi turn/R) / (pi turn/R). Twice the cost of one scan.
[[nodiscard]] OscillationPeaks angle_peaks(std::span<const double> weighted,
                                           std::span<const double> middle,
                                           std::span<const double> turn, std::size_t peaks);

// The same along time on a uniform grid, by a Fourier transform; up to the Nyquist frequency.
[[nodiscard]] OscillationPeaks line_peaks(std::span<const double> weighted, double interval_s,
                                          std::size_t peaks);

// Two levels that alternate: the upper one while frac(frequency_hz t + phase_turns) < duty.
struct Cycle {
  double frequency_hz = 0.0;
  double duty = 0.5;  // at most a half: of the shorter level
  double phase_turns = 0.0;

  bool operator==(const Cycle&) const = default;
};

// Those that the series follows best at, and half a resolution cell around, each of these
// frequencies: the series folded into 96 parts of a period, every beginning and every duty from
// four parts on; by power over the variance of the levels, and by power alone. `time_s`: middle of
// each interval. None for a period of fewer than 16 intervals. O(frequencies * samples * 33).
[[nodiscard]] std::vector<Cycle> cycles_at(std::span<const double> frequencies_hz,
                                           std::span<const double> weighted,
                                           std::span<const double> time_s);

}  // namespace zerodrift::diagnosis
