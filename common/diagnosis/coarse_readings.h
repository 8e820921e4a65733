// SPDX-License-Identifier: Apache-2.0
// Readings of a thermometer whose steps are large beside what the temperature does meanwhile.
#pragma once

#include <cstddef>
#include <vector>

namespace zerodrift::diagnosis {

struct WithoutSteps {
  std::vector<double> degc{};
  // What the steps leave of errors in it, as of independent readings: a twelfth of a step's square
  // over the number of readings that are the same, as these share one error; more where noise makes
  // a passage uncertain. degC²
  std::vector<double> variance_degc2{};
};

// While a coarse reading stays the same, the temperature does not; what is known is when it passed
// from one step to the next, midway between the two, and that it keeps within its step. Readings
// that stay the same over more than `longest_stay` places become the smoothest course (natural
// cubic spline) that does both; where it turns round it goes no farther than to the reading, as
// more isn't known of it. A passage lasts that long at most, or goes back and forth between the two
// readings, by noise: it is where as many readings are early as late. A return to the same reading
// is none. Elsewhere readings are as they were, with `variance_degc2` for their noise. NaN: no
// reading. O(readings log readings).
[[nodiscard]] WithoutSteps without_steps(const std::vector<double>& readings,
                                         std::size_t longest_stay, double variance_degc2 = 0.0);

}  // namespace zerodrift::diagnosis
