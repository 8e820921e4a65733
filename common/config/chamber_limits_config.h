// SPDX-License-Identifier: Apache-2.0
// The file that says what a laboratory can do to a gyro (twin/chamber_limits.h).
#pragma once

#include <filesystem>
#include <string>

#include "common/compensation/option_keys.h"
#include "common/config/config_error.h"
#include "common/twin/chamber_limits.h"

namespace zerodrift::config {

// Shows every key to the visitor.
void describe(twin::ChamberLimits& limits, compensation::OptionVisitor& visitor);

// Reads and validates. Throws ConfigError with one line that names file, line and key.
[[nodiscard]] twin::ChamberLimits load_chamber_limits(const std::filesystem::path& path);

// The keys as Markdown, for docs/diagnosis.md.
[[nodiscard]] std::string chamber_limits_reference();

}  // namespace zerodrift::config
