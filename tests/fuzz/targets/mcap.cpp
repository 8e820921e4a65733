// SPDX-License-Identifier: Apache-2.0
// Input: one byte, then an MCAP file. The byte says who reads it: m the MCAP reader alone, with
// attachments and all CRCs; r as a record in order of time, R in any order.
#include "common/files/file_error.h"
#include "common/mcap/mcap_error.h"
#include "common/mcap/mcap_reader.h"
#include "common/record/record_reader.h"
#include "common/record/record_samples.h"
#include "tests/fuzz/expectations.h"
#include "tests/fuzz/scratch_file.h"

namespace zerodrift::fuzz {
namespace {

// Small, so that a length in the input shows where it is believed.
constexpr mcap::ReaderOptions kLimits{.most_chunk_bytes = 1 << 20,
                                      .most_attachment_bytes = 1 << 20};

void read_file(std::string_view bytes) {
  mcap::Reader reader(std::make_unique<mcap::MemorySource>(std::string(bytes)), "input.mcap",
                      kLimits);
  mcap::Cursor cursor(reader);
  std::uint64_t messages = 0;
  for (mcap::Message message; cursor.next(message); ++messages) {
    const mcap::Channel* channel = reader.contents().channel(message.channel_id);
    demand(channel != nullptr, "a message has a channel");
    static_cast<void>(reader.contents().schema(channel->schema_id));
  }
  demand(messages <= bytes.size() * (std::size_t{1} << 20U), "no message comes from nothing");
  for (const auto& attachment : reader.contents().attachments) {
    try {
      demand(reader.attachment(attachment).size() <= bytes.size(), "an attachment is in the file");
    } catch (const mcap::McapError& error) {
      demand_one_line(error.what());
    }
  }
  reader.verify();
  for (const auto& finding : reader.findings()) demand_one_line(finding);
}

void read_record(std::string_view bytes, record::TimeOrder order) {
  static ScratchFile file("input.mcap");
  file.fill(bytes);
  record::RecordReader reader(file.path(), {.time_order = order});
  std::optional<core::SensorTime> before;
  core::TemperatureSample temperature;
  while (const record::RecordRow* row = reader.next()) {
    demand(order == record::TimeOrder::kAsFound || !before || *before < row->time,
           "time strictly increases");
    before = row->time;
    demand(row->interval_s >= 0.0, "an interval is not negative");
    if (record::brings_rate(*row)) static_cast<void>(record::to_angular_rate(*row));
    static_cast<void>(record::to_rate_reference(*row, reader.info()));
    static_cast<void>(record::to_environment(*row, reader.info()));
    for (std::size_t probe = 0; probe < reader.info().probes.size(); ++probe) {
      if (record::brings_temperature(*row, probe))
        record::to_temperature(*row, reader.info(), probe, temperature);
    }
  }
  for (const auto& warning : reader.warnings()) demand_one_line(warning);
}

}  // namespace

void mcap(Bytes input) {
  if (input.empty()) return;
  const std::string_view bytes = as_text(input.subspan(1));
  try {
    if (input.front() == 'r') return read_record(bytes, record::TimeOrder::kStrictlyIncreasing);
    if (input.front() == 'R') return read_record(bytes, record::TimeOrder::kAsFound);
    read_file(bytes);
  } catch (const mcap::McapError& error) {
    demand_one_line(error.what());
  } catch (const files::FileError& error) {
    demand_one_line(error.what());
  }
}

}  // namespace zerodrift::fuzz
