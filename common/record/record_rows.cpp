// SPDX-License-Identifier: Apache-2.0
#include "common/record/record_rows.h"

#include <algorithm>
#include <fstream>
#include <string>

namespace zerodrift::record {

std::optional<double> estimated_rows(const std::filesystem::path& record) {
  std::error_code error;
  const auto size = std::filesystem::file_size(record, error);
  if (error || record.extension() != ".csv") return std::nullopt;
  std::string begin(std::size_t{1} << 16U, '\0');
  std::ifstream file(record, std::ios::binary);
  file.read(begin.data(), static_cast<std::streamsize>(begin.size()));
  begin.resize(static_cast<std::size_t>(file.gcount()));
  const auto lines = std::count(begin.begin(), begin.end(), '\n');
  if (lines == 0) return std::nullopt;
  return static_cast<double>(size) * static_cast<double>(lines) / static_cast<double>(begin.size());
}

}  // namespace zerodrift::record
