// SPDX-License-Identifier: Apache-2.0
// The options that decide what a learner's numbers mean: a learner saved with other ones can't be
// continued. Timing, gates and fallbacks around the learner may change from run to run.
#pragma once

#include <string>
#include <vector>

#include "common/compensation/options.h"

namespace zerodrift::checkpoint {

struct DecidingOption {
  std::string key;    // as in the configuration file where it can be given there
  std::string value;  // numbers exactly, in the fewest digits
};

[[nodiscard]] std::vector<DecidingOption> deciding_options(
    const compensation::CompensationOptions& options);

// The other ones: those that decide what the data path does. With both alike, equal inputs give
// equal samples.
[[nodiscard]] std::vector<DecidingOption> path_options(
    const compensation::CompensationOptions& options);

}  // namespace zerodrift::checkpoint
