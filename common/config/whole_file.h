// SPDX-License-Identifier: Apache-2.0
// Text files read and written in one piece.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace zerodrift::config {

// Throws ConfigError naming the file and the reason: it can't be read, is no regular file, or is
// larger than any configuration.
[[nodiscard]] std::string read_whole(const std::filesystem::path& path);

// The file appears whole or not at all (files::AtomicFile). Throws ConfigError.
void write_whole(const std::filesystem::path& path, std::string_view text);

}  // namespace zerodrift::config
