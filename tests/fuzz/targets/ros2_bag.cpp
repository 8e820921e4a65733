// SPDX-License-Identifier: Apache-2.0
// Input: one byte, then what it says: i the bytes of a sensor_msgs/msg/Imu, t those of a
// sensor_msgs/msg/Temperature, y a bag's metadata.yaml, n a topic with its probe as on a command
// line; b an MCAP file read as a bag in order of time, B in any order, its topics named up to a
// line end.
#include <cmath>

#include "common/files/file_error.h"
#include "common/record/bag_files.h"
#include "common/record/probe_topic.h"
#include "common/record/record_reader.h"
#include "common/record/record_samples.h"
#include "common/record/ros2_messages.h"
#include "tests/fuzz/expectations.h"
#include "tests/fuzz/scratch_file.h"

namespace zerodrift::fuzz {
namespace {

void read_imu(std::string_view bytes) {
  const auto imu = record::decode_ros2_imu(bytes);
  if (!imu) return;
  core::RosRates rates(core::ClockSource::kReplay);
  const auto sample = rates.take(*imu);
  if (!sample) return;
  demand(sample->time != core::SensorTime{0} || imu->stamp.sec != 0, "a stamp of 0 is none");
  for (std::size_t i = 0; i < core::kAxisCount; ++i)
    demand(!sample->valid[i] || std::isfinite(sample->rate_radps[i]), "a valid rate is finite");
}

void read_temperature(std::string_view bytes) {
  const auto message = record::decode_ros2_temperature(bytes);
  if (!message) return;
  core::RosTemperatures temperatures("coil", core::ClockSource::kReplay);
  const auto sample = temperatures.take(*message);
  demand(!sample || !sample->measured || std::isfinite(sample->temperature_degc),
         "a measured temperature is finite");
}

void read_metadata(std::string_view text) {
  for (const auto& file : record::parse_bag_metadata(std::string(text), "metadata.yaml").files) {
    const std::filesystem::path path = file;
    demand(path.is_relative(), "a bag's file is in its folder");
    for (const auto& part : path) demand(part != "..", "a bag's file does not leave its folder");
  }
}

void read_name(std::string_view text) {
  const auto named = record::parse_probe_topic(text);
  demand(!named || (!named->probe.empty() && named->probe.size() <= 32 && !named->topic.empty()),
         "a probe has a name that a temperature has room for");
}

// The first topic of the line is that of the rates, others are of temperatures.
record::BagTopics topics_of(std::string_view line) {
  record::BagTopics topics;
  while (!line.empty()) {
    const std::size_t end = line.find(',');
    const std::string topic(line.substr(0, end));
    if (topics.rates.empty()) {
      topics.rates = topic;
    } else {
      topics.temperatures.push_back(topic);
    }
    line.remove_prefix(end == std::string_view::npos ? line.size() : end + 1);
  }
  return topics;
}

void read_bag(std::string_view text, record::TimeOrder order) {
  static ScratchFile file("input.mcap");
  const record::BagTopics topics = topics_of(take_line(text));
  file.fill(text);
  record::RecordReader reader(file.path(), {.time_order = order, .topics = topics});
  std::optional<core::SensorTime> before;
  std::optional<std::uint64_t> number;
  while (const record::RecordRow* row = reader.next()) {
    demand(order == record::TimeOrder::kAsFound || !before || *before < row->time,
           "time strictly increases");
    before = row->time;
    if (!record::brings_rate(*row)) continue;
    const auto sample = record::to_angular_rate(*row);
    demand(!number || sample.sequence > *number, "messages count up");
    number = sample.sequence;
  }
  for (const auto& warning : reader.warnings()) demand_one_line(warning);
}

}  // namespace

void ros2_bag(Bytes input) {
  if (input.empty()) return;
  const std::string_view bytes = as_text(input.subspan(1));
  try {
    switch (input.front()) {
      case 'i': return read_imu(bytes);
      case 't': return read_temperature(bytes);
      case 'y': return read_metadata(bytes);
      case 'n': return read_name(bytes);
      case 'B': return read_bag(bytes, record::TimeOrder::kAsFound);
      default: return read_bag(bytes, record::TimeOrder::kStrictlyIncreasing);
    }
  } catch (const files::FileError& error) {
    demand_one_line(error.what());
  }
}

}  // namespace zerodrift::fuzz
