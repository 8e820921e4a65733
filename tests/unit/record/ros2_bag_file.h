// SPDX-License-Identifier: Apache-2.0
// Bags of ROS 2, made for a test: schemas and messages as rosbag2's MCAP storage writes them.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <string_view>
#include <utility>

#include "common/core/ros2.h"
#include "common/mcap/mcap_writer.h"

namespace zerodrift::record {

// Plain CDR behind its header, with the alignment that its rules ask for.
class CdrText {
 public:
  explicit CdrText(std::endian order) : order_(order) {
    bytes_ = {0, order == std::endian::little ? '\1' : '\0', 0, 0};
  }
  template <typename Value>
  CdrText& put(Value value) {
    while ((bytes_.size() - 4) % sizeof(Value) != 0) bytes_ += '\0';
    std::array<char, sizeof(Value)> raw{};
    std::memcpy(raw.data(), &value, sizeof value);
    if (order_ != std::endian::native) std::reverse(raw.begin(), raw.end());
    bytes_.append(raw.data(), raw.size());
    return *this;
  }
  CdrText& put_text(const std::string& text) {
    put(static_cast<std::uint32_t>(text.size() + 1));
    bytes_ += text;
    bytes_ += '\0';
    return *this;
  }
  template <std::size_t kCount>
  CdrText& put_all(const std::array<double, kCount>& values) {
    for (const double value : values) put(value);
    return *this;
  }
  [[nodiscard]] const std::string& bytes() const { return bytes_; }

 private:
  std::endian order_;
  std::string bytes_;
};

inline std::string imu_bytes(const core::RosImu& imu, std::endian order = std::endian::little,
                             const std::string& frame_id = "imu_link") {
  CdrText text(order);
  text.put(imu.stamp.sec).put(imu.stamp.nanosec).put_text(frame_id);
  text.put_all(std::array<double, 4>{0.0, 0.0, 0.0, 1.0}).put_all(std::array<double, 9>{-1.0});
  text.put_all(imu.rate_radps).put_all(imu.covariance_radps2);
  text.put_all(std::array<double, 3>{0.1, 0.2, 9.8}).put_all(std::array<double, 9>{});
  return text.bytes();
}

inline std::string temperature_bytes(const core::RosTemperature& message,
                                     std::endian order = std::endian::little) {
  CdrText text(order);
  text.put(message.stamp.sec).put(message.stamp.nanosec).put_text("imu_link");
  return text.put(message.temperature_degc).put(0.0).bytes();
}

inline constexpr std::string_view kImuType = "sensor_msgs/msg/Imu";
inline constexpr std::string_view kTemperatureType = "sensor_msgs/msg/Temperature";

class Ros2Bag {
 public:
  explicit Ros2Bag(mcap::Compression compression = mcap::Compression::kZstd)
      : writer_([this](std::string_view more) { bytes_.append(more); },
                {.compression = compression, .chunk_bytes = 600, .profile = "ros2"}) {}

  // `encoding`: of the schema.
  void put(const std::string& topic, std::string_view type, const std::string& payload,
           std::string_view encoding = "ros2msg", std::string_view message_encoding = "cdr") {
    if (!ids_.contains(topic)) {
      const auto schema = writer_.add_schema(type, encoding, "std_msgs/Header header\n");
      ids_[topic] = writer_.add_channel(schema, topic, message_encoding);
    }
    ++log_time_ns_;
    writer_.write({.channel_id = ids_[topic], .log_time_ns = log_time_ns_, .data = payload});
  }
  void imu(const std::string& topic, const core::RosImu& message,
           std::endian order = std::endian::little) {
    put(topic, kImuType, imu_bytes(message, order));
  }
  void temperature(const std::string& topic, const core::RosTemperature& message) {
    put(topic, kTemperatureType, temperature_bytes(message));
  }

  const std::string& finished() {
    writer_.finish();
    return bytes_;
  }
  std::filesystem::path write_to(const std::filesystem::path& path) {
    std::ofstream(path, std::ios::binary) << finished();
    return path;
  }

 private:
  std::string bytes_;
  mcap::Writer writer_;
  std::map<std::string, std::uint16_t> ids_;
  std::uint64_t log_time_ns_ = 0;
};

// The n-th of a gyro at 100 Hz, values that use all their bits.
inline core::RosImu imu_at(int n, std::int32_t from_s = 1'700'000'000) {
  const double value = 1e-3 / (3.0 + n);
  return {.stamp = {from_s + n / 100, static_cast<std::uint32_t>(n % 100) * 10'000'000U},
          .rate_radps = {value, -value, 0.5 * value},
          .covariance_radps2 = {1e-8, 0, 0, 0, 1e-8, 0, 0, 0, 1e-8}};
}

inline core::RosTemperature temperature_at(int n, double degc,
                                           std::int32_t from_s = 1'700'000'000) {
  return {.stamp = imu_at(n, from_s).stamp, .temperature_degc = degc};
}

}  // namespace zerodrift::record
