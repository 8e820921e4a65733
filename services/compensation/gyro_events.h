// SPDX-License-Identifier: Apache-2.0
// What a gyro's stream did, reported as events: each once, when it begins, or with its count.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

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
  void report(Gyro& gyro, std::int64_t now_ns);
  // What another instance counted is not reported anew.
  void go_on_from(const compensation::Compensator& compensator);

  void raise(const char* code, service::Severity severity, const std::string& text,
             core::SensorTime at = core::SensorTime{0});

  // Why rates wait, where they have for long; empty: they don't. As of the last report().
  [[nodiscard]] const char* waiting() const noexcept { return waiting_; }

 private:
  // What all events of this gyro share.
  [[nodiscard]] service::Occurrence occurrence(core::SensorTime at) const;
  void raise_counted(const std::string& code, std::string_view text, std::uint64_t before,
                     std::uint64_t after, core::SensorTime at, const std::string& subject = {});
  void report_waiting(Gyro& gyro, std::int64_t now_ns);
  void report_clocks(const Gyro& gyro);
  void report_faults(const Gyro& gyro);
  void report_refused_temperatures(const Gyro& gyro);
  void report_second_publishers(const Gyro& gyro);
  void report_modes(const Gyro& gyro);
  void report_temperature(const Gyro& gyro);
  void report_instances(const Gyro& gyro);

  service::Host& host_;
  std::uint32_t id_;
  std::uint32_t instance_;
  compensation::CompensatorCounts reported_{};
  std::uint64_t reported_rejected_ = 0;
  std::vector<std::uint64_t> reported_temperatures_rejected_{};                 // by probe
  std::array<std::uint64_t, 3> reported_references_rejected_{};                 // by place
  std::vector<compensation::RefusedReadings> reported_temperatures_refused_{};  // by probe
  std::uint64_t reported_dropped_ = 0;
  service::InstanceSync::Counts reported_sync_{};
  std::int64_t reported_waiting_since_ns_ = 0;
  const char* waiting_ = "";
  bool reported_clocks_ = false;
  bool reported_hanging_ = false;
  core::PerAxis<core::Mode> reported_mode_{};
  core::PerAxis<core::Reason> reported_reason_{};
  core::Reason reported_temperature_fault_ = core::Reason::kNone;
};

}  // namespace zerodrift::services
