// SPDX-License-Identifier: Apache-2.0
// Input: the configuration file of compensation.
#include "common/config/compensation_config.h"

#include <stdexcept>

#include "common/compensation/compensator.h"
#include "tests/fuzz/expectations.h"
#include "tests/fuzz/scratch_file.h"

namespace zerodrift::fuzz {
namespace {

// A compensator of a larger capacity takes too long to make for a fuzzer.
constexpr std::size_t kSmallCapacity = 64;

}  // namespace

void compensation_config(Bytes input) {
  static ScratchFile file("compensation.yaml");
  file.fill(as_text(input));
  compensation::CompensationOptions options;
  try {
    options = config::load_compensation(file.path());
  } catch (const config::ConfigError& error) {
    demand_one_line(error.what());
    return;
  }
  if (options.model.capacity > kSmallCapacity) return;
  try {
    const compensation::Compensator compensator(options);
  } catch (const std::invalid_argument& error) {
    throw Broken(std::string("a configuration that was taken works, found ") + error.what());
  }
}

}  // namespace zerodrift::fuzz
