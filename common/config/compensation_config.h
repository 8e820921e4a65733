// SPDX-License-Identifier: Apache-2.0
// The configuration file of compensation (keys: common/compensation/option_keys.h).
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

#include "common/compensation/options.h"
#include "common/config/config_error.h"
#include "common/twin/model.h"

namespace zerodrift::config {

// Reads and validates; keys that are absent keep the defaults of CompensationOptions. Throws
// ConfigError with one line that names file, line and key.
[[nodiscard]] compensation::CompensationOptions load_compensation(
    const std::filesystem::path& path);

// A twin's model that can be a prior (compensation/drift_prior.h). Throws ConfigError with one line
// that names the file: what load_model() refuses, a model without a usable effect, something else
// than a regular file of at most kLargestModelFile bytes.
inline constexpr std::size_t kLargestModelFile = 1U << 20U;
[[nodiscard]] twin::Model load_prior(const std::filesystem::path& path);
// The same of a text that was read; `name` stands for the file's name in errors.
[[nodiscard]] twin::Model prior_from_text(const std::string& text, const std::string& name);

}  // namespace zerodrift::config
