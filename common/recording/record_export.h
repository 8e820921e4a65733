// SPDX-License-Identifier: Apache-2.0
// Between recordings (MCAP) and CSV records.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "common/mcap/compression.h"
#include "common/record/record_reader.h"
#include "common/record/record_writer.h"

namespace zerodrift::recording {

struct ExportRequest {
  record::RecordInput from{};
  std::filesystem::path to{};
  mcap::Compression compression = mcap::Compression::kZstd;  // of an MCAP file that is written
};

// What was written, and a line each on what was odd.
struct ExportResult {
  std::uint64_t rows = 0;
  std::vector<std::string> warnings{};
};

// All throw FileError or McapError with one line.
// Rates, references, environment and temperatures by sensor time, a row each.
[[nodiscard]] ExportResult export_record(const ExportRequest& request,
                                         const record::WriteShare& progress);
// compensated_rate as `zerodrift record` and `compensate` write it.
[[nodiscard]] ExportResult export_compensated(const ExportRequest& request,
                                              const record::WriteShare& progress);
// A CSV record as the messages that a replay of it would send, of gyro `gyro_id`, else 1; log time
// is sensor time.
[[nodiscard]] ExportResult import_record(const ExportRequest& request,
                                         const record::WriteShare& progress);
void export_attachment(const std::filesystem::path& from, const std::string& name,
                       const std::filesystem::path& to);

}  // namespace zerodrift::recording
