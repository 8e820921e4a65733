// SPDX-License-Identifier: Apache-2.0
// A topic of ROS 2 nodes as the source of a publisher: what is received goes on at once, with the
// stamps that the messages carry.
#pragma once

#include <CLI/CLI.hpp>
#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "common/core/ros2.h"
#include "common/dds/ros2_input.h"
#include "common/service/host.h"
#include "common/service/one_of.h"

namespace zerodrift::replay {

// Where ROS 2 nodes are looked for.
struct RosOptions {
  std::string topic{};                    // as --source ros2:<topic> says
  std::optional<std::uint32_t> domain{};  // ROS_DOMAIN_ID; none: that of all other topics
};

void add_ros2_options(CLI::App& app, RosOptions& options);

// For --source: one of `kinds` by its name, or "ros2:<topic>", which is kinds' "ros2".
template <typename Kind>
[[nodiscard]] CLI::Validator source_of(const std::map<std::string, Kind>& kinds,
                                       std::string& ros2_topic) {
  constexpr const char* kRos2 = "ros2";
  const auto named = std::make_shared<CLI::Validator>(service::one_of(kinds));
  const auto replace = [named, &ros2_topic](std::string& word) {
    const std::string prefix = std::string(kRos2) + ":";
    if (word.starts_with(prefix)) {
      ros2_topic = word.substr(prefix.size());
      word = kRos2;
    }
    return (*named)(word);
  };
  std::string names;
  for (const auto& [name, kind] : kinds)
    names += (names.empty() ? "" : "|") + (name == kRos2 ? name + ":TOPIC" : name);
  return {replace, names};
}

// The participant that listens: the host's own, or one in ROS 2's domain. That is no secured one,
// as ROS 2's certificates are others: beside a secured system another domain is refused.
class RosParticipant {
 public:
  // Throws std::invalid_argument with one line, dds::DdsError.
  RosParticipant(service::Host& host, const dds::NetworkOptions& network,
                 const RosOptions& options);
  [[nodiscard]] dds::Participant& get() noexcept { return other_ ? *other_ : host_.participant(); }
  [[nodiscard]] std::uint32_t domain() const noexcept { return domain_; }
  [[nodiscard]] bool is_hosts() const noexcept { return !other_.has_value(); }
  // What the middleware noticed, as events of the host. Not from a reader's callback.
  void report();

 private:
  service::Host& host_;
  std::uint32_t domain_;
  std::optional<dds::Participant> other_{};
};

// What there is to report of one topic that is read, beside what its reader notices itself
// (samples lost, another type). report() from time to time on one thread;
// note() once a message on another, without memory or a lock.
class RosTopicWatch {
 public:
  RosTopicWatch(service::Host& host, std::uint32_t gyro_id, std::uint32_t domain);

  void note(std::uint64_t missing, bool has_stamp) noexcept {
    received_.fetch_add(1, std::memory_order_relaxed);
    missing_.fetch_add(missing, std::memory_order_relaxed);
    if (!has_stamp) unstamped_.fetch_add(1, std::memory_order_relaxed);
  }
  // `waited_s`: since the source began.
  void report(const std::string& topic, std::string_view type, int publishers, double waited_s);

  [[nodiscard]] std::uint64_t received() const noexcept { return received_; }
  [[nodiscard]] std::uint64_t missing() const noexcept { return missing_; }
  [[nodiscard]] std::uint64_t unstamped() const noexcept { return unstamped_; }

 private:
  void raise(const char* code, service::Severity severity, const std::string& text,
             std::uint64_t times);

  service::Host& host_;
  std::uint32_t gyro_id_;
  std::uint32_t domain_;
  std::atomic<std::uint64_t> received_{0};
  std::atomic<std::uint64_t> missing_{0};
  std::atomic<std::uint64_t> unstamped_{0};
  std::uint64_t reported_unstamped_ = 0;
  bool reported_nobody_ = false;
  bool reported_several_ = false;
};

// One topic. `Counter` makes samples of the messages (core/ros2.h).
template <typename Message, typename Counter>
class RosSource {
 public:
  using Sample = typename decltype(std::declval<Counter>().take(
      std::declval<const typename dds::RosReader<Message>::Said&>()))::value_type;
  // On the participant's receiving thread, one at a time.
  using OnSample = std::function<void(const Sample&)>;

  RosSource(service::Host& host, std::uint32_t gyro_id, RosParticipant& participant,
            const std::string& topic, Counter counter, OnSample on_sample)
      : watch_(host, gyro_id, participant.domain()),
        counter_(std::move(counter)),
        on_sample_(std::move(on_sample)),
        reader_(
            participant.get(), topic,
            [this](const auto& message, std::uint64_t missing) { take(message, missing); },
            host.observer()) {}

  void report(double waited_s) {
    watch_.report(reader_.topic(), reader_.type(), reader_.matched(), waited_s);
  }
  [[nodiscard]] const RosTopicWatch& watch() const noexcept { return watch_; }
  [[nodiscard]] const std::string& topic() const noexcept { return reader_.topic(); }

 private:
  void take(const typename dds::RosReader<Message>::Said& message, std::uint64_t missing) {
    counter_.skip(missing);
    const auto sample = counter_.take(message);
    watch_.note(missing, sample.has_value());
    if (sample) on_sample_(*sample);
  }

  RosTopicWatch watch_;
  Counter counter_;
  OnSample on_sample_;
  dds::RosReader<Message> reader_;
};

using RosRateSource = RosSource<sensor_msgs::msg::dds_::Imu_, core::RosRates>;
using RosTemperatureSource = RosSource<sensor_msgs::msg::dds_::Temperature_, core::RosTemperatures>;

}  // namespace zerodrift::replay
