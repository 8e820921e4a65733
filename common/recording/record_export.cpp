// SPDX-License-Identifier: Apache-2.0
#include "common/recording/record_export.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "common/dds/conversions.h"
#include "common/dds/raw_reader.h"
#include "common/files/atomic_file.h"
#include "common/files/file_error.h"
#include "common/mcap/log_file.h"
#include "common/mcap/mcap_reader.h"
#include "common/record/record_reader.h"
#include "common/record/record_rows.h"
#include "common/record/record_samples.h"
#include "common/record/record_writer.h"
#include "common/recording/compensated_csv.h"
#include "common/recording/record_file.h"

namespace zerodrift::recording {
namespace {

constexpr std::uint64_t kRowsPerProgress = 4096;

std::uint32_t index_among_topics(const dds::TopicSpec& spec) {
  const auto found = std::find_if(dds::kAllTopics.begin(), dds::kAllTopics.end(),
                                  [&](const auto& other) { return other.name == spec.name; });
  return static_cast<std::uint32_t>(found - dds::kAllTopics.begin());
}

// The gyros whose compensated samples are in the file.
std::vector<std::uint32_t> compensated_gyros(mcap::Reader& reader) {
  std::vector<std::uint32_t> gyros;
  mcap::Cursor cursor(reader);
  msg::CompensatedRate sample;
  for (mcap::Message message; cursor.next(message);) {
    if (reader.contents().channel(message.channel_id)->topic != dds::kCompensatedRate.name)
      continue;
    if (!dds::decode(message.data, sample)) continue;
    if (std::find(gyros.begin(), gyros.end(), sample.gyro_id()) == gyros.end())
      gyros.push_back(sample.gyro_id());
  }
  std::sort(gyros.begin(), gyros.end());
  return gyros;
}

std::uint32_t chosen(const ExportRequest& request, const std::vector<std::uint32_t>& gyros) {
  std::string names;
  for (const auto gyro : gyros) names += (names.empty() ? "" : ", ") + std::to_string(gyro);
  const std::string& file = request.from.file;
  if (gyros.empty()) throw files::FileError(file + ": has no message of compensated_rate");
  if (!request.from.gyro_id) {
    if (gyros.size() == 1) return gyros.front();
    throw files::FileError(file + ": holds gyros " + names + "; choose one by --gyro-id");
  }
  if (std::binary_search(gyros.begin(), gyros.end(), *request.from.gyro_id))
    return *request.from.gyro_id;
  throw files::FileError(file + ": has no gyro " + std::to_string(*request.from.gyro_id) +
                         ", expected --gyro-id to be one of " + names);
}

// A faulty stream is written as it is, to be looked at.
void add_fault(std::string fault, ExportResult& result) {
  if (!fault.empty()) result.warnings.push_back(std::move(fault));
}

// Says how far the rows are, where it is known how many there will be.
class RowShare {
 public:
  RowShare(const std::filesystem::path& from, const record::WriteShare& progress)
      : expected_rows_(record::estimated_rows(from)), progress_(progress) {}

  void operator()(std::uint64_t rows, std::uint64_t bytes) const {
    if (expected_rows_ && rows % kRowsPerProgress == 0)
      progress_(static_cast<double>(rows) / *expected_rows_, bytes);
  }

 private:
  std::optional<double> expected_rows_;
  const record::WriteShare& progress_;
};

}  // namespace

ExportResult export_record(const ExportRequest& request, const record::WriteShare& progress) {
  record::RecordOptions as_found = request.from.options();
  as_found.time_order = record::TimeOrder::kAsFound;
  record::RecordReader reader(request.from.file, std::move(as_found));
  const record::RecordInfo& info = reader.info();
  record::RecordWriterOptions layout{.columns = info.columns, .metadata = info.metadata};
  layout.columns.emplace_back(record::kSequenceColumn);
  if (info.gyro_id != 0) layout.metadata.emplace_back("gyro_id", std::to_string(info.gyro_id));
  record::RecordWriter writer(request.to, layout);
  const RowShare share(request.from.file, progress);
  ExportResult result;
  while (const record::RecordRow* row = reader.next()) {
    writer.time(row->time);
    for (std::size_t i = 0; i < core::kAxisCount; ++i) {
      if (info.has_rate[i]) writer.number(row->rate_radps[i]);
    }
    for (std::size_t i = 0; i < core::kAxisCount; ++i) {
      if (info.has_reference[i]) writer.number(row->reference_radps[i]);
    }
    for (std::size_t i = 0; i < core::kEnvironmentChannels; ++i) {
      if (core::has_channel(info.environment, i)) writer.number(core::channel(row->inputs, i));
    }
    for (const double temperature_degc : row->temperature_degc) writer.number(temperature_degc);
    if (record::brings_rate(*row)) {
      writer.text(std::to_string(record::to_angular_rate(*row).sequence));
    } else {
      writer.blank();
    }
    writer.end_row();
    share(++result.rows, writer.bytes());
  }
  writer.commit();
  result.warnings = reader.warnings();
  add_fault(writer.fault_of_times(), result);
  return result;
}

ExportResult export_compensated(const ExportRequest& request, const record::WriteShare& progress) {
  mcap::Reader reader{request.from.file};
  const std::uint32_t gyro = chosen(request, compensated_gyros(reader));
  CompensatedCsv csv(request.to);
  ExportResult result;
  mcap::Cursor cursor(reader);
  msg::CompensatedRate sample;
  for (mcap::Message message; cursor.next(message);) {
    if (reader.contents().channel(message.channel_id)->topic != dds::kCompensatedRate.name)
      continue;
    if (!dds::decode(message.data, sample) || sample.gyro_id() != gyro) continue;
    csv.write(dds::from_message(sample));
    if (++result.rows % kRowsPerProgress == 0) progress(cursor.progress(), csv.bytes());
  }
  csv.commit();
  result.warnings = reader.findings();
  add_fault(csv.fault_of_times(), result);
  return result;
}

ExportResult import_record(const ExportRequest& request, const record::WriteShare& progress) {
  record::RecordReader reader(request.from.file, request.from.options());
  const std::uint32_t gyro = request.from.gyro_id.value_or(1);
  RecordFileOptions file_options;
  file_options.out = request.to;
  file_options.writer.compression = request.compression;
  file_options.metadata = {{"from", std::filesystem::path(request.from.file).filename().string()},
                           {"log_time", "sensor time, where it is above 0"},
                           {"publish_time", "sensor time, where it is above 0"}};
  files::UnfinishedFile unfinished(request.to.string() + ".active");
  std::optional<RecordFile> opened;
  try {
    opened.emplace(std::move(file_options));
  } catch (const mcap::FileInUse&) {
    unfinished.keep();  // it is another's, who is writing it
    throw;
  }
  RecordFile& file = *opened;
  std::uint64_t bytes = 0;  // of payloads
  const auto put = [&](const dds::TopicSpec& spec, std::uint64_t sequence, core::SensorTime time,
                       std::string_view part, const std::string& payload) {
    bytes += payload.size();
    file.write({.topic = index_among_topics(spec),
                .gyro_id = gyro,
                .sequence = sequence,
                .log_ns = time.count(),
                .publish_ns = time.count(),
                .part = part,
                .payload = payload});
  };
  const RowShare share(request.from.file, progress);
  ExportResult result;
  core::TemperatureSample temperature;
  while (const record::RecordRow* row = reader.next()) {
    for (std::size_t probe = 0; probe < reader.info().probes.size(); ++probe) {
      record::to_temperature(*row, reader.info(), probe, temperature);
      if (!temperature.measured) continue;
      auto message = dds::to_message(temperature, gyro);
      put(dds::kTemperature, temperature.sequence, row->time, temperature.probe,
          dds::encode(message));
    }
    if (const auto reference = record::to_rate_reference(*row, reader.info())) {
      auto message = dds::to_message(*reference, gyro);
      put(dds::kRateReference, row->index, row->time, "", dds::encode(message));
    }
    if (const auto environment = record::to_environment(*row, reader.info())) {
      auto message = dds::to_message(*environment, gyro);
      put(dds::kEnvironment, environment->sequence, row->time, "", dds::encode(message));
    }
    if (record::brings_rate(*row)) {
      const core::AngularRateSample rate = record::to_angular_rate(*row);
      auto message = dds::to_message(rate, gyro, 0);
      put(dds::kAngularRate, rate.sequence, row->time, "", dds::encode(message));
    }
    share(++result.rows, bytes);
  }
  file.finish({});
  unfinished.keep();
  result.warnings = reader.warnings();
  return result;
}

void export_attachment(const std::filesystem::path& from, const std::string& name,
                       const std::filesystem::path& to) {
  const mcap::Reader reader{from};
  std::string names;
  for (const auto& attachment : reader.contents().attachments) {
    if (attachment.name == name) {
      files::AtomicFile file(to);
      file.append(reader.attachment(attachment));
      file.commit();
      return;
    }
    names += (names.empty() ? "" : ", ") + attachment.name;
  }
  throw files::FileError(from.string() + ": has no attachment '" + name + "', expected one of " +
                         (names.empty() ? "none" : names));
}

}  // namespace zerodrift::recording
