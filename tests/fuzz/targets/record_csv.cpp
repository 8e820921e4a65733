// SPDX-License-Identifier: Apache-2.0
// Input: one byte, the column map up to a line end, then the file. The byte says how the file is
// read: p plain, g as .csv.gz, x as .csv.xz, z as .csv.zst; a capital one takes rows in any order
// of time.
#include <string_view>
#include <vector>

#include "common/files/file_error.h"
#include "common/record/column_map.h"
#include "common/record/record_reader.h"
#include "common/record/record_samples.h"
#include "tests/fuzz/expectations.h"
#include "tests/fuzz/scratch_file.h"

namespace zerodrift::fuzz {
namespace {

using record::RecordReader;

ScratchFile& file_for(char way) {
  static ScratchFile plain("input.csv");
  static ScratchFile gzip("input.csv.gz");
  static ScratchFile xz("input.csv.xz");
  static ScratchFile zstd("input.csv.zst");
  if (way == 'g' || way == 'G') return gzip;
  if (way == 'z' || way == 'Z') return zstd;
  return way == 'x' || way == 'X' ? xz : plain;
}

void check_row(const record::RecordRow& row, const record::RecordInfo& info) {
  demand(row.temperature_degc.size() == info.probes.size(), "a row has a value for each probe");
  demand(row.extra.size() == info.extra_columns.size(), "a row has a text for each extra column");
  demand(row.interval_s >= 0.0, "an interval is not negative");
  static_cast<void>(record::to_angular_rate(row));
  static_cast<void>(record::to_rate_reference(row, info));
  static_cast<void>(record::to_environment(row, info));
  core::TemperatureSample sample;
  for (std::size_t probe = 0; probe < info.probes.size(); ++probe)
    record::to_temperature(row, info, probe, sample);
}

void read_all(RecordReader& reader, record::TimeOrder order) {
  std::uint64_t rows = 0;
  std::optional<core::SensorTime> before;
  while (const record::RecordRow* row = reader.next()) {
    demand(row->index == rows++, "rows count up from 0");
    demand(order == record::TimeOrder::kAsFound || !before || *before < row->time,
           "time strictly increases");
    before = row->time;
    check_row(*row, reader.info());
  }
  demand(rows > 0 || !reader.warnings().empty(), "no row is left out without a word");
}

}  // namespace

void record_csv(Bytes input) {
  if (input.empty()) return;
  const char way = static_cast<char>(input.front());
  std::string_view text = as_text(input.subspan(1));
  const std::string_view map = take_line(text);
  ScratchFile& file = file_for(way);
  file.fill(text);
  const bool as_found = way >= 'A' && way <= 'Z';
  const auto order =
      as_found ? record::TimeOrder::kAsFound : record::TimeOrder::kStrictlyIncreasing;
  try {
    RecordReader reader(file.path(),
                        {.columns = record::parse_column_map(map), .time_order = order});
    read_all(reader, order);
    for (const auto& warning : reader.warnings()) demand_one_line(warning);
  } catch (const files::FileError& error) {
    demand_one_line(error.what());
  }
}

}  // namespace zerodrift::fuzz
