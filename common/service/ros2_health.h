// SPDX-License-Identifier: Apache-2.0
// What is reported of gyros and services on ROS 2's /diagnostics: a level and one line. Time is an
// argument, nanoseconds of the host's monotonic clock.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "common/core/compensated_sample.h"
#include "common/dds/ros2_diagnostics.h"
#include "common/service/host.h"
#include "common/service/instance_sync.h"

namespace zerodrift::service {

// One gyro as its newest answer has it, and what the answers before it had.
struct GyroFacts {
  std::uint32_t gyro_id = 0;
  core::CompensatedSample newest{};
  core::PerAxis<bool> measured{};          // whether a sample of the axis was ever valid
  core::PerAxis<std::uint64_t> invalid{};  // samples of the axis since the report before
  std::chrono::nanoseconds silence{0};     // since the newest sample came
  InstanceSync::Health health = InstanceSync::Health::kInSync;
  double temperature_degc = 0.0;
};

// A gyro that says nothing for 2 s, or three of its samples where that is longer, is silent.
[[nodiscard]] bool is_silent(std::chrono::nanoseconds silence, double interval_s) noexcept;

// The level is that of the worst axis: an error where nothing can be relied on (an invalid
// sample since the report before, a reversed axis, nothing taken off for a reason that does not
// pass), a warning where somebody ought to look, OK for what passes by itself and for what was
// commanded. A gyro that is silent is stale. `service`: who tells it.
[[nodiscard]] dds::RosStatus status_of(const GyroFacts& gyro, const std::string& service);

// The services whose status was received, each with its newest. Several of one name, as the
// publishers of several gyros are, have one status, that of the worst. Any thread.
class ServiceRoster {
 public:
  using Guid = eprosima::fastrtps::rtps::GUID_t;

  // What a service says of one of its gyros is left out.
  void receive(const msg::ServiceStatus& status, const Guid& writer);
  // One that ended in order is forgotten; one that died, or fell silent, stays until it reports
  // again, or a new one of its name is.
  void note_gone(const Guid& writer, dds::Departure departure);
  // In the order of their names.
  [[nodiscard]] std::vector<dds::RosStatus> statuses() const;

 private:
  enum class Presence : std::uint8_t { kHere, kSilent, kDied };
  struct Entry {
    std::string name{};
    Presence presence = Presence::kHere;
    State state = State::kStarting;
    std::string host{};
    std::string summary{};
    std::uint32_t process_id = 0;
  };
  [[nodiscard]] static dds::RosStatus status_of(const Entry& entry);

  mutable std::mutex mutex_;  // held for a look-up and a copy
  std::map<Guid, Entry> entries_;
};

}  // namespace zerodrift::service
