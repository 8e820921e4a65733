// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace zerodrift::system_test {

// Empty where there is no such file.
[[nodiscard]] std::string content(const std::filesystem::path& file);
void write(const std::filesystem::path& file, std::string_view text);

// "" where the files are equal to the byte and not empty, else the first line that differs, of
// each.
[[nodiscard]] std::string first_difference(const std::filesystem::path& a,
                                           const std::filesystem::path& b);

// A record as it stands in the file: cells as text.
struct Table {
  std::vector<std::string> columns;
  std::vector<std::vector<std::string>> rows;
  // Index of a column; throws std::out_of_range for a name that is not there.
  [[nodiscard]] std::size_t column(std::string_view name) const;
};
[[nodiscard]] Table read_table(const std::filesystem::path& file);

// Shared-memory segments of the middleware that are on this machine now.
[[nodiscard]] std::set<std::string> shared_memory_segments();

}  // namespace zerodrift::system_test
