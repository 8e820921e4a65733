// SPDX-License-Identifier: Apache-2.0
#include "services/zerodrift/info_mcap.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>

#include "common/core/one_line.h"
#include "common/dds/topics.h"
#include "common/files/file_error.h"
#include "common/measurement/doubts_json.h"
#include "common/record/elapsed_time.h"
#include "common/record/record_reader.h"
#include "common/report/json_object.h"
#include "common/report/numbers.h"
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
  json["rate_hz"] = channel.rate_hz ? nlohmann::ordered_json(*channel.rate_hz) : nullptr;
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
                              {"warnings", summary.warnings},
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
  std::printf("  %-36s %10llu ", name.c_str(), static_cast<unsigned long long>(channel.messages));
  if (channel.rate_hz) {
    std::printf("%10.6g Hz", *channel.rate_hz);
  } else {
    std::printf("%10s   ", "");
  }
  std::printf(" %9.3f MB", 1e-6 * static_cast<double>(channel.bytes));
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
  for (const auto& line : summary.warnings) std::printf("%s\n", line.c_str());
  for (const auto& line : summary.findings) std::printf("%s\n", line.c_str());
  if (summary.lost > 0)
    std::printf("%llu messages were lost\n", static_cast<unsigned long long>(summary.lost));
}

class Span {
 public:
  void add(double time_s) {
    first_s_ = std::min(first_s_, time_s);
    last_s_ = std::max(last_s_, time_s);
  }
  [[nodiscard]] double length_s() const { return std::max(last_s_ - first_s_, 0.0); }

 private:
  double first_s_ = std::numeric_limits<double>::max();
  double last_s_ = std::numeric_limits<double>::lowest();
};

struct Counted {
  ChannelSummary channel{};
  std::uint32_t sequence = 0;
  record::ElapsedTime::Stream log_stream{};
  Span arrivals{};
  std::uint64_t with_sensor_time = 0;  // messages; the others are no part of what follows
  record::ElapsedTime sensor_time{};
  record::ElapsedTime::Stream sensor_stream{};
  Span measured{};
};

core::SensorTime stamp(std::uint64_t time_ns) {
  constexpr std::uint64_t kLatest = std::numeric_limits<std::int64_t>::max();
  return core::SensorTime{static_cast<std::int64_t>(std::min(time_ns, kLatest))};
}

ChannelSummary begun(const mcap::Contents& contents, const mcap::Message& first) {
  const mcap::Channel& known = *contents.channel(first.channel_id);
  ChannelSummary channel{
      .topic = core::one_line(known.topic),
      .gyro_id = core::one_line(std::string(mcap::value_of(known.metadata, "gyro_id"))),
      .probe = core::one_line(std::string(mcap::value_of(known.metadata, "probe"))),
      .first_ns = first.log_time_ns};
  if (const auto* schema = contents.schema(known.schema_id))
    channel.schema = core::one_line(schema->name);
  return channel;
}

// A recorder of this project writes the sensor time as the time of publishing, and the log time
// where there is none. Of reports it says only how far they reach.
bool has_sensor_time(const ChannelSummary& channel, const mcap::Message& message) {
  constexpr std::array kMeasured{dds::kAngularRate.type, dds::kCompensatedRate.type,
                                 dds::kTemperature.type, dds::kRateReference.type,
                                 dds::kEnvironment.type};
  return message.publish_time_ns != 0 && message.publish_time_ns != message.log_time_ns &&
         std::find(kMeasured.begin(), kMeasured.end(), channel.schema) != kMeasured.end();
}

void note(Counted& counted, const mcap::Message& message) {
  ChannelSummary& channel = counted.channel;
  counted.sequence = message.sequence;
  channel.last_ns = std::max(channel.last_ns, message.log_time_ns);
  channel.bytes += message.data.size();
  ++channel.messages;
  if (!has_sensor_time(channel, message)) return;
  counted.measured.add(
      counted.sensor_time.add(stamp(message.publish_time_ns), counted.sensor_stream));
  ++counted.with_sensor_time;
}

// No interval lies across a step of the sensor's clock. Readings that their publisher kept for who
// comes late arrive at once, whatever their rate was.
std::optional<double> rate_of(const Counted& counted) {
  constexpr double kLongestBurstS = 1.0;
  const std::uint64_t messages = counted.channel.messages;
  if (counted.with_sensor_time > messages / 2) {
    const std::uint64_t apart = 1 + counted.sensor_time.step_count();
    const double span_s = counted.measured.length_s();
    if (span_s <= 0.0 || counted.with_sensor_time <= apart) return std::nullopt;
    return static_cast<double>(counted.with_sensor_time - apart) / span_s;
  }
  const double span_s = counted.arrivals.length_s();
  if (span_s < kLongestBurstS) return std::nullopt;
  return static_cast<double>(messages - 1) / span_s;
}

std::vector<std::string> steps_of(const record::ElapsedTime& arrivals, const std::string& file) {
  const std::string name = core::one_line(file) + ": ";
  std::vector<std::string> lines;
  for (const auto& [after_s, by_s] : arrivals.steps()) {
    const std::string by = report::significant(std::abs(by_s), 3) + " s, ";
    lines.push_back(name + "after " + report::significant(after_s, 3) + " s its log times " +
                    (by_s < 0.0
                         ? "go back by " + by + "as the clock was set"
                         : "jump ahead by " + by + "as the clock was set or nothing was recorded") +
                    "; duration and rates leave that out");
  }
  if (arrivals.step_count() > lines.size()) {
    lines.push_back(name + std::to_string(arrivals.step_count() - lines.size()) +
                    " more such steps of its log times");
  }
  return lines;
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

McapSummary summarise(const std::string& file) {
  mcap::Reader reader{std::filesystem::path(file)};
  McapSummary summary{.file = file, .bytes = reader.bytes()};
  const mcap::Contents& contents = reader.contents();
  summary.library = contents.library;
  summary.attachments = contents.attachments;
  summary.metadata = contents.metadata;

  std::map<std::uint16_t, Counted> channels;
  record::ElapsedTime arrivals;
  Span duration;
  mcap::Cursor cursor(reader);
  for (mcap::Message message; cursor.next(message);) {
    Counted& counted = channels[message.channel_id];
    if (counted.channel.messages == 0) {
      counted.channel = begun(contents, message);
    } else if (counts_up(counted.channel.topic)) {
      note_sequence(counted.channel, message.sequence, counted.sequence);
    }
    const double arrival_s = arrivals.add(stamp(message.log_time_ns), counted.log_stream);
    duration.add(arrival_s);
    counted.arrivals.add(arrival_s);
    note(counted, message);
    ++summary.messages;
  }
  for (auto& [id, counted] : channels) {
    counted.channel.rate_hz = rate_of(counted);
    summary.channels.push_back(std::move(counted.channel));
  }
  summary.duration_s = duration.length_s();
  summary.warnings = steps_of(arrivals, file);

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
