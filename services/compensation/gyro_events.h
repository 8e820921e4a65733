// SPDX-License-Identifier: Apache-2.0
// What a gyro's stream did, told as events: each once, when it begins, or with its count.
#pragma once

#include <cstdint>
#include <string>

#include "common/compensation/compensator.h"
#include "common/service/host.h"
#include "common/service/instance_sync.h"

namespace zerodrift::services {

class Gyro;

class GyroEvents {
 public:
  GyroEvents(service::Host& host, std::uint32_t gyro_id, std::uint32_t instance)
      : host_(host), id_(gyro_id), instance_(instance) {}

  // Of the tick: all that is new.
  void tell(Gyro& gyro, std::int64_t now_ns);
  // What another instance counted is not told anew.
  void go_on_from(const compensation::CompensatorCounts& counts) noexcept { told_ = counts; }

  void raise(const char* code, service::Severity severity, const std::string& text,
             core::SensorTime at = core::SensorTime{0});

 private:
  void raise_counted(const char* code, std::string text, std::uint64_t before, std::uint64_t after,
                     core::SensorTime at);
  void tell_of_waiting(Gyro& gyro, std::int64_t now_ns);
  void tell_of_clocks(const Gyro& gyro);
  void tell_of_faults(const Gyro& gyro);
  void tell_of_modes(const Gyro& gyro);
  void tell_of_temperature(const Gyro& gyro);
  void tell_of_instances(const Gyro& gyro);

  service::Host& host_;
  std::uint32_t id_;
  std::uint32_t instance_;
  compensation::CompensatorCounts told_{};
  std::uint64_t told_rejected_ = 0;
  std::uint64_t told_dropped_ = 0;
  service::InstanceSync::Counts told_sync_{};
  std::int64_t told_waiting_since_ns_ = 0;
  bool told_clocks_ = false;
  bool told_hanging_ = false;
  core::PerAxis<core::Mode> told_mode_{};
  core::PerAxis<core::Reason> told_reason_{};
  core::Reason told_temperature_fault_ = core::Reason::kNone;
};

}  // namespace zerodrift::services
