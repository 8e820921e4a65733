// SPDX-License-Identifier: Apache-2.0
#include "services/zerodrift/info_mcap.h"

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>

#include "common/core/one_line.h"
#include "common/dds/topics.h"
#include "common/files/file_error.h"
#include "common/measurement/doubts_json.h"
#include "common/record/record_reader.h"
#include "common/report/json_object.h"
#include "common/service/main.h"
#include "services/zerodrift/doubts.h"

namespace zerodrift::services {
namespace {

// Not temperature: a replay leaves readings out that say nothing.
bool counts_up(std::string_view topic) {
  return topic == dds::kAngularRate.name || topic == dds::kCompensatedRate.name;
}

std::string_view ending_text(mcap::Ending ending) {
  switch (ending) {
    case mcap::Ending::kWhole: return "whole";
    case mcap::Ending::kCut: return "cut";
    case mcap::Ending::kDamaged: return "damaged";
  }
  return "";
}

// The numbers are the low 32 bits: a step is taken for the shorter way round.
void note_sequence(ChannelSummary& channel, std::uint32_t sequence, std::uint32_t before) {
  const auto step = static_cast<std::int32_t>(sequence - before);
  if (step <= 0) ++channel.backward;
  if (step <= 1) return;
  ++channel.gaps;
  channel.missing += static_cast<std::uint64_t>(step) - 1;
}

std::optional<std::uint64_t> lost_by_recorder(const McapSummary& summary) {
  for (const auto& metadata : summary.metadata) {
    if (metadata.name != "recording") continue;
    const std::string_view text = mcap::value_of(metadata.values, "messages_lost");
    std::uint64_t lost = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), lost);
    if (!text.empty() && error == std::errc{} && end == text.data() + text.size()) return lost;
  }
  return std::nullopt;
}

nlohmann::ordered_json json_of(const ChannelSummary& channel) {
  nlohmann::ordered_json json{{"topic", channel.topic}};
  if (!channel.gyro_id.empty()) json["gyro_id"] = channel.gyro_id;
  if (!channel.probe.empty()) json["probe"] = channel.probe;
  json["schema"] = channel.schema;
  json["messages"] = channel.messages;
  json["bytes"] = channel.bytes;
  json["first_ns"] = channel.first_ns;
  json["last_ns"] = channel.last_ns;
  json["rate_hz"] = channel.rate_hz();
  if (counts_up(channel.topic)) {
    json["gaps"] = channel.gaps;
    json["missing"] = channel.missing;
    json["backward"] = channel.backward;
  }
  return json;
}

nlohmann::ordered_json json_of(const McapSummary& summary) {
  nlohmann::ordered_json json{{"file", summary.file},
                              {"bytes", summary.bytes},
                              {"library", summary.library},
                              {"ending", ending_text(summary.ending)},
                              {"duration_s", summary.duration_s},
                              {"messages", summary.messages},
                              {"messages_lost", summary.lost},
                              {"chunks", summary.chunks},
                              {"compression", summary.compression},
                              {"compression_ratio", summary.compression_ratio},
                              {"channels", nlohmann::ordered_json::array()},
                              {"attachments", nlohmann::ordered_json::array()},
                              {"metadata", nlohmann::ordered_json::object()},
                              {"doubts", doubts_json(summary.doubts)},
                              {"findings", summary.findings}};
  for (const auto& channel : summary.channels) json["channels"].push_back(json_of(channel));
  for (const auto& attachment : summary.attachments) {
    json["attachments"].push_back({{"name", attachment.name},
                                   {"media_type", attachment.media_type},
                                   {"bytes", attachment.data_bytes}});
  }
  for (const auto& metadata : summary.metadata) {
    for (const auto& [key, value] : metadata.values)
      report::object_at(json["metadata"], metadata.name)[key] = value;
  }
  return json;
}

void print(const ChannelSummary& channel) {
  std::string name = channel.topic;
  if (!channel.gyro_id.empty()) name += ", gyro " + channel.gyro_id;
  if (!channel.probe.empty()) name += ", " + channel.probe;
  std::printf("  %-36s %10llu %10.6g Hz %9.3f MB", name.c_str(),
              static_cast<unsigned long long>(channel.messages), channel.rate_hz(),
              1e-6 * static_cast<double>(channel.bytes));
  if (channel.missing > 0) {
    std::printf("  %llu missing in %llu gaps", static_cast<unsigned long long>(channel.missing),
                static_cast<unsigned long long>(channel.gaps));
  }
  if (channel.backward > 0) {
    std::printf("  %llu times backward", static_cast<unsigned long long>(channel.backward));
  }
  std::printf("\n");
}

void print(const McapSummary& summary) {
  print_doubts(summary.doubts);
  std::printf("%s: MCAP by %s, %.3f MB, %s, %.3f s, %llu messages in %llu chunks, %s %.2f to 1\n",
              summary.file.c_str(), core::one_line(summary.library).c_str(),
              1e-6 * static_cast<double>(summary.bytes),
              std::string(ending_text(summary.ending)).c_str(), summary.duration_s,
              static_cast<unsigned long long>(summary.messages),
              static_cast<unsigned long long>(summary.chunks), summary.compression.c_str(),
              summary.compression_ratio);
  for (const auto& channel : summary.channels) print(channel);
  for (const auto& attachment : summary.attachments) {
    std::printf("  attachment %s: %llu bytes\n", core::one_line(attachment.name).c_str(),
                static_cast<unsigned long long>(attachment.data_bytes));
  }
  for (const auto& metadata : summary.metadata) {
    for (const auto& [key, value] : metadata.values) {
      std::printf("  %s: %s = %s\n", core::one_line(metadata.name).c_str(),
                  core::one_line(key).c_str(), core::one_line(value).c_str());
    }
  }
  for (const auto& line : summary.findings) std::printf("%s\n", line.c_str());
  if (summary.lost > 0)
    std::printf("%llu messages were lost\n", static_cast<unsigned long long>(summary.lost));
}

// Of the rates of one gyro, as a record; nothing of what can't be read as one, which the findings
// tell.
std::vector<measurement::Doubt> doubts_of(const std::string& file, std::uint32_t gyro_id) try {
  record::RecordReader reader(file,
                              {.time_order = record::TimeOrder::kAsFound, .gyro_id = gyro_id});
  measurement::RecordWatch watch(reader.info(), "");
  while (const record::RecordRow* row = reader.next()) static_cast<void>(watch.add(*row));
  std::vector<measurement::Doubt> doubts = watch.doubts();
  for (auto& doubt : doubts) doubt.record += ", gyro " + std::to_string(gyro_id);
  return doubts;
} catch (const files::FileError&) {
  return {};
}

}  // namespace

double ChannelSummary::rate_hz() const {
  if (messages < 2 || last_ns <= first_ns) return 0.0;
  return static_cast<double>(messages - 1) / (1e-9 * static_cast<double>(last_ns - first_ns));
}

McapSummary summarise(const std::string& file) {
  mcap::Reader reader{std::filesystem::path(file)};
  McapSummary summary{.file = file, .bytes = reader.bytes()};
  const mcap::Contents& contents = reader.contents();
  summary.library = contents.library;
  summary.attachments = contents.attachments;
  summary.metadata = contents.metadata;

  struct Counted {
    ChannelSummary channel{};
    std::uint32_t sequence = 0;
  };
  std::map<std::uint16_t, Counted> channels;
  std::uint64_t first_ns = 0;
  std::uint64_t last_ns = 0;
  mcap::Cursor cursor(reader);
  for (mcap::Message message; cursor.next(message);) {
    Counted& counted = channels[message.channel_id];
    ChannelSummary& channel = counted.channel;
    if (channel.messages == 0) {
      const mcap::Channel& known = *contents.channel(message.channel_id);
      channel.topic = core::one_line(known.topic);
      channel.gyro_id = core::one_line(std::string(mcap::value_of(known.metadata, "gyro_id")));
      channel.probe = core::one_line(std::string(mcap::value_of(known.metadata, "probe")));
      if (const auto* schema = contents.schema(known.schema_id))
        channel.schema = core::one_line(schema->name);
      channel.first_ns = message.log_time_ns;
    } else if (counts_up(channel.topic)) {
      note_sequence(channel, message.sequence, counted.sequence);
    }
    counted.sequence = message.sequence;
    channel.last_ns = std::max(channel.last_ns, message.log_time_ns);
    channel.bytes += message.data.size();
    ++channel.messages;
    first_ns =
        summary.messages == 0 ? message.log_time_ns : std::min(first_ns, message.log_time_ns);
    last_ns = std::max(last_ns, message.log_time_ns);
    ++summary.messages;
  }
  for (auto& [id, counted] : channels) summary.channels.push_back(std::move(counted.channel));
  summary.duration_s = 1e-9 * static_cast<double>(last_ns - first_ns);

  std::uint64_t packed = 0;
  std::uint64_t unpacked = 0;
  for (const auto& stretch : contents.stretches) {
    if (stretch.kind != mcap::StretchKind::kChunk) continue;
    ++summary.chunks;
    packed += stretch.chunk.compressed_bytes;
    unpacked += stretch.chunk.uncompressed_bytes;
    summary.compression = mcap::name(stretch.chunk.compression);
  }
  if (summary.compression.empty()) summary.compression = "none";
  if (packed > 0)
    summary.compression_ratio = static_cast<double>(unpacked) / static_cast<double>(packed);
  reader.verify();
  summary.ending = contents.ending;
  summary.findings = reader.findings();
  std::uint64_t missing = 0;
  for (const auto& channel : summary.channels) {
    missing += channel.missing;
    std::uint32_t gyro_id = 0;
    const char* const end = channel.gyro_id.data() + channel.gyro_id.size();
    if (channel.topic != dds::kAngularRate.name ||
        std::from_chars(channel.gyro_id.data(), end, gyro_id).ptr != end || gyro_id == 0)
      continue;
    const auto doubts = doubts_of(file, gyro_id);
    summary.doubts.insert(summary.doubts.end(), doubts.begin(), doubts.end());
  }
  summary.lost = lost_by_recorder(summary).value_or(missing);
  return summary;
}

int show_mcap(const std::string& file, const std::string& json, const Invocation& made_by) {
  const McapSummary summary = summarise(file);
  print(summary);
  if (!json.empty())
    write_report({json, ""}, json_of(summary), {}, provenance_of(made_by, "", {file}));
  const bool is_good =
      summary.ending == mcap::Ending::kWhole && summary.findings.empty() && summary.lost == 0;
  return is_good ? service::kExitDone : service::kExitNo;
}

}  // namespace zerodrift::services
