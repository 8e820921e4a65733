// SPDX-License-Identifier: Apache-2.0
// How discovery grows with the number of vehicles, by the way they find each other: measured with
// light vehicles (bench_fleet_vehicle.h) up to what this machine carries, the rest from the curve.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "services/zerodrift/bench_fleet_law.h"

namespace zerodrift::services {

enum class FleetScheme : std::uint8_t {
  kShared,             // one domain, everybody looks for everybody
  kSharedPartitions,   // and endpoints meet within their vehicle only
  kServers,            // one domain behind two discovery servers
  kServersPartitions,  // and endpoints meet within their vehicle only
  kDomains             // a domain a vehicle
};
struct FleetSchemeName {
  FleetScheme scheme;
  std::string_view name;
  std::string_view text;
};
inline constexpr std::array kFleetSchemes{
    FleetSchemeName{FleetScheme::kShared, "shared", "one domain, simple discovery"},
    FleetSchemeName{FleetScheme::kSharedPartitions, "shared-partitions",
                    "one domain, simple discovery, a partition a vehicle"},
    FleetSchemeName{FleetScheme::kServers, "servers", "one domain, two discovery servers"},
    FleetSchemeName{FleetScheme::kServersPartitions, "servers-partitions",
                    "one domain, two discovery servers, a partition a vehicle"},
    FleetSchemeName{FleetScheme::kDomains, "domains", "a domain a vehicle"}};
[[nodiscard]] std::string_view name_of(FleetScheme scheme);
[[nodiscard]] std::optional<FleetScheme> scheme_of(std::string_view name);

struct FleetVehiclesOptions {
  std::uint32_t domain = 0;
  std::vector<FleetScheme> schemes{};
  std::vector<std::uint32_t> vehicles{};  // ascending
  std::uint32_t repeats = 3;
  double give_up_s = 60.0;
  double largest_memory_gib = 8.0;
};

// Figures of one fleet, of all its processes and servers; of several runs the median of each.
struct FleetRun {
  std::uint32_t vehicles = 0;
  std::uint64_t matched = 0;  // pairs, as the writers count
  std::uint64_t matched_by_readers = 0;
  std::uint64_t expected = 0;             // by the law
  std::uint64_t expected_by_readers = 0;  // with what the servers write
  double match_s = 0.0;                   // from the first start to the last match
  double datagrams = 0.0;   // from the first start until nothing but announcements is left
  double unanswered = 0.0;  // of them: to ports where nobody is
  double bytes = 0.0;
  double cpu_s = 0.0;
  double idle_datagrams_per_s = 0.0;  // after it
  double idle_bytes_per_s = 0.0;
  double idle_cpu_percent = 0.0;  // of a core
  double resident_mib = 0.0;
  double servers_cpu_s = 0.0;  // of these: the discovery servers'
  double servers_resident_mib = 0.0;
  double load = 0.0;  // average of the last minute, before
  [[nodiscard]] bool is_complete() const noexcept {
    return matched == expected && matched_by_readers == expected_by_readers;
  }
};

// A figure that is extrapolated. The time to match isn't: here all vehicles share one machine.
struct FleetFigure {
  const char* name;     // in JSON
  const char* heading;  // in the table
  double FleetRun::*value;
  double scale;  // of the table
};
inline constexpr std::array kFleetFigures{
    FleetFigure{"datagrams", "datagrams", &FleetRun::datagrams, 1.0},
    FleetFigure{"bytes", "MB", &FleetRun::bytes, 1e-6},
    FleetFigure{"cpu_s", "CPU [s]", &FleetRun::cpu_s, 1.0},
    FleetFigure{"idle_datagrams_per_s", "dgrams/s", &FleetRun::idle_datagrams_per_s, 1.0},
    FleetFigure{"idle_bytes_per_s", "kB/s", &FleetRun::idle_bytes_per_s, 1e-3},
    FleetFigure{"idle_cpu_percent", "CPU [%]", &FleetRun::idle_cpu_percent, 1.0},
    FleetFigure{"resident_mib", "MiB", &FleetRun::resident_mib, 1.0}};

struct FleetOutcome {
  FleetScheme scheme = FleetScheme::kShared;
  std::vector<FleetRun> runs{};  // complete ones, one for each size
  std::optional<FleetRun> incomplete{};
  std::string why_no_further{};  // empty: all sizes were measured
};

// `done` after each size.
FleetOutcome measure_fleet(const FleetVehiclesOptions& options, FleetScheme scheme,
                           const std::function<void(const FleetRun&)>& done);

[[nodiscard]] std::uint64_t expected_pairs(FleetScheme scheme, std::uint32_t vehicles);
// And those of the servers' writers with the vehicles' readers.
[[nodiscard]] std::uint64_t expected_with_servers(FleetScheme scheme, std::uint32_t vehicles);
[[nodiscard]] std::vector<FleetPoint> points_of(const FleetOutcome& outcome,
                                                const FleetFigure& figure);

}  // namespace zerodrift::services
