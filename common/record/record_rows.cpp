// SPDX-License-Identifier: Apache-2.0
#include "common/record/record_rows.h"

#include <algorithm>
#include <string>

#include "common/files/input_file.h"

namespace zerodrift::record {

std::optional<double> estimated_rows(const std::filesystem::path& record) {
  std::error_code error;
  const auto size = std::filesystem::file_size(record, error);
  if (error || record.extension() != ".csv") return std::nullopt;
  const std::string begin = files::beginning_of(record, std::size_t{1} << 16U);
  const auto lines = std::count(begin.begin(), begin.end(), '\n');
  if (lines == 0) return std::nullopt;
  return static_cast<double>(size) * static_cast<double>(lines) / static_cast<double>(begin.size());
}

}  // namespace zerodrift::record
