// SPDX-License-Identifier: Apache-2.0
// What the running system says of itself, gathered from its topics and shown as a table.
#pragma once

#include <array>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "common/core/axis.h"
#include "common/core/bounded_table.h"
#include "common/dds/participant.h"
#include "services/control/service_table.h"

namespace zerodrift::services {

class StatusBoard {
 public:
  explicit StatusBoard(dds::Participant& participant);

  // The table as text, one gyro after the other; empty before anything was received.
  [[nodiscard]] std::string table();
  // The same and more as one line of JSON.
  [[nodiscard]] std::string json();
  // The figures a run is judged by, as text.
  [[nodiscard]] std::string summary();
  // True once the gyro publisher has published its source to the end.
  [[nodiscard]] bool finished();
  // What moves until a run is over.
  struct Counts {
    // Each source has come to its end, or whoever published it is gone.
    bool nothing_more_comes = false;
    double published = 0.0;
    double answered = 0.0;
    double monitored = 0.0;
    bool operator==(const Counts&) const = default;
  };
  [[nodiscard]] Counts counts();
  // True if each published sample was answered exactly once and seen by the monitor.
  [[nodiscard]] bool nothing_lost();
  [[nodiscard]] double answered();  // samples
  [[nodiscard]] double sensor_time_s();
  [[nodiscard]] bool has(const std::string& service);  // or had it
  [[nodiscard]] bool has_compensation();               // any instance that is there
  // See ServiceTable.
  [[nodiscard]] std::vector<std::string> addressees(std::uint32_t gyro);
  [[nodiscard]] bool all_are_led();

 private:
  using ReportKey = std::tuple<std::uint32_t, std::uint32_t, std::uint32_t>;  // gyro, axis, stream

  using Guid = ServiceTable::Guid;

  void note(const msg::ServiceStatus& status, const Guid& writer);
  void note_gone(const Guid& writer);
  void note(const msg::AllanReport& report);
  void note(const msg::Event& event);
  [[nodiscard]] double metric(const std::string& service, const std::string& name,
                              double otherwise) const;
  [[nodiscard]] const msg::AllanReport* first_report(std::uint32_t gyro) const;
  [[nodiscard]] std::string means_of(std::uint32_t gyro) const;
  [[nodiscard]] std::string minute_heading(std::uint32_t gyro) const;
  [[nodiscard]] std::string gyro_table(std::uint32_t gyro) const;
  [[nodiscard]] std::string axis_row(std::uint32_t gyro, core::Axis axis) const;
  [[nodiscard]] std::string modes(std::uint32_t gyro) const;
  [[nodiscard]] std::string instances() const;
  [[nodiscard]] std::string departures() const;
  [[nodiscard]] std::string totals() const;
  // What a service says of one hop (common/service/hop_latency.h), and what it is called here.
  struct Hop {
    const char* service;  // of compensation its instance that leads
    const char* name;
    const char* heading;
  };
  static constexpr std::array kHops{Hop{"compensation", "sensor", "sensor to publisher"},
                                    Hop{"compensation", "arrival", "publisher to compensation"},
                                    Hop{"compensation", "compute", "in it (a replay waits there)"},
                                    Hop{"allan_monitor", "delivery", "compensation to monitor"},
                                    Hop{"allan_monitor", "chain", "publisher to monitor"}};
  // What the compensation says of a gyro: the name of that part of its status.
  [[nodiscard]] std::string part(std::uint32_t gyro) const;
  // How long ago a service said its last.
  [[nodiscard]] static double age_s(const ServiceTable::Service& service);
  // The point nearest to a minute; null where none is within a factor of 1.5.
  static const msg::AllanPoint* minute_point(const msg::AllanReport& report);
  [[nodiscard]] std::string gyro_json(std::uint32_t gyro) const;
  // Whose figures of the hop are shown; none: its service is gone, or has none.
  [[nodiscard]] std::optional<std::string> service_of_hop(const Hop& hop) const;
  [[nodiscard]] std::string hop_row(const Hop& hop) const;
  [[nodiscard]] std::string hops() const;
  // Statuses: publishers of several gyros share a name, and are told apart by what each says of its
  // gyro.
  [[nodiscard]] bool is_shown(const std::string& of, const std::string& suffix) const;
  [[nodiscard]] double published() const;  // of all gyros, as the compensation counts them
  [[nodiscard]] std::vector<std::string> publishers() const;
  [[nodiscard]] bool has_come_to_its_end(const std::string& publisher) const;
  [[nodiscard]] std::vector<std::string> short_of_their_end() const;  // publishers
  [[nodiscard]] bool all_sources_ended() const;
  [[nodiscard]] bool nothing_more_comes() const;
  [[nodiscard]] bool all_answered() const;

  std::mutex mutex_;
  ServiceTable services_;
  core::BoundedTable<ReportKey, msg::AllanReport> reports_{768};  // 128 gyros
  std::vector<std::string> events_;                               // the newest few
  dds::Reader<msg::ServiceStatus> status_reader_;
  dds::Reader<msg::AllanReport> report_reader_;
  dds::Reader<msg::Event> event_reader_;
};

}  // namespace zerodrift::services
