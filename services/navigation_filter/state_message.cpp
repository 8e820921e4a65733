// SPDX-License-Identifier: Apache-2.0
#include "services/navigation_filter/state_message.h"

#include <cmath>

#include "common/core/not_known.h"

namespace zerodrift::services {

using navigation::Stream;

namespace {

void fill_filter(const navigation::GyroNavigation& navigation, Stream stream,
                 navigation::BodyFrame frame, msg::NavigationState& message) {
  const navigation::AttitudeFilter& filter = navigation.filter(stream);
  const navigation::Vector6 variance = filter.covariance().diagonal();
  message.gyro_bias_radps(navigation::from_forward_right_down(filter.drift_radps(), frame));
  for (std::size_t i = 0; i < core::kAxisCount; ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    message.attitude_sigma_rad()[i] = std::sqrt(variance[row]);
    message.gyro_bias_sigma_radps()[i] = std::sqrt(variance[row + 3]);
  }
  message.updates(navigation.counts(stream).updates);
  message.rejected(navigation.counts(stream).rejected);
  const navigation::StreamErrors& errors = navigation.errors(stream);
  const bool is_judged = navigation.knows_truth() && errors.samples > 0;
  message.heading_error_rad(is_judged ? errors.heading_now : core::kNaN);
  message.attitude_error_rad(is_judged ? errors.angle_now : core::kNaN);
}

}  // namespace

msg::NavigationState to_message(const navigation::GyroNavigation& navigation, Stream stream,
                                std::uint32_t gyro_id, navigation::BodyFrame frame) {
  msg::NavigationState message;
  message.gyro_id(gyro_id);
  message.stream(static_cast<std::uint32_t>(stream));
  message.phase(static_cast<std::uint32_t>(navigation.phase()));
  message.at_rest(navigation.at_rest() ? 1 : 0);
  message.sensor_time_ns(navigation.time().count());
  message.sequence_number(navigation.sequence());
  const navigation::Quaternion& q = navigation.n_from_b(stream);
  message.attitude({q.w(), q.x(), q.y(), q.z()});
  const navigation::Attitude attitude = navigation.attitude(stream);
  message.heading_rad(attitude.heading_rad);
  message.roll_rad(attitude.roll_rad);
  message.pitch_rad(attitude.pitch_rad);
  message.rest_s(navigation.rest_s());
  message.references(navigation.counts().references);
  if (stream == Stream::kTruth) {
    message.heading_error_rad(0.0);
    message.attitude_error_rad(0.0);
  } else {
    fill_filter(navigation, stream, frame, message);
  }
  return message;
}

}  // namespace zerodrift::services
