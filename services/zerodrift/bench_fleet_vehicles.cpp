// SPDX-License-Identifier: Apache-2.0
#include "services/zerodrift/bench_fleet_vehicles.h"

#include <time.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <thread>

#include "common/service/host.h"
#include "common/service/monotonic_clock.h"
#include "services/zerodrift/bench_fleet_network.h"
#include "services/zerodrift/bench_process.h"

namespace zerodrift::services {
namespace {

using namespace std::chrono_literals;

constexpr auto kWindow = 2000ms;  // the participants' announcement period (common/dds)
constexpr int kMostWindows = 12;
constexpr double kSameWithin = 0.1;  // of a window's datagrams
constexpr auto kServersStart = 500ms;
constexpr auto kAnswerWithin = 5000ms;  // beside what it was asked to wait
constexpr std::uint32_t kLargestDomain = 232;
// Simple discovery looks for so many participants of a domain on each address (common/dds).
constexpr std::uint32_t kParticipantsPerAddress = 40;
// Ports of one domain on one address (RTPS 2.2, 9.6.1.1: 250 apart, two a participant).
constexpr std::uint32_t kPortsPerAddress = 120;
constexpr double kNsPerS = 1e9;
constexpr double kKibPerMib = 1024.0;
constexpr std::size_t kServers = 2;
constexpr const char* kServerPorts[kServers] = {"11811", "11812"};

using Arguments = std::vector<std::string>;

bool has_servers(FleetScheme scheme) {
  return scheme == FleetScheme::kServers || scheme == FleetScheme::kServersPartitions;
}

bool is_partitioned(FleetScheme scheme) {
  return scheme == FleetScheme::kSharedPartitions || scheme == FleetScheme::kServersPartitions;
}

struct Usage {
  double cpu_s = 0.0;
  double resident_mib = 0.0;
};

// To the nanosecond: an idle vehicle uses less in a window than /proc/PID/stat counts.
double cpu_s_of(pid_t process) {
  clockid_t clock{};
  timespec used{};
  if (clock_getcpuclockid(process, &clock) != 0 || clock_gettime(clock, &used) != 0)
    throw std::runtime_error("bench fleet: a vehicle or server has ended before its time");
  return static_cast<double>(used.tv_sec) + static_cast<double>(used.tv_nsec) / kNsPerS;
}

class Fleet {
 public:
  Fleet(const FleetVehiclesOptions& options, FleetScheme scheme, std::uint32_t vehicles)
      : options_(options), scheme_(scheme), count_(vehicles) {
    result_.vehicles = vehicles;
    result_.expected = expected_pairs(scheme, vehicles);
    result_.expected_by_readers = result_.expected + expected_with_servers(scheme, vehicles);
    result_.load = load_average();
  }

  FleetRun run() {
    before_ = network_counts();
    start();
    match();
    if (result_.is_complete()) settle();
    return result_;
  }

 private:
  void start() {
    if (has_servers(scheme_)) {
      for (std::size_t server = 0; server < kServers; ++server) start_server(server);
      std::this_thread::sleep_for(kServersStart);
    }
    started_ns_ = service::monotonic_ns();
    for (std::uint32_t vehicle = 1; vehicle <= count_; ++vehicle) start_vehicle(vehicle);
  }

  [[nodiscard]] Arguments server_list() const {
    Arguments list;
    for (const char* port : kServerPorts)
      list.insert(list.end(), {"--discovery-server", std::string("127.0.0.1:") + port});
    return list;
  }

  void start_server(std::size_t server) {
    Arguments arguments = server_list();
    arguments.insert(arguments.end(),
                     {"--id", std::to_string(server), "--domain", std::to_string(options_.domain)});
    servers_.push_back(std::make_unique<BenchProcess>("discovery_server", std::move(arguments),
                                                      BenchProcess::Streams::kQuiet));
  }

  void start_vehicle(std::uint32_t vehicle) {
    const bool has_own_domain = scheme_ == FleetScheme::kDomains;
    Arguments arguments{
        "bench",     "fleet-vehicle",
        "--vehicle", std::to_string(vehicle),
        "--domain",  std::to_string(options_.domain + (has_own_domain ? vehicle - 1 : 0))};
    if (is_partitioned(scheme_)) arguments.emplace_back("--partitioned");
    if (has_servers(scheme_)) {
      const Arguments list = server_list();
      arguments.insert(arguments.end(), list.begin(), list.end());
    }
    vehicles_.push_back(std::make_unique<BenchProcess>("zerodrift", std::move(arguments),
                                                       BenchProcess::Streams::kTalks));
  }

  [[nodiscard]] std::chrono::milliseconds time_left() const {
    const std::int64_t used_ms = (service::monotonic_ns() - started_ns_) / 1'000'000;
    const auto allowed_ms = static_cast<std::int64_t>(1000.0 * options_.give_up_s);
    return std::chrono::milliseconds(std::max<std::int64_t>(allowed_ms - used_ms, 1));
  }

  void match() {
    for (auto& vehicle : vehicles_) vehicle->hear(time_left() + kAnswerWithin);  // "made"
    const std::string order = "await " + std::to_string(result_.expected / count_) + ' ' +
                              std::to_string(result_.expected_by_readers / count_) + ' ' +
                              std::to_string(time_left().count());
    for (auto& vehicle : vehicles_) vehicle->say(order);
    std::int64_t last_ns = started_ns_;
    for (auto& vehicle : vehicles_) {
      std::istringstream answer(vehicle->hear(time_left() + kAnswerWithin));
      std::string verdict;
      std::int64_t at_ns = 0;
      if (answer >> verdict >> at_ns) last_ns = std::max(last_ns, at_ns);
    }
    result_.match_s = static_cast<double>(last_ns - started_ns_) / kNsPerS;
    count_matches();
  }

  void count_matches() {
    result_.matched = 0;
    result_.matched_by_readers = 0;
    for (auto& vehicle : vehicles_) {
      vehicle->say("matched");
      std::istringstream answer(vehicle->hear(kAnswerWithin));
      std::uint64_t by_writers = 0;
      std::uint64_t by_readers = 0;
      answer >> by_writers >> by_readers;
      result_.matched += by_writers;
      result_.matched_by_readers += by_readers;
    }
  }

  [[nodiscard]] static Usage usage_of(const std::vector<std::unique_ptr<BenchProcess>>& processes) {
    Usage sum;
    for (const auto& process : processes) {
      sum.cpu_s += cpu_s_of(process->pid());
      sum.resident_mib += static_cast<double>(process->usage().resident_kb) / kKibPerMib;
    }
    return sum;
  }

  struct Look {
    NetworkCounts network{};
    double cpu_s = 0.0;
    double servers_cpu_s = 0.0;
    std::int64_t at_ns = 0;
  };
  [[nodiscard]] Look look() const {
    const double servers_s = usage_of(servers_).cpu_s;
    return {network_counts(), usage_of(vehicles_).cpu_s + servers_s, servers_s,
            service::monotonic_ns()};
  }

  // Discovery is over where two announcement periods have as many datagrams as each other; what
  // came before them is its cost, the second one is what stays.
  void settle() {
    std::vector<Look> looks{look()};
    double last = std::nan("");
    for (int window = 0; window < kMostWindows; ++window) {
      if (service::wait_for_stop(kWindow)) throw std::runtime_error("bench fleet: stopped");
      looks.push_back(look());
      const auto& [from, to] = std::pair(looks[looks.size() - 2], looks.back());
      const double datagrams = static_cast<double>((to.network - from.network).datagrams);
      const bool is_quiet = std::abs(datagrams - last) <= kSameWithin * datagrams;
      last = datagrams;
      if (is_quiet) break;
    }
    note(looks[looks.size() >= 3 ? looks.size() - 3 : 0], looks[looks.size() - 2], looks.back());
    count_matches();
  }

  void note(const Look& discovered, const Look& from, const Look& to) {
    const NetworkCounts discovery = discovered.network - before_;
    result_.datagrams = static_cast<double>(discovery.datagrams);
    result_.unanswered = static_cast<double>(discovery.unanswered);
    result_.bytes = static_cast<double>(discovery.bytes);
    result_.cpu_s = discovered.cpu_s;
    result_.servers_cpu_s = discovered.servers_cpu_s;
    const NetworkCounts idle = to.network - from.network;
    const double window_s = static_cast<double>(to.at_ns - from.at_ns) / kNsPerS;
    result_.idle_datagrams_per_s = static_cast<double>(idle.datagrams) / window_s;
    result_.idle_bytes_per_s = static_cast<double>(idle.bytes) / window_s;
    result_.idle_cpu_percent = 100.0 * (to.cpu_s - from.cpu_s) / window_s;
    result_.servers_resident_mib = usage_of(servers_).resident_mib;
    result_.resident_mib = usage_of(vehicles_).resident_mib + result_.servers_resident_mib;
  }

  const FleetVehiclesOptions& options_;
  FleetScheme scheme_;
  std::uint32_t count_;
  FleetRun result_;
  NetworkCounts before_;
  std::int64_t started_ns_ = 0;
  std::vector<std::unique_ptr<BenchProcess>> servers_;
  std::vector<std::unique_ptr<BenchProcess>> vehicles_;  // end before the servers
};

FleetRun median_of_runs(const std::vector<FleetRun>& runs) {
  if (runs.empty()) return {};
  FleetRun median = runs[0];
  for (auto value :
       {&FleetRun::match_s, &FleetRun::datagrams, &FleetRun::unanswered, &FleetRun::bytes,
        &FleetRun::cpu_s, &FleetRun::idle_datagrams_per_s, &FleetRun::idle_bytes_per_s,
        &FleetRun::idle_cpu_percent, &FleetRun::resident_mib, &FleetRun::servers_cpu_s,
        &FleetRun::servers_resident_mib, &FleetRun::load}) {
    std::vector<double> values;
    for (const FleetRun& run : runs) values.push_back(run.*value);
    median.*value = median_of(std::move(values));
  }
  return median;
}

// Why a fleet of this size can't be on this machine; empty: it can.
std::string obstacle(const FleetVehiclesOptions& options, FleetScheme scheme,
                     std::uint32_t vehicles, const FleetRun* before) {
  const std::uint64_t participants = vehicles * count_of_vehicle().participants;
  if (scheme == FleetScheme::kDomains) {
    if (options.domain + vehicles - 1 > kLargestDomain)
      return "there is no domain beyond " + std::to_string(kLargestDomain);
  } else if (participants > kPortsPerAddress) {
    return std::to_string(participants) + " participants at one address, " +
           std::to_string(kPortsPerAddress) + " find ports in a domain";
  } else if (!has_servers(scheme) && participants > kParticipantsPerAddress) {
    return std::to_string(participants) +
           " participants at one address, simple discovery looks for " +
           std::to_string(kParticipantsPerAddress);
  }
  if (before == nullptr) return "";
  const double factor = static_cast<double>(vehicles) / before->vehicles;
  const double memory_gib = before->resident_mib * factor * factor / 1024.0;
  const double allowed_gib = std::min(options.largest_memory_gib, 0.5 * available_memory_gib());
  if (memory_gib > allowed_gib) {
    return "it may take " + std::to_string(static_cast<int>(memory_gib)) + " GiB of memory";
  }
  return "";
}

}  // namespace

std::string_view name_of(FleetScheme scheme) {
  const auto found = std::find_if(kFleetSchemes.begin(), kFleetSchemes.end(),
                                  [&](const auto& known) { return known.scheme == scheme; });
  return found->name;
}

std::optional<FleetScheme> scheme_of(std::string_view name) {
  for (const auto& known : kFleetSchemes) {
    if (known.name == name) return known.scheme;
  }
  return std::nullopt;
}

std::uint64_t expected_pairs(FleetScheme scheme, std::uint32_t vehicles) {
  if (scheme == FleetScheme::kDomains) return vehicles * matching_pairs(1, Partitioning::kNone);
  return matching_pairs(vehicles,
                        is_partitioned(scheme) ? Partitioning::kByVehicle : Partitioning::kNone);
}

std::uint64_t expected_with_servers(FleetScheme scheme, std::uint32_t vehicles) {
  if (!has_servers(scheme)) return 0;
  return kServers * pairs_with_server(vehicles, is_partitioned(scheme) ? Partitioning::kByVehicle
                                                                       : Partitioning::kNone);
}

FleetOutcome measure_fleet(const FleetVehiclesOptions& options, FleetScheme scheme,
                           const std::function<void(const FleetRun&)>& done) {
  FleetOutcome outcome;
  outcome.scheme = scheme;
  for (const std::uint32_t vehicles : options.vehicles) {
    outcome.why_no_further =
        obstacle(options, scheme, vehicles, outcome.runs.empty() ? nullptr : &outcome.runs.back());
    if (!outcome.why_no_further.empty()) break;
    std::vector<FleetRun> runs;
    for (std::uint32_t repeat = 0; repeat < options.repeats; ++repeat) {
      try {
        runs.push_back(Fleet(options, scheme, vehicles).run());
      } catch (const std::runtime_error& error) {  // a process gave up, or was too slow
        if (service::wait_for_stop(0ms)) throw;
        outcome.why_no_further = error.what();
        outcome.incomplete =
            FleetRun{.vehicles = vehicles, .expected = expected_pairs(scheme, vehicles)};
        return outcome;
      }
      if (runs.back().is_complete()) continue;
      outcome.incomplete = runs.back();
      outcome.why_no_further = std::to_string(runs.back().matched) + " of " +
                               std::to_string(runs.back().expected) + " pairs matched within " +
                               std::to_string(static_cast<int>(options.give_up_s)) + " s";
      return outcome;
    }
    outcome.runs.push_back(median_of_runs(runs));
    done(outcome.runs.back());
  }
  return outcome;
}

std::vector<FleetPoint> points_of(const FleetOutcome& outcome, const FleetFigure& figure) {
  std::vector<FleetPoint> points;
  for (const FleetRun& run : outcome.runs)
    points.push_back({static_cast<double>(run.vehicles), run.*figure.value});
  return points;
}

}  // namespace zerodrift::services
