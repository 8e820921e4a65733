// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>

namespace zerodrift::record {

// Rows, for a progress bar: of a plain .csv from its size and the lines of its first 64 kB, of an
// MCAP record the messages of the channel that has most. Nothing of a compressed file or of one
// that cannot be read.
[[nodiscard]] std::optional<double> estimated_rows(const std::filesystem::path& record);

}  // namespace zerodrift::record
