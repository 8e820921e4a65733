// SPDX-License-Identifier: Apache-2.0
#include "common/record/record_rows.h"

#include <algorithm>
#include <stdexcept>
#include <string>

#include "common/files/input_file.h"
#include "common/mcap/mcap_reader.h"
#include "common/record/bag_files.h"

namespace zerodrift::record {

namespace {

std::optional<double> most_messages(const std::filesystem::path& record) try {
  double messages = 0.0;
  for (const auto& file : mcap_files_of(record)) {
    const mcap::Reader reader(file);
    std::uint64_t most = 0;
    for (const auto& [channel, count] : reader.contents().statistics.messages_by_channel)
      most = std::max(most, count);
    messages += static_cast<double>(most);
  }
  return messages > 0.0 ? std::optional(messages) : std::nullopt;
} catch (const std::runtime_error&) {  // whoever reads the record says why
  return std::nullopt;
}

}  // namespace

std::optional<double> estimated_rows(const std::filesystem::path& record) {
  if (is_mcap_record(record)) return most_messages(record);
  std::error_code error;
  const auto size = std::filesystem::file_size(record, error);
  if (error || record.extension() != ".csv") return std::nullopt;
  const std::string begin = files::beginning_of(record, std::size_t{1} << 16U);
  const auto lines = std::count(begin.begin(), begin.end(), '\n');
  if (lines == 0) return std::nullopt;
  return static_cast<double>(size) * static_cast<double>(lines) / static_cast<double>(begin.size());
}

}  // namespace zerodrift::record
