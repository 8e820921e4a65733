// SPDX-License-Identifier: Apache-2.0
// Input: a twin's profile file.
#include "common/config/twin_config.h"
#include "tests/fuzz/expectations.h"
#include "tests/fuzz/scratch_file.h"

namespace zerodrift::fuzz {

void twin_profile(Bytes input) {
  static ScratchFile file("profile.yaml");
  file.fill(as_text(input));
  try {
    const twin::Profile profile = config::load_profile(file.path());
    demand(profile.duration_s > 0.0, "a profile that was taken has a duration");
  } catch (const config::ConfigError& error) {
    demand_one_line(error.what());
  }
}

}  // namespace zerodrift::fuzz
