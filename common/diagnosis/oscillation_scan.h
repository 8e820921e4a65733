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
  double looked_at = 1.0;             // independent frequencies
};

// Peaks of |sum w exp(2 pi i f u)|² over its running median, at steps of 1/4 of 1/range(u) from
// `lowest_cycles` cycles over the range of u to `highest_frequency` (at most `most` steps; the
// range of frequencies is cut there). `weighted`: the residual divided by its noise covariance, so
// that coloured noise leaves a flat background. O(steps * samples).
struct OscillationScan {
  double lowest_cycles = 1.0;
  double highest_frequency = 0.5;
  std::size_t most = 4000;
  std::size_t peaks = 6;
};
[[nodiscard]] OscillationPeaks oscillation_peaks(std::span<const double> weighted,
                                                 std::span<const double> phase_variable,
                                                 const OscillationScan& scan);

// The same along time on a uniform grid, by a Fourier transform; up to the Nyquist frequency.
[[nodiscard]] OscillationPeaks line_peaks(std::span<const double> weighted, double interval_s,
                                          std::size_t peaks);

}  // namespace zerodrift::diagnosis
