// SPDX-License-Identifier: Apache-2.0
// White noise whose level follows what the gyro is exposed to.
#pragma once

#include <optional>
#include <span>

#include "common/diagnosis/finding.h"
#include "common/diagnosis/noise_of_model.h"
#include "common/diagnosis/trial.h"

namespace zerodrift::diagnosis {

struct GrowingNoise {
  NamedEffect effect;  // of the catalogue: white noise that reads a temperature
  double constant_radps =
      0.0;  // standard deviation of the white noise that does not grow, a sample
};

// Second differences of three values each, which drift and slow noise hardly move, have a robust
// variance in twelve ranges of each input (temperatures, their rate, the size of the rate,
// vibration, current, supply, time) with equally many in each. Its logarithm is a straight line in
// the input that explains it, or the same everywhere: log likelihood ratio from the sampling error
// of a median absolute deviation (1.36/n), half a log of the number of degrees of freedom for the
// slope. The variance that grows is then fitted beside a constant one. Found where a temperature
// explains more than any other input and log(kinds / false_alarm). Nothing where readings are so
// coarse that the median difference is 0. O(n log n).
[[nodiscard]] std::optional<GrowingNoise> growing_noise(std::span<const double> remainder,
                                                        const TrialInput& input,
                                                        const SearchOptions& options);

// Named, or given its coefficients where the model lists it without, unless the model has one or
// counts angle. The white noise that does not grow is what is left of the model's.
void take_growing_noise(Trial& trial, std::span<const double> remainder, const TrialInput& input,
                        const SearchOptions& options);

}  // namespace zerodrift::diagnosis
