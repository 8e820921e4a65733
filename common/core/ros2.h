// SPDX-License-Identifier: Apache-2.0
// What messages of ROS 2 (common_interfaces) say of a gyro, whoever took them off the wire: a bag
// and a live topic go through here, so that both give the same samples to the bit.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "common/core/axis.h"
#include "common/core/sample_interval.h"
#include "common/core/samples.h"
#include "common/core/time.h"

namespace zerodrift::core {

// builtin_interfaces/msg/Time: seconds and nanoseconds, which count up from the second.
struct RosStamp {
  std::int32_t sec = 0;
  std::uint32_t nanosec = 0;
};

// Nothing where the stamp is 0, which is what a driver sends that sets none, or no time at all.
[[nodiscard]] constexpr std::optional<SensorTime> sensor_time(const RosStamp& stamp) noexcept {
  constexpr std::uint32_t kSecond = 1'000'000'000;
  if (stamp.nanosec >= kSecond || (stamp.sec == 0 && stamp.nanosec == 0)) return std::nullopt;
  return SensorTime{static_cast<std::int64_t>(stamp.sec) * kSecond + stamp.nanosec};
}

// A variance with which an axis says that it was not measured, (rad/s)²; its rate is then 0.
inline constexpr double kRosNotMeasuredVariance = 1e6;

// sensor_msgs/msg/Imu as far as it is about rates: rad/s about the axes of its frame_id, and their
// covariance, (rad/s)², row by row: all 0 where it isn't known, -1 first where there is no rate.
struct RosImu {
  RosStamp stamp{};
  PerAxis<double> rate_radps{};
  std::array<double, 9> covariance_radps2{};
};

// sensor_msgs/msg/Temperature, degC. Its variance says nothing that a sample has a place for.
struct RosTemperature {
  RosStamp stamp{};
  double temperature_degc = 0.0;
};

[[nodiscard]] inline PerAxis<bool> measured_axes(const RosImu& imu) noexcept {
  PerAxis<bool> measured{};
  if (imu.covariance_radps2[0] == -1.0) return measured;
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    const bool declared_absent =
        imu.rate_radps[i] == 0.0 && imu.covariance_radps2[4 * i] == kRosNotMeasuredVariance;
    measured[i] = is_rate(imu.rate_radps[i]) && !declared_absent;
  }
  return measured;
}

// The messages of one topic as a gyro's samples. The messages have no numbers, so they are counted:
// one without a stamp counts and gives no sample. The interval is that since the message before, as
// far as none is missing between them; 0 for the first and where time went back.
class RosRates {
 public:
  explicit RosRates(ClockSource clock) noexcept : clock_(clock) {}

  // Messages that were sent and can't be had.
  void skip(std::uint64_t messages) noexcept { next_sequence_ += messages; }

  std::optional<AngularRateSample> take(const RosImu& imu) noexcept {
    const std::uint64_t sequence = next_sequence_++;
    const auto time = sensor_time(imu.stamp);
    if (!time) return std::nullopt;
    AngularRateSample sample{.sequence = sequence,
                             .time = *time,
                             .rate_radps = imu.rate_radps,
                             .valid = measured_axes(imu),
                             .clock = clock_};
    if (previous_ && *time > *previous_)
      sample.interval_s = interval_.after(seconds(*time - *previous_));
    previous_ = time;
    return sample;
  }

 private:
  ClockSource clock_;
  std::uint64_t next_sequence_ = 0;
  std::optional<SensorTime> previous_{};
  SampleInterval interval_;
};

// The messages of one topic as the readings of one probe.
class RosTemperatures {
 public:
  RosTemperatures(std::string probe, ClockSource clock) : probe_(std::move(probe)), clock_(clock) {}

  // As RosRates. A reading that isn't finite was not measured.
  void skip(std::uint64_t messages) noexcept { next_sequence_ += messages; }
  std::optional<TemperatureSample> take(const RosTemperature& message) {
    const std::uint64_t sequence = next_sequence_++;
    const auto time = sensor_time(message.stamp);
    if (!time) return std::nullopt;
    return TemperatureSample{.probe = probe_,
                             .sequence = sequence,
                             .time = *time,
                             .temperature_degc = message.temperature_degc,
                             .measured = std::isfinite(message.temperature_degc),
                             .clock = clock_};
  }

 private:
  std::string probe_;
  ClockSource clock_;
  std::uint64_t next_sequence_ = 0;
};

}  // namespace zerodrift::core
