// SPDX-License-Identifier: Apache-2.0
// Results for programs: JSON in a file that appears whole or not at all.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

namespace zerodrift::report {

// Keys in the order they were added, two blanks of indentation. Doubles read back to the same bits;
// NaN and infinities, which JSON doesn't have, become null; broken UTF-8 becomes U+FFFD. Throws
// files::FileError where the file can't be written.
void write_json(const std::filesystem::path& path, const nlohmann::ordered_json& value);

}  // namespace zerodrift::report
