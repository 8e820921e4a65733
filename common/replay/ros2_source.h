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
#include <mutex>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "common/core/ros2.h"
#include "common/dds/ros2_input.h"
#include "common/service/followed_writer.h"
#include "common/service/host.h"
#include "common/service/monotonic_clock.h"
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

  void note(bool has_stamp) noexcept {
    received_.fetch_add(1, std::memory_order_relaxed);
    if (!has_stamp) unstamped_.fetch_add(1, std::memory_order_relaxed);
  }
  void note_missing(std::uint64_t messages) noexcept {
    missing_.fetch_add(messages, std::memory_order_relaxed);
  }
  // `refused`: messages of others than the publisher that is followed. `waited_s`: since the source
  // began.
  void report(const std::string& topic, std::string_view type, int publishers,
              std::uint64_t refused, double waited_s);

  [[nodiscard]] std::uint64_t received() const noexcept { return received_; }
  [[nodiscard]] std::uint64_t missing() const noexcept { return missing_; }
  [[nodiscard]] std::uint64_t unstamped() const noexcept { return unstamped_; }

 private:
  void raise(const char* code, service::Severity severity, const std::string& topic,
             const std::string& text, std::uint64_t times);

  service::Host& host_;
  std::uint32_t gyro_id_;
  std::uint32_t domain_;
  std::atomic<std::uint64_t> received_{0};
  std::atomic<std::uint64_t> missing_{0};
  std::atomic<std::uint64_t> unstamped_{0};
  std::uint64_t reported_unstamped_ = 0;
  bool reported_nobody_ = false;
  std::uint64_t reported_refused_ = 0;
};

// One topic. `Counter` makes samples of the messages (core/ros2.h). Of several publishers the first
// is followed until it is gone or silent (service/followed_writer.h): samples of two sensors are no
// gyro's, nor a thermometer's.
template <typename Message, typename Counter>
class RosSource {
 public:
  using Said = typename dds::RosReader<Message>::Said;
  using Sample =
      typename decltype(std::declval<Counter>().take(std::declval<const Said&>()))::value_type;
  // On the participant's receiving thread or on that of report(), one at a time.
  using OnSample = std::function<void(const Sample&)>;
  using Clock = std::function<std::int64_t()>;  // as service::monotonic_ns()

  RosSource(service::Host& host, std::uint32_t gyro_id, RosParticipant& participant,
            const std::string& topic, Counter counter, OnSample on_sample,
            Clock clock = service::monotonic_ns)
      : watch_(host, gyro_id, participant.domain()),
        counter_(std::move(counter)),
        on_sample_(std::move(on_sample)),
        clock_(std::move(clock)),
        reader_(
            participant.get(), topic,
            [this](const Said& message, const dds::SampleOrigin& origin) { take(message, origin); },
            host.observer(), [this](const Writer& writer) { note_left(writer); }) {}

  void report(double waited_s) {
    std::uint64_t refused = 0;
    {
      const std::lock_guard lock(mutex_);
      const std::int64_t now_ns = clock_();
      leave(now_ns);
      writers_.follow_who_waits(now_ns, use_);
      refused = writers_.rejected();
    }
    watch_.report(reader_.topic(), reader_.type(), reader_.matched(), refused, waited_s);
  }
  [[nodiscard]] const RosTopicWatch& watch() const noexcept { return watch_; }
  [[nodiscard]] const std::string& topic() const noexcept { return reader_.topic(); }
  // Publishers matched now.
  [[nodiscard]] int matched() const { return reader_.matched(); }

 private:
  using Writer = eprosima::fastrtps::rtps::GUID_t;
  struct Arrived {
    Said message{};
    dds::SampleOrigin origin{};
    core::SensorTime time{};
    bool measured = true;
  };
  // As GyroPipeline has it of rates, and temperature_stale_s by default of temperatures.
  static constexpr bool kIsImu = std::is_same_v<Message, sensor_msgs::msg::dds_::Imu_>;
  static constexpr core::SensorTime kStaleAfter{kIsImu ? service::kSilentPublisherNs
                                                       : 30'000'000'000};
  static constexpr std::size_t kWaiting = kIsImu ? 2048 : 512;  // a second of 2 kHz

  // A message without a stamp keeps nobody from being replaced.
  void take(const Said& message, const dds::SampleOrigin& origin) {
    const std::lock_guard lock(mutex_);
    const std::int64_t now_ns = clock_();
    leave(now_ns);
    const auto time = core::sensor_time(message.stamp);
    if (time) {
      writers_.push({message, origin, *time}, origin.writer, now_ns, use_);
    } else if (writers_.follows(origin.writer)) {
      use({message, origin});
    }
    watch_.note(time.has_value());
  }
  void use(const Arrived& arrived) {
    const std::uint64_t missing = missing_.before(arrived.origin);
    watch_.note_missing(missing);
    counter_.skip(missing);
    if (const auto sample = counter_.take(arrived.message)) on_sample_(*sample);
  }
  // The discovery thread waits for nothing that is being published.
  void note_left(const Writer& writer) {
    const std::lock_guard lock(left_mutex_);
    left_.push_back(writer);
  }
  void leave(std::int64_t now_ns) {
    const std::lock_guard lock(left_mutex_);
    for (const Writer& writer : left_) writers_.leave(writer, now_ns, use_);
    left_.clear();
  }

  RosTopicWatch watch_;
  std::mutex mutex_;  // what stands below, up to the next one
  Counter counter_;
  OnSample on_sample_;
  Clock clock_;
  dds::MissingSamples missing_;  // of the publisher that is followed
  service::FollowedWriter<Writer, Arrived> writers_{kStaleAfter, kWaiting};
  const std::function<void(const Arrived&)> use_ = [this](const Arrived& arrived) { use(arrived); };
  std::mutex left_mutex_;
  std::vector<Writer> left_;
  dds::RosReader<Message> reader_;
};

using RosRateSource = RosSource<sensor_msgs::msg::dds_::Imu_, core::RosRates>;
using RosTemperatureSource = RosSource<sensor_msgs::msg::dds_::Temperature_, core::RosTemperatures>;

}  // namespace zerodrift::replay
