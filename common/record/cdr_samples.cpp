// SPDX-License-Identifier: Apache-2.0
#include "common/record/cdr_samples.h"

#include <cmath>
#include <cstddef>

#include "common/record/cdr_reader.h"

namespace zerodrift::record {
namespace {

core::ClockSource clock_source(std::uint32_t number) noexcept {
  return number <= static_cast<std::uint32_t>(core::ClockSource::kSimulation)
             ? static_cast<core::ClockSource>(number)
             : core::ClockSource::kUnknown;
}

core::SensorTime take_time(CdrReader& reader) noexcept {
  return core::SensorTime{reader.take<std::int64_t>()};
}

// `take`: all behind the gyro's id.
template <typename Sample, typename Take>
std::optional<OfGyro<Sample>> decode(std::string_view payload, Take take) {
  CdrReader reader(payload);
  OfGyro<Sample> of;
  of.gyro_id = reader.take<std::uint32_t>();
  take(reader, of.sample);
  if (!reader.good()) return std::nullopt;
  return of;
}

}  // namespace

std::optional<OfGyro<core::AngularRateSample>> decode_angular_rate(
    std::string_view payload) noexcept {
  return decode<core::AngularRateSample>(payload, [](CdrReader& reader, auto& sample) {
    constexpr std::uint32_t kClippedShift = 8;
    const auto validity = reader.take<std::uint32_t>();
    sample.sequence = reader.take<std::uint64_t>();
    sample.time = take_time(reader);
    sample.rate_radps = reader.take_axes();
    reader.take_axes();  // delta angles: rate * interval
    const double interval_s = reader.take<double>();
    sample.interval_s = std::isfinite(interval_s) && interval_s > 0.0 ? interval_s : 0.0;
    sample.clock = clock_source(reader.take<std::uint32_t>());
    reader.take<std::uint32_t>();  // clock locked
    reader.take<std::int64_t>();   // clock offset
    reader.take<std::int64_t>();   // publish time
    for (std::size_t i = 0; i < core::kAxisCount; ++i) {
      sample.valid[i] = (validity >> i & 1U) != 0 && core::is_rate(sample.rate_radps[i]);
      sample.clipped[i] = (validity >> (kClippedShift + i) & 1U) != 0;
    }
  });
}

std::optional<OfGyro<core::TemperatureSample>> decode_temperature(std::string_view payload) {
  return decode<core::TemperatureSample>(payload, [](CdrReader& reader, auto& sample) {
    constexpr std::size_t kLongestProbe = 32;
    sample.probe = reader.take_text(kLongestProbe);
    sample.sequence = reader.take<std::uint64_t>();
    sample.time = take_time(reader);
    sample.temperature_degc = reader.take<double>();
    sample.measured = reader.take<std::uint32_t>() != 0;
    sample.clock = clock_source(reader.take<std::uint32_t>());
  });
}

std::optional<OfGyro<core::EnvironmentSample>> decode_environment(
    std::string_view payload) noexcept {
  return decode<core::EnvironmentSample>(payload, [](CdrReader& reader, auto& sample) {
    const auto channels = reader.take<std::uint32_t>();
    const auto measured = reader.take<std::uint32_t>();
    sample.clock = clock_source(reader.take<std::uint32_t>());
    sample.sequence = reader.take<std::uint64_t>();
    sample.time = take_time(reader);
    for (std::size_t i = 0; i < core::kEnvironmentChannels; ++i)
      core::channel(sample.values, i) = reader.take<double>();
    core::keep_measured(sample, channels, measured);
  });
}

std::optional<OfGyro<core::RateReferenceSample>> decode_rate_reference(
    std::string_view payload) noexcept {
  return decode<core::RateReferenceSample>(payload, [](CdrReader& reader, auto& sample) {
    const auto kind = reader.take<std::uint32_t>();
    sample.kind = kind <= static_cast<std::uint32_t>(core::ReferenceKind::kNavigationResidual)
                      ? static_cast<core::ReferenceKind>(kind)
                      : core::ReferenceKind::kNone;
    sample.time = take_time(reader);
    sample.model_epoch = reader.take<std::uint64_t>();
    sample.rate_radps = reader.take_axes();
    sample.variance = reader.take_axes();
    const auto validity = reader.take<std::uint32_t>();
    reader.take<std::uint32_t>();  // clock source
    for (std::size_t i = 0; i < core::kAxisCount; ++i) {
      sample.valid[i] = (validity >> i & 1U) != 0 && core::is_rate(sample.rate_radps[i]) &&
                        std::isfinite(sample.variance[i]) && sample.variance[i] >= 0.0;
    }
  });
}

}  // namespace zerodrift::record
