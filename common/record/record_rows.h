// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>

namespace zerodrift::record {

// Rows of a plain .csv, from its size and the lines of its first 64 kB, for a progress bar; nothing
// of a compressed file or of one that cannot be read.
[[nodiscard]] std::optional<double> estimated_rows(const std::filesystem::path& record);

}  // namespace zerodrift::record
