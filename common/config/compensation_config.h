// SPDX-License-Identifier: Apache-2.0
// The configuration file of compensation (idl/proto/compensation.proto).
#pragma once

#include <filesystem>

#include "common/compensation/options.h"
#include "common/config/config_error.h"
#include "idl/proto/compensation.pb.h"

namespace zerodrift::config {

// Reads and validates; keys that are absent keep the defaults of CompensationOptions. Throws
// ConfigError with one line that names file, line and key.
[[nodiscard]] compensation::CompensationOptions load_compensation(
    const std::filesystem::path& path);

}  // namespace zerodrift::config
