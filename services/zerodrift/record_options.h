// SPDX-License-Identifier: Apache-2.0
// What the commands that read a record say of it on the command line.
#pragma once

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "common/mcap/compression.h"
#include "common/record/record_reader.h"
#include "common/service/one_of.h"

namespace zerodrift::services {

inline constexpr const char* kRecordHelp =
    "a .csv (also .csv.gz, .csv.xz, .csv.zst) or .mcap file, or a bag of ROS 2 in MCAP, file or "
    "folder";

inline void add_columns(CLI::App& command, std::string& columns) {
  command.add_option("--columns", columns, "names and units of a foreign CSV");
}

inline void add_gyro_choice(CLI::App& command, std::optional<std::uint32_t>& gyro_id) {
  command.add_option("--gyro-id", gyro_id, ".mcap: which gyro, where there are several")
      ->check(CLI::Range(1U, 4294967295U));
}

inline void add_temperature_topics(CLI::App& command, record::BagTopics& topics) {
  command
      .add_option("--temperature-topic", topics.temperatures,
                  "of a ROS 2 bag: [PROBE=]TOPIC of sensor_msgs/Temperature (repeatable); probe "
                  "coil without a name")
      ->allow_extra_args(false);
}

// Which topics of a ROS 2 bag.
inline void add_bag_topics(CLI::App& command, record::BagTopics& topics) {
  command.add_option("--topic", topics.rates,
                     "of a ROS 2 bag: its topic of sensor_msgs/Imu, where there are several");
  add_temperature_topics(command, topics);
}

// How the file of a record is read.
inline void add_reading(CLI::App& command, record::RecordInput& record) {
  add_columns(command, record.columns);
  add_gyro_choice(command, record.gyro_id);
  add_bag_topics(command, record.topics);
}

inline CLI::Option* add_compression(CLI::App& command, mcap::Compression& compression) {
  const std::map<std::string, mcap::Compression> names{{"none", mcap::Compression::kNone},
                                                       {"lz4", mcap::Compression::kLz4},
                                                       {"zstd", mcap::Compression::kZstd}};
  const auto standard = std::find_if(names.begin(), names.end(),
                                     [&](const auto& one) { return one.second == compression; });
  return command.add_option("--compression", compression, "of an .mcap file")
      ->transform(service::one_of(names))
      ->option_text("zstd|lz4|none [" + standard->first + "]");
}

// Of an option that has a default for other purposes: what was asked for, if anything.
[[nodiscard]] inline std::optional<std::uint32_t> chosen_gyro(const CLI::Option& option) {
  if (option.count() == 0) return std::nullopt;
  return option.as<std::uint32_t>();
}

}  // namespace zerodrift::services
