// SPDX-License-Identifier: Apache-2.0
// Where an Allan deviation curve falls as white rate noise does, by its slope of -1/2.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "common/allan/allan_point.h"

namespace zerodrift::allan {

// What the shortest taus of a curve say of the gyro.
enum class ShortTaus : std::uint8_t {
  kMixture,      // nothing against a mixture of noises
  kBandLimited,  // they lie below the white slope that comes later: a low-pass or a mean
  kNeverWhite,   // the same, and no later part is white: the bandwidth hides the white noise
};

// Of a curve's points, from `first` on until before `end`, those that are white. Empty where none
// is.
struct WhitePart {
  ShortTaus short_taus = ShortTaus::kMixture;
  std::size_t first = 0;
  std::size_t end = 0;
};

// A sum of power laws is convex in a log-log picture: its slope only grows with tau. Where the
// slope begins above -1/2 and then falls towards it, a low-pass takes noise off the shortest taus,
// and what a fit makes of these is no property of the gyro: their N is too small, and a first-order
// low-pass of white noise is a Markov noise to the last digit. A curve that falls more steeply than
// white noise later on has a sinusoid, and is left to the fit.
//
// Slopes are of points an octave apart, distinguished only where they differ by 0.1 and by four
// standard errors, from ten degrees of freedom on. The white part begins two octaves after the
// first slope within 0.03 (and a standard error) of -1/2, or of the lowest. Of 64 first-order
// low-passes (0.5 and 2 Hz, 1 and 4 h) 61 so stated N, on average 1 % too small, with the truth in
// 55 of the 95 % intervals; an octave earlier it was 2 to 3 % and 37 of 62.
//
// O(points²), no allocation.
[[nodiscard]] WhitePart white_part(std::span<const AllanPoint> points) noexcept;

}  // namespace zerodrift::allan
