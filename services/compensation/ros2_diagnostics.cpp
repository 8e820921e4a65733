// SPDX-License-Identifier: Apache-2.0
#include "services/compensation/ros2_diagnostics.h"

#include "common/service/monotonic_clock.h"

namespace zerodrift::services {
namespace {

// A tick comes four times a second, and not to the millisecond.
constexpr std::int64_t kPeriodNs = 950'000'000;

// Of an instance that is alone there is nobody to be behind.
service::InstanceSync::Health health_of(const Gyro& gyro) noexcept {
  using Health = service::InstanceSync::Health;
  if (gyro.hangs()) return Health::kHangs;
  const service::InstanceSync& sync = gyro.pipeline().sync();
  return sync.is_alone() ? Health::kInSync : sync.health();
}

// What was counted since `before`; all of it where another compensator goes on, which counts anew.
core::PerAxis<std::uint64_t> grown(const core::PerAxis<std::uint64_t>& before,
                                   const core::PerAxis<std::uint64_t>& now) noexcept {
  core::PerAxis<std::uint64_t> more{};
  for (std::size_t i = 0; i < core::kAxisCount; ++i)
    more[i] = now[i] >= before[i] ? now[i] - before[i] : now[i];
  return more;
}

}  // namespace

Ros2Diagnostics::Ros2Diagnostics(service::Host& host)
    : host_(host),
      writer_(host.participant(), host.observer()),
      status_reader_(
          host.participant(),
          [this](const msg::ServiceStatus& status, const dds::SampleOrigin& origin) {
            roster_.receive(status, origin.writer);
          },
          host.observer(),
          [this](const auto& writer, auto departure) { roster_.note_gone(writer, departure); }) {}

bool Ros2Diagnostics::is_due(std::int64_t now_ns) const noexcept {
  return now_ns - published_ns_ >= kPeriodNs;
}

void Ros2Diagnostics::look_at(const Gyro& gyro, std::int64_t now_ns) {
  const auto& invalid = gyro.compensator().counts().invalid_axes;
  auto& reported = reported_invalid_[gyro.id];
  seen_.push_back({.gyro_id = gyro.id,
                   .newest = gyro.newest(),
                   .measured = gyro.compensator().measured(),
                   .invalid = grown(reported, invalid),
                   .silence = gyro.silence(now_ns),
                   .health = health_of(gyro),
                   .temperature_degc = gyro.compensator().temperature_degc()});
  reported = invalid;
}

void Ros2Diagnostics::publish(std::int64_t now_ns) {
  published_ns_ = now_ns;
  std::vector<dds::RosStatus> statuses = roster_.statuses();
  for (const service::GyroFacts& gyro : seen_)
    statuses.push_back(service::status_of(gyro, host_.name()));
  seen_.clear();
  writer_.write(statuses, service::unix_time_ns());
}

}  // namespace zerodrift::services
