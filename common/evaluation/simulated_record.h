// SPDX-License-Identifier: Apache-2.0
// The twin's record of a profile, as a file. What the gyro doesn't say (while it is off, dropped
// samples) are blank cells of rows that are there.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/record/record_writer.h"
#include "common/twin/model.h"
#include "common/twin/profile.h"

namespace zerodrift::evaluation {

struct SimulatedRecord {
  std::string model_name;  // as the record's metadata have them
  std::string profile_name;
  twin::Model model;
  twin::Profile profile;
  double rate_hz = 0.0;  // of samples
  std::uint64_t seed = 1;
  bool has_reference = false;         // with the true rate as columns
  std::vector<std::string> warnings;  // of the model's file
};

// At the model's nominal rate. Throws config::ConfigError with one line.
[[nodiscard]] SimulatedRecord load_simulation(const std::string& model_file,
                                              const std::string& profile_file);

// Number of rows. Throws files::FileError, std::invalid_argument with one line.
std::uint64_t write_simulation(const SimulatedRecord& simulated, const std::string& out,
                               const record::WriteShare& progress);

}  // namespace zerodrift::evaluation
