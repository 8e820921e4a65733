// SPDX-License-Identifier: Apache-2.0
#include "common/dds/conversions.h"

#include <cmath>

namespace zerodrift::dds {

using core::index;
using core::kAxes;

namespace {

constexpr std::uint32_t kClippedShift = 8;
constexpr std::uint32_t kBodyFrame = 1;

std::uint32_t validity_bits(const core::PerAxis<bool>& valid,
                            const core::PerAxis<bool>& clipped) noexcept {
  std::uint32_t bits = 0;
  for (const auto axis : kAxes) {
    const auto i = static_cast<std::uint32_t>(index(axis));
    if (valid[i]) bits |= 1U << i;
    if (clipped[i]) bits |= 1U << (kClippedShift + i);
  }
  return bits;
}

void read_validity(std::uint32_t bits, core::AngularRateSample& sample) noexcept {
  for (const auto axis : kAxes) {
    const auto i = static_cast<std::uint32_t>(index(axis));
    sample.valid[i] = (bits >> i & 1U) != 0 && core::is_rate(sample.rate_radps[i]);
    sample.clipped[i] = (bits >> (kClippedShift + i) & 1U) != 0;
  }
}

core::ClockSource clock_source(std::uint32_t number) noexcept {
  return number <= static_cast<std::uint32_t>(core::ClockSource::kSimulation)
             ? static_cast<core::ClockSource>(number)
             : core::ClockSource::kUnknown;
}

double usable_interval(double interval_s) noexcept {
  return std::isfinite(interval_s) && interval_s > 0.0 ? interval_s : 0.0;
}

}  // namespace

msg::AngularRate to_message(const core::AngularRateSample& sample, std::uint32_t gyro_id,
                            std::int64_t publish_time_ns) {
  msg::AngularRate message;
  message.gyro_id(gyro_id);
  message.validity(validity_bits(sample.valid, sample.clipped));
  message.sequence_number(sample.sequence);
  message.sensor_time_ns(sample.time.count());
  for (const auto axis : kAxes) {
    const std::size_t i = index(axis);
    message.rate_radps()[i] = sample.rate_radps[i];
    message.delta_angle_rad()[i] = sample.rate_radps[i] * sample.interval_s;
  }
  message.interval_s(sample.interval_s);
  message.clock_source(static_cast<std::uint32_t>(sample.clock));
  message.clock_locked(0);
  message.clock_offset_ns(0);
  message.publish_time_ns(publish_time_ns);
  return message;
}

core::AngularRateSample from_message(const msg::AngularRate& message) noexcept {
  core::AngularRateSample sample;
  sample.sequence = message.sequence_number();
  sample.time = core::SensorTime{message.sensor_time_ns()};
  sample.interval_s = usable_interval(message.interval_s());
  sample.rate_radps = message.rate_radps();
  sample.clock = clock_source(message.clock_source());
  read_validity(message.validity(), sample);
  return sample;
}

msg::Temperature to_message(const core::TemperatureSample& sample, std::uint32_t gyro_id) {
  msg::Temperature message;
  message.gyro_id(gyro_id);
  message.probe(sample.probe.c_str());
  message.sequence_number(sample.sequence);
  message.sensor_time_ns(sample.time.count());
  message.temperature_degc(sample.temperature_degc);
  message.measured(sample.measured ? 1 : 0);
  message.clock_source(static_cast<std::uint32_t>(sample.clock));
  return message;
}

core::TemperatureSample from_message(const msg::Temperature& message) {
  core::TemperatureSample sample;
  sample.probe = message.probe().c_str();
  sample.sequence = message.sequence_number();
  sample.time = core::SensorTime{message.sensor_time_ns()};
  sample.temperature_degc = message.temperature_degc();
  sample.measured = message.measured() != 0;
  sample.clock = clock_source(message.clock_source());
  return sample;
}

msg::Environment to_message(const core::EnvironmentSample& sample, std::uint32_t gyro_id) {
  msg::Environment message;
  message.gyro_id(gyro_id);
  message.channels(sample.channels);
  message.clock_source(static_cast<std::uint32_t>(sample.clock));
  message.sequence_number(sample.sequence);
  message.sensor_time_ns(sample.time.count());
  for (std::size_t i = 0; i < core::kEnvironmentChannels; ++i) {
    if (core::has_channel(sample.channels, i) && std::isfinite(core::channel(sample.values, i)))
      message.measured(message.measured() | 1U << i);
  }
  message.magnetic_ut(sample.values.magnetic_ut);
  message.acceleration_mps2(sample.values.acceleration_mps2);
  message.vibration_g(sample.values.vibration_g);
  message.source_current_ma(sample.values.source_current_ma);
  message.supply_v(sample.values.supply_v);
  return message;
}

core::EnvironmentSample from_message(const msg::Environment& message) noexcept {
  core::EnvironmentSample sample;
  sample.sequence = message.sequence_number();
  sample.time = core::SensorTime{message.sensor_time_ns()};
  sample.values = {message.magnetic_ut(), message.acceleration_mps2(), message.vibration_g(),
                   message.source_current_ma(), message.supply_v()};
  core::keep_measured(sample, message.channels(), message.measured());
  sample.clock = clock_source(message.clock_source());
  return sample;
}

msg::RateReference to_message(const core::RateReferenceSample& sample, std::uint32_t gyro_id) {
  msg::RateReference message;
  message.gyro_id(gyro_id);
  message.kind(static_cast<std::uint32_t>(sample.kind));
  message.sensor_time_ns(sample.time.count());
  message.model_epoch(sample.model_epoch);
  message.rate_radps(sample.rate_radps);
  message.variance_radps2(sample.variance);
  message.validity(validity_bits(sample.valid, {}));
  message.clock_source(static_cast<std::uint32_t>(core::ClockSource::kUnknown));
  return message;
}

core::RateReferenceSample from_message(const msg::RateReference& message) noexcept {
  core::RateReferenceSample sample;
  sample.kind =
      message.kind() <= static_cast<std::uint32_t>(core::ReferenceKind::kNavigationResidual)
          ? static_cast<core::ReferenceKind>(message.kind())
          : core::ReferenceKind::kNone;
  sample.time = core::SensorTime{message.sensor_time_ns()};
  sample.model_epoch = message.model_epoch();
  for (const auto axis : kAxes) {
    const std::size_t i = index(axis);
    sample.rate_radps[i] = message.rate_radps()[i];
    sample.variance[i] = message.variance_radps2()[i];
    sample.valid[i] = (message.validity() >> i & 1U) != 0 && core::is_rate(sample.rate_radps[i]) &&
                      std::isfinite(sample.variance[i]) && sample.variance[i] >= 0.0;
  }
  return sample;
}

void to_message(const core::CompensatedSample& sample, std::uint32_t gyro_id,
                std::uint32_t instance, msg::CompensatedRate& message) noexcept {
  const core::AngularRateSample& raw = sample.raw;
  message.gyro_id(gyro_id);
  message.validity(validity_bits(raw.valid, raw.clipped));
  message.sequence_number(raw.sequence);
  message.sensor_time_ns(raw.time.count());
  message.interval_s(raw.interval_s);
  message.rate_radps(sample.rate_radps);
  message.applied_drift_radps(sample.applied_drift_radps);
  message.drift_variance_radps2(sample.drift_variance);
  message.rate_covariance_radps2().fill(0.0);
  bool known = true;
  for (const auto axis : kAxes) {
    const std::size_t i = index(axis);
    message.delta_angle_rad()[i] = sample.rate_radps[i] * raw.interval_s;
    const bool axis_known = sample.sensor_variance[i] >= 0.0 && sample.drift_variance[i] >= 0.0;
    if (raw.valid[i]) {  // -1 of an axis x that is not valid would say that all is unknown
      message.rate_covariance_radps2()[4 * i] =
          axis_known ? sample.sensor_variance[i] + sample.drift_variance[i] : -1.0;
      known = known && axis_known;
    }
    message.mode()[i] = static_cast<std::uint8_t>(sample.mode[i]);
    message.reason()[i] = static_cast<std::uint8_t>(sample.reason[i]);
    message.rung()[i] = static_cast<std::uint8_t>(sample.rung[i]);
  }
  if (!known) message.rate_covariance_radps2()[0] = -1.0;
  message.model_epoch(sample.model_epoch);
  message.order(sample.late ? 1 : 0);
  message.frame(kBodyFrame);
  message.clock_source(static_cast<std::uint32_t>(raw.clock));
  message.clock_locked(0);
  message.clock_offset_ns(0);
  message.instance(instance);
  message.publish_time_ns(sample.publish_time_ns);
  message.ingress_time_ns(sample.ingress_time_ns);
}

core::CompensatedSample from_message(const msg::CompensatedRate& message) noexcept {
  core::CompensatedSample sample;
  sample.raw.sequence = message.sequence_number();
  sample.raw.time = core::SensorTime{message.sensor_time_ns()};
  sample.raw.interval_s = usable_interval(message.interval_s());
  sample.raw.clock = clock_source(message.clock_source());
  sample.rate_radps = message.rate_radps();
  sample.applied_drift_radps = message.applied_drift_radps();
  sample.drift_variance = message.drift_variance_radps2();
  for (const auto axis : kAxes) {
    const std::size_t i = index(axis);
    sample.raw.rate_radps[i] = sample.rate_radps[i] + sample.applied_drift_radps[i];
    sample.mode[i] = static_cast<core::Mode>(message.mode()[i]);
    sample.reason[i] = static_cast<core::Reason>(message.reason()[i]);
    sample.rung[i] = static_cast<core::Rung>(message.rung()[i]);
    sample.sensor_variance[i] = -1.0;
  }
  read_validity(message.validity(), sample.raw);
  sample.model_epoch = message.model_epoch();
  sample.late = message.order() != 0;
  sample.publish_time_ns = message.publish_time_ns();
  sample.ingress_time_ns = message.ingress_time_ns();
  return sample;
}

}  // namespace zerodrift::dds
