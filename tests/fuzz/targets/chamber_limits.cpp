// SPDX-License-Identifier: Apache-2.0
// Input: the file of what a laboratory can do.
#include "common/config/chamber_limits_config.h"
#include "common/diagnosis/experiment_plan.h"
#include "tests/fuzz/expectations.h"
#include "tests/fuzz/scratch_file.h"

namespace zerodrift::fuzz {

void chamber_limits(Bytes input) {
  static ScratchFile file("limits.yaml");
  file.fill(as_text(input));
  try {
    const twin::ChamberLimits limits = config::load_chamber_limits(file.path());
    for (const auto& plan : diagnosis::experiment_menu(limits)) {
      const twin::Profile profile = diagnosis::profile_of(plan, limits);
      demand(!profile.find_problem(), "an experiment of the menu is a profile");
      demand(!twin::find_excess(profile, limits), "an experiment of the menu fits the limits");
    }
  } catch (const config::ConfigError& error) {
    demand_one_line(error.what());
  }
}

}  // namespace zerodrift::fuzz
