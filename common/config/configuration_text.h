// SPDX-License-Identifier: Apache-2.0
// The configuration as people read it, made from the one description of its keys
// (compensation/option_keys.h).
#pragma once

#include <string>

#include "common/compensation/options.h"

namespace zerodrift::config {

// All keys with the values in force, as YAML that load_compensation() reads back to the same
// options; a prior stands as a comment. Each key has its range and meaning behind it.
[[nodiscard]] std::string effective_yaml(const compensation::CompensationOptions& options);

// A row of a reference's table, as Markdown, and what stands above the first.
inline constexpr const char* kReferenceHead =
    "| key | default | allowed | meaning |\n|---|---|---|---|\n";
[[nodiscard]] std::string reference_row(const std::string& name, const std::string& value,
                                        std::string allowed, const std::string& text);

// The reference page (docs/configuration.md).
[[nodiscard]] std::string configuration_reference();

}  // namespace zerodrift::config
