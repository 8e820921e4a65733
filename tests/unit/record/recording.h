// SPDX-License-Identifier: Apache-2.0
// Recordings of the live topics, made for a test.
#pragma once

#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <tuple>

#include "common/dds/conversions.h"
#include "common/dds/idl_text.h"
#include "common/dds/raw_reader.h"
#include "common/mcap/mcap_writer.h"

namespace zerodrift::record {

// Whether a channel says whose messages it holds, as this project's recorder does.
enum class Channels { kPerGyro, kPerTopic };

class Recording {
 public:
  explicit Recording(Channels channels = Channels::kPerGyro)
      : channels_(channels),
        writer_([this](std::string_view more) { bytes_.append(more); },
                {.compression = mcap::Compression::kLz4, .chunk_bytes = 600}) {}

  void add(std::uint32_t gyro, const core::AngularRateSample& sample) {
    auto message = dds::to_message(sample, gyro, 0);
    put(dds::kAngularRate, gyro, "", dds::encode(message));
  }
  void add(std::uint32_t gyro, const core::TemperatureSample& sample) {
    auto message = dds::to_message(sample, gyro);
    put(dds::kTemperature, gyro, sample.probe, dds::encode(message));
  }
  void add(std::uint32_t gyro, const core::EnvironmentSample& sample) {
    auto message = dds::to_message(sample, gyro);
    put(dds::kEnvironment, gyro, "", dds::encode(message));
  }
  void add(std::uint32_t gyro, const core::RateReferenceSample& sample) {
    auto message = dds::to_message(sample, gyro);
    put(dds::kRateReference, gyro, "", dds::encode(message));
  }
  void put(const dds::TopicSpec& spec, std::uint32_t gyro, const std::string& probe,
           const std::string& payload) {
    const bool per_gyro = channels_ == Channels::kPerGyro;
    const auto key = std::make_tuple(spec.name, per_gyro ? gyro : 0U, per_gyro ? probe : "");
    if (!ids_.contains(key)) {
      mcap::Pairs metadata;
      if (per_gyro) metadata.emplace_back("gyro_id", std::to_string(gyro));
      if (per_gyro && !probe.empty()) metadata.emplace_back("probe", probe);
      const auto schema = writer_.add_schema(spec.type, "omgidl", dds::idl_of(spec).text);
      ids_[key] = writer_.add_channel(schema, spec.name, "cdr", metadata);
    }
    ++log_time_ns_;
    writer_.write({.channel_id = ids_[key], .log_time_ns = log_time_ns_, .data = payload});
  }

  // The file so far, without a summary.
  [[nodiscard]] const std::string& bytes_so_far() {
    writer_.flush();
    return bytes_;
  }
  std::filesystem::path write_to(const std::filesystem::path& path) {
    writer_.finish();
    std::ofstream(path, std::ios::binary) << bytes_;
    return path;
  }

 private:
  Channels channels_;
  std::string bytes_;
  mcap::Writer writer_;
  std::map<std::tuple<std::string_view, std::uint32_t, std::string>, std::uint16_t> ids_;
  std::uint64_t log_time_ns_ = 0;
};

inline core::AngularRateSample rate_at(double time_s, std::uint64_t sequence) {
  core::AngularRateSample sample;
  sample.sequence = sequence;
  sample.time = core::from_seconds(time_s);
  sample.interval_s = 0.0049;
  sample.rate_radps = {time_s, -time_s, 0.1 * time_s};
  sample.valid = {true, true, true};
  sample.clock = core::ClockSource::kSimulation;
  return sample;
}

// A supply, and a field of which nothing was measured.
inline core::EnvironmentSample environment_at(double time_s, double supply_v) {
  core::EnvironmentSample sample;
  sample.time = core::from_seconds(time_s);
  sample.channels = 0b1'0000'0111U;
  sample.values.supply_v = supply_v;
  sample.clock = core::ClockSource::kSimulation;
  return sample;
}

inline core::TemperatureSample reading_at(double time_s, const char* probe, double degc) {
  core::TemperatureSample sample;
  sample.probe = probe;
  sample.time = core::from_seconds(time_s);
  sample.temperature_degc = degc;
  sample.clock = core::ClockSource::kSimulation;
  return sample;
}

}  // namespace zerodrift::record
