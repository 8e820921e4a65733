// SPDX-License-Identifier: Apache-2.0
// Readings of a thermometer whose steps are large beside what the temperature does meanwhile.
#pragma once

#include <cstddef>
#include <vector>

namespace zerodrift::diagnosis {

// While a coarse reading stays the same, the temperature does not; what is known exactly is when it
// passed from one step to the next, midway between the two. Readings that stay the same over more
// than `longest_stay` places become straight lines: through the midpoint at each change from one
// such stay to the next, and through the reading itself in the middle of each, so that a stay that
// is left the way it was entered keeps its level. A change lasts that long at most, or goes back
// and forth between the two readings, by noise, for a shorter time than either stay. Elsewhere
// readings are as they were: where noise carries them over the steps, their mean is better than any
// of this. NaN: no reading. O(readings).
[[nodiscard]] std::vector<double> without_steps(std::vector<double> readings,
                                                std::size_t longest_stay);

}  // namespace zerodrift::diagnosis
