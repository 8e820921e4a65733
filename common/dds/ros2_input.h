// SPDX-License-Identifier: Apache-2.0
// What ROS 2 nodes publish, as an input without a bridge. A ROS 2 topic /<name> is the DDS topic
// rt/<name> (ROS 2 design, "Topic and Service name mapping to DDS").
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include "common/core/ros2.h"
#include "common/dds/participant.h"

namespace zerodrift::dds {

// Nothing where `name` is no topic's name, with or without the leading '/'.
[[nodiscard]] std::optional<std::string> dds_name_of_ros_topic(std::string_view name);

[[nodiscard]] core::RosImu from_message(const sensor_msgs::msg::dds_::Imu_& message) noexcept;
[[nodiscard]] core::RosTemperature from_message(
    const sensor_msgs::msg::dds_::Temperature_& message) noexcept;

// How many samples of a writer did not arrive, by its numbers. A best-effort reader gets nothing
// again. One thread.
class MissingSamples {
 public:
  // Between the sample of this origin and the one before it; 0 for a writer's first.
  std::uint64_t before(const SampleOrigin& origin) noexcept;

 private:
  SampleOrigin last_{};
};

// Reads one topic of ROS 2 nodes with the quality of service for sensor data.
template <typename Message>
class RosReader {
 public:
  using Said = decltype(from_message(std::declval<const Message&>()));
  // On the participant's receiving thread, one at a time; of several writers, those of each.
  using OnMessage = std::function<void(const Said&, const SampleOrigin&)>;
  // On its discovery thread: the writer is gone for good.
  using OnLeft = std::function<void(const eprosima::fastrtps::rtps::GUID_t& writer)>;

  // Throws std::invalid_argument with one line where `name` is no topic's name, DdsError.
  RosReader(Participant& participant, const std::string& name, OnMessage on_message,
            EndpointObserver observer = {}, OnLeft on_left = {})
      : topic_(checked(name)),
        spec_(spec_of(topic_)),
        on_message_(std::move(on_message)),
        on_left_(std::move(on_left)),
        reader_(
            participant, spec_,
            [this](const Message& message, const SampleOrigin& origin) {
              on_message_(from_message(message), origin);
            },
            std::move(observer),
            [this](const eprosima::fastrtps::rtps::GUID_t& writer, Departure departure) {
              if (departure == Departure::kLeft && on_left_) on_left_(writer);
            }) {}

  // Of DDS: "rt/imu/data_raw". Valid as long as the reader.
  [[nodiscard]] const std::string& topic() const noexcept { return topic_; }
  [[nodiscard]] std::string_view type() const noexcept { return spec_.type; }
  // Publishers matched now.
  [[nodiscard]] int matched() const { return reader_.matched(); }

 private:
  static std::string checked(const std::string& name);
  static TopicSpec spec_of(const std::string& topic) {
    constexpr bool kIsImu = std::is_same_v<Message, sensor_msgs::msg::dds_::Imu_>;
    TopicSpec spec = kIsImu ? kRos2ImuInput : kRos2TemperatureInput;
    spec.name = topic;
    return spec;
  }

  std::string topic_;
  TopicSpec spec_;
  OnMessage on_message_;
  OnLeft on_left_;
  Reader<Message> reader_;
};

namespace detail {
[[noreturn]] void refuse_ros_topic(const std::string& name);
}

template <typename Message>
std::string RosReader<Message>::checked(const std::string& name) {
  const auto topic = dds_name_of_ros_topic(name);
  if (!topic) detail::refuse_ros_topic(name);
  return *topic;
}

}  // namespace zerodrift::dds
