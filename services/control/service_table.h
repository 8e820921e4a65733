// SPDX-License-Identifier: Apache-2.0
// The newest status of each service, whether it is still there, and which instance of the
// compensation speaks for a gyro. One thread; time is nanoseconds of the host's monotonic clock.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/bounded_table.h"
#include "common/dds/participant.h"
#include "common/dds/topics.h"
#include "common/service/status_writers.h"

namespace zerodrift::services {

// "compensation/2:1" is a status of the service "compensation/2".
std::string_view service_of(std::string_view status) noexcept;

class ServiceTable {
 public:
  using Metrics = std::map<std::string, double>;
  using Guid = eprosima::fastrtps::rtps::GUID_t;
  struct Service {
    Metrics metrics{};
    bool is_alive = true;
    bool ended_in_order = false;
    std::int64_t said_ns = 0;
  };

  void note(const msg::ServiceStatus& status, const Guid& writer, std::int64_t now_ns);
  // The writer fell silent or left: so did what it spoke for, where no other writer speaks for it.
  void note_gone(const Guid& writer);

  // By name; those that are gone too, with what they said last.
  [[nodiscard]] const std::map<std::string, Service>& entries() const noexcept {
    return services_.entries();
  }
  [[nodiscard]] const Service* find(const std::string& name) const;
  [[nodiscard]] double metric(const std::string& name, const std::string& metric,
                              double otherwise) const;

  // Ids of the gyros that a compensation speaks of, in ascending order.
  [[nodiscard]] std::vector<std::uint32_t> gyros() const;
  // The instance whose figures are those of the gyro: the one that leads, of several that say so
  // the lowest; else one that is there, else the one that was there last. Empty: none.
  [[nodiscard]] std::string compensation_of(std::uint32_t gyro) const;
  // The same for what an instance counts of all gyros together.
  [[nodiscard]] std::string compensation() const;
  [[nodiscard]] bool has_compensation() const;  // that is there
  // Who takes a command for a gyro, or for all (0): the instances that lead; none: the lowest that
  // is there.
  [[nodiscard]] std::vector<std::string> addressees(std::uint32_t gyro) const;
  // An instance has spoken of all its gyros, and each gyro has one that leads.
  [[nodiscard]] bool all_are_led() const;

 private:
  [[nodiscard]] std::vector<std::string> instances() const;  // lower numbers first
  [[nodiscard]] std::optional<std::string> leader_of(std::uint32_t gyro) const;
  [[nodiscard]] bool is_there(const std::string& name) const;
  // Of some services' statuses the one to believe where nobody leads; empty: there is none.
  [[nodiscard]] std::string first_there_or_last_gone(const std::string& part) const;

  core::BoundedTable<std::string, Service> services_{
      static_cast<std::size_t>(dds::kServiceStatus.keys)};
  service::StatusWriters<Guid> writers_;
};

}  // namespace zerodrift::services
