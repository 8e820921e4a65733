// SPDX-License-Identifier: Apache-2.0
#include "common/dds/ros2_imu.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <stdexcept>
#include <utility>

namespace zerodrift::dds {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr std::size_t kLongestName = 200;
constexpr std::array<double, 9> kAbsent{-1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0};

const RosImuOptions& valid(const RosImuOptions& options) {
  if (const auto problem = options.validate()) throw std::invalid_argument(*problem);
  return options;
}

TopicSpec spec_of(const std::string& topic) {
  TopicSpec spec = kRos2Imu;
  spec.name = topic;
  return spec;
}

bool is_valid(const msg::CompensatedRate& sample, std::size_t axis) noexcept {
  return (sample.validity() >> axis & 1U) != 0;
}

double sign_of(std::size_t axis, RosFrame frame) noexcept {
  return frame == RosFrame::kYAndZReversed && axis > 0 ? -1.0 : 1.0;
}

std::array<double, 9> covariance_of(const msg::CompensatedRate& sample, RosFrame frame) noexcept {
  const auto& measured = sample.rate_covariance_radps2();
  std::array<double, 9> covariance{};
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t column = 0; column < 3; ++column) {
      const std::size_t i = 3 * row + column;
      const bool known = measured[0] >= 0.0 && is_valid(sample, row) && is_valid(sample, column);
      if (known) covariance[i] = sign_of(row, frame) * sign_of(column, frame) * measured[i];
    }
    if (!is_valid(sample, row)) covariance[4 * row] = core::kRosNotMeasuredVariance;
  }
  return covariance;
}

}  // namespace

builtin_interfaces::msg::dds_::Time_ stamp_of(std::int64_t time_ns) noexcept {
  const std::int64_t rest = (time_ns % kSecond + kSecond) % kSecond;
  builtin_interfaces::msg::dds_::Time_ stamp;
  stamp.sec_(static_cast<std::int32_t>((time_ns - rest) / kSecond));
  stamp.nanosec_(static_cast<std::uint32_t>(rest));
  return stamp;
}

bool is_relative_ros_name(std::string_view name) noexcept {
  char before = '/';
  bool good = !name.empty() && name.size() <= kLongestName && name.back() != '/';
  for (const char c : name) {
    const auto byte = static_cast<unsigned char>(c);
    const bool begins = before == '/';
    good = good && (std::isalpha(byte) != 0 || c == '_' ||
                    (!begins && (std::isdigit(byte) != 0 || c == '/')));
    before = c;
  }
  return good;
}

std::optional<std::string> RosImuOptions::validate() const {
  if (is_relative_ros_name(name)) return std::nullopt;
  return "--ros2-imu: found the topic '" + name +
         "', expected a relative ROS 2 topic name such as imu/data";
}

void to_ros_imu(const msg::CompensatedRate& sample, RosFrame frame,
                sensor_msgs::msg::dds_::Imu_& imu) noexcept {
  imu.header_().stamp_() = stamp_of(sample.sensor_time_ns());
  core::PerAxis<double> rate{};
  for (std::size_t i = 0; i < 3; ++i) {
    if (is_valid(sample, i)) rate[i] = sign_of(i, frame) * sample.rate_radps()[i];
  }
  imu.angular_velocity_().x_(rate[0]);
  imu.angular_velocity_().y_(rate[1]);
  imu.angular_velocity_().z_(rate[2]);
  imu.angular_velocity_covariance_() = covariance_of(sample, frame);
}

RosImuWriter::RosImuWriter(Participant& participant, const RosImuOptions& options,
                           std::uint32_t gyro_id, EndpointObserver observer)
    : frame_(options.frame),
      topic_("rt/" + valid(options).name),
      spec_(spec_of(topic_)),
      writer_(participant, spec_, std::move(observer)) {
  imu_.header_().frame_id_(options.frame_id.empty() ? "gyro_" + std::to_string(gyro_id)
                                                    : options.frame_id);
  imu_.orientation_().w_(1.0);
  imu_.orientation_covariance_() = kAbsent;
  imu_.linear_acceleration_covariance_() = kAbsent;
}

bool RosImuWriter::write(const msg::CompensatedRate& sample) noexcept {
  to_ros_imu(sample, frame_, imu_);
  return writer_.write(imu_);
}

}  // namespace zerodrift::dds
