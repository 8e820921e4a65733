// SPDX-License-Identifier: Apache-2.0
// zerodrift bench fleet: how discovery, traffic, CPU and memory grow with the gyros of one machine
// and with the vehicles of a fleet.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/report/json_file.h"
#include "common/service/main.h"
#include "services/zerodrift/bench_fleet_gyros.h"
#include "services/zerodrift/bench_fleet_law.h"
#include "services/zerodrift/bench_fleet_vehicle.h"
#include "services/zerodrift/bench_fleet_vehicles.h"
#include "services/zerodrift/commands.h"

namespace zerodrift::services {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::uint32_t kDomain = 40;  // and those after it: below the ports the kernel gives away
constexpr std::array kExtrapolated{10U, 100U, 1000U};

struct FleetOptions {
  FleetGyrosOptions gyros;
  FleetVehiclesOptions vehicles;
  std::vector<std::string> schemes;
  std::string only;
  std::string json;
};

void print_gyros_heading(const FleetGyrosOptions& options) {
  std::printf(
      "Gyros on one machine: synthetic gyros in one process -> compensation -> a subscriber; "
      "medians of %u runs.\n"
      "Found each other: from the start to the last match, to the first answer of every gyro from "
      "the first sample;\n"
      "all datagrams and bytes on loopback, CPU of all three. Steady: the highest of %g Hz and its "
      "thirds off at which\n"
      "in %g s no sample is lost and at most 1 %% answered later than %g ms. CPU in %% of a core.\n"
      "%6s |%8s%9s%11s%8s%7s |%6s%10s%11s%9s |%8s%8s%8s |%7s%7s |%5s\n"
      "%6s |%8s%9s%11s%8s%7s |%6s%10s%11s%9s |%8s%8s%8s |%7s%7s |%5s\n",
      options.repeats, options.rate_hz, options.seconds, options.deadline_ms, "", "match",
      "answers", "datagrams", "kB", "CPU", "rate", "samples/s", "datagrams", "MB/s", "CPU of",
      "CPU of", "CPU of", "MiB", "MiB", "load", "gyros", "s", "s", "", "", "s", "Hz", "", "per s",
      "", "publ.", "comp.", "subscr.", "publ.", "comp.", "");
}

void print(const GyrosRun& run) {
  std::printf(
      "%6u |%8.2f%9.2f%11.0f%8.0f%7.2f |%6.0f%10.0f%11.0f%9.2f |%8.1f%8.1f%8.1f |%7.0f%7.0f "
      "|%5.1f\n",
      run.gyros, run.match_s, run.answer_s, run.discovery_datagrams, 1e-3 * run.discovery_bytes,
      run.discovery_cpu_s, run.rate_hz, run.rate_hz * run.gyros, run.datagrams_per_s,
      1e-6 * run.bytes_per_s, run.publisher_cpu_percent, run.compensation_cpu_percent,
      run.subscriber_cpu_percent, run.publisher_resident_mib, run.compensation_resident_mib,
      run.load);
  std::fflush(stdout);
}

Json json_of(const GyrosRun& run) {
  return {{"gyros", run.gyros},
          {"match_s", run.match_s},
          {"answer_s", run.answer_s},
          {"discovery_datagrams", run.discovery_datagrams},
          {"discovery_bytes", run.discovery_bytes},
          {"discovery_cpu_s", run.discovery_cpu_s},
          {"rate_hz", run.rate_hz},
          {"sent", run.sent},
          {"lost", run.lost},
          {"late", run.late},
          {"datagrams_per_s", run.datagrams_per_s},
          {"bytes_per_s", run.bytes_per_s},
          {"publisher_cpu_percent", run.publisher_cpu_percent},
          {"compensation_cpu_percent", run.compensation_cpu_percent},
          {"subscriber_cpu_percent", run.subscriber_cpu_percent},
          {"publisher_resident_mib", run.publisher_resident_mib},
          {"compensation_resident_mib", run.compensation_resident_mib},
          {"load", run.load}};
}

std::string_view text_of(FleetScheme scheme) {
  return std::find_if(kFleetSchemes.begin(), kFleetSchemes.end(),
                      [&](const auto& known) { return known.scheme == scheme; })
      ->text;
}

void print_vehicles_heading(const FleetVehiclesOptions& options) {
  const VehicleCount count = count_of_vehicle();
  std::printf(
      "\nVehicles: each one light process with the participants and endpoints of the deployed "
      "services (%llu, %llu writers,\n"
      "%llu readers) and no samples; medians of %u runs. Discovery: from the first start until "
      "only announcements are left.\n"
      "Idle: after that. Of all vehicles and servers together, CPU of one core.\n",
      static_cast<unsigned long long>(count.participants),
      static_cast<unsigned long long>(count.writers),
      static_cast<unsigned long long>(count.readers), options.repeats);
}

void print_scheme_heading(FleetScheme scheme) {
  const std::string text(text_of(scheme));
  std::printf(
      "\n%s\n%8s%14s |%10s%12s%11s%10s%9s |%10s%10s%9s |%9s |%5s\n"
      "%8s%14s |%10s%12s%11s%10s%9s |%10s%10s%9s |%9s |%5s\n",
      text.c_str(), "", "pairs that", "", "discovery:", "of them", "", "", "idle:", "", "", "", "",
      "vehicles", "match", "match s", "datagrams", "to nobody", "MB", "CPU s", "dgrams/s", "kB/s",
      "CPU %", "MiB", "load");
}

void print(const FleetRun& run) {
  std::printf("%8u%14llu |%10.2f%12.0f%11.0f%10.2f%9.2f |%10.0f%10.1f%9.2f |%9.0f |%5.1f\n",
              run.vehicles, static_cast<unsigned long long>(run.matched), run.match_s,
              run.datagrams, run.unanswered, 1e-6 * run.bytes, run.cpu_s, run.idle_datagrams_per_s,
              1e-3 * run.idle_bytes_per_s, run.idle_cpu_percent, run.resident_mib, run.load);
  std::fflush(stdout);
}

struct FittedFigure {
  const FleetFigure* figure;
  Growth growth;
  double held_out = 0.0;
  double exponent = 0.0;
};

std::vector<FittedFigure> fit(const FleetOutcome& outcome) {
  std::vector<FittedFigure> fitted;
  for (const FleetFigure& figure : kFleetFigures) {
    const auto points = points_of(outcome, figure);
    fitted.push_back(
        {&figure, fit_growth(points), held_out_error(points), exponent_at_the_end(points)});
  }
  return fitted;
}

double extrapolated(const std::vector<FittedFigure>& fitted, double FleetRun::*value, double n) {
  const auto found = std::find_if(fitted.begin(), fitted.end(),
                                  [&](const auto& one) { return one.figure->value == value; });
  return found->growth.at(n);
}

void print_extrapolated(const FleetOutcome& outcome, const std::vector<FittedFigure>& fitted) {
  for (const std::uint32_t vehicles : kExtrapolated) {
    if (vehicles <= outcome.runs.back().vehicles) continue;
    const auto at = [&](double FleetRun::*value) { return extrapolated(fitted, value, vehicles); };
    std::printf("%8u%14llu |%10s%12.3g%11s%10.4g%9.4g |%10.3g%10.4g%9.3g |%9.3g | extrapolated\n",
                vehicles, static_cast<unsigned long long>(expected_pairs(outcome.scheme, vehicles)),
                "-", at(&FleetRun::datagrams), "-", 1e-6 * at(&FleetRun::bytes),
                at(&FleetRun::cpu_s), at(&FleetRun::idle_datagrams_per_s),
                1e-3 * at(&FleetRun::idle_bytes_per_s), at(&FleetRun::idle_cpu_percent),
                at(&FleetRun::resident_mib));
  }
  for (const auto& [figure, growth, held_out, exponent] : fitted) {
    std::printf("  %-20s = %.4g + %.4g N + %.4g N^2, residual %.1f %%", figure->name,
                growth.constant, growth.per_vehicle, growth.per_pair, 100.0 * growth.residual);
    if (!std::isnan(held_out))
      std::printf("; fitted without the largest it misses it by %+.0f %%", 100.0 * held_out);
    if (!std::isnan(exponent)) std::printf("; at the end as N^%.2f", exponent);
    std::printf("\n");
  }
}

Json json_of(const FleetRun& run) {
  Json json{{"vehicles", run.vehicles},
            {"expected_pairs", run.expected},
            {"expected_by_readers", run.expected_by_readers},
            {"matched_by_writers", run.matched},
            {"matched_by_readers", run.matched_by_readers},
            {"match_s", run.match_s},
            {"unanswered_datagrams", run.unanswered},
            {"servers_cpu_s", run.servers_cpu_s},
            {"servers_resident_mib", run.servers_resident_mib},
            {"load", run.load}};
  for (const FleetFigure& figure : kFleetFigures) json[figure.name] = run.*figure.value;
  return json;
}

Json json_of(const FleetOutcome& outcome, const std::vector<FittedFigure>& fitted) {
  Json json{{"scheme", name_of(outcome.scheme)}, {"measured", Json::array()}};
  for (const FleetRun& run : outcome.runs) json["measured"].push_back(json_of(run));
  if (outcome.incomplete) json["incomplete"] = json_of(*outcome.incomplete);
  if (!outcome.why_no_further.empty()) json["why_no_further"] = outcome.why_no_further;
  for (const auto& [figure, growth, held_out, exponent] : fitted) {
    json["fit"][figure->name] = {{"constant", growth.constant},
                                 {"per_vehicle", growth.per_vehicle},
                                 {"per_vehicle_squared", growth.per_pair},
                                 {"residual", growth.residual},
                                 {"held_out_error", held_out},
                                 {"exponent_at_the_end", exponent}};
    for (const std::uint32_t vehicles : kExtrapolated)
      json["extrapolated"][std::to_string(vehicles)][figure->name] = growth.at(vehicles);
  }
  return json;
}

Json vehicle_json() {
  Json json = Json::array();
  for (const auto& process : vehicle_processes()) {
    Json writers = Json::array();
    Json readers = Json::array();
    for (const auto& endpoint : process.endpoints)
      (endpoint.kind == EndpointKind::kWriter ? writers : readers).push_back(endpoint.topic);
    json.push_back({{"service", process.service},
                    {"instance", process.instance},
                    {"writers", writers},
                    {"readers", readers}});
  }
  return json;
}

// Whether every number of gyros had a rate that holds.
bool bench_gyros(const FleetGyrosOptions& options, Json& json) {
  print_gyros_heading(options);
  const auto runs = measure_gyros(options, [](const GyrosRun& run) { print(run); });
  for (const GyrosRun& run : runs) json["gyros"].push_back(json_of(run));
  return std::all_of(runs.begin(), runs.end(), [](const auto& run) { return run.rate_hz > 0.0; });
}

// Whether every fleet that was begun matched.
bool bench_vehicles(const FleetVehiclesOptions& options, Json& json) {
  json["vehicle"] = vehicle_json();
  print_vehicles_heading(options);
  bool is_complete = true;
  for (const FleetScheme scheme : options.schemes) {
    print_scheme_heading(scheme);
    const FleetOutcome outcome =
        measure_fleet(options, scheme, [](const FleetRun& run) { print(run); });
    if (!outcome.why_no_further.empty())
      std::printf("  no further here: %s\n", outcome.why_no_further.c_str());
    const auto fitted = fit(outcome);
    if (!outcome.runs.empty()) print_extrapolated(outcome, fitted);
    json["fleets"].push_back(json_of(outcome, fitted));
    is_complete = is_complete && !outcome.incomplete;
  }
  return is_complete;
}

int bench_fleet(FleetOptions options) {
  for (const auto& name : options.schemes) {
    const auto scheme = scheme_of(name);
    if (!scheme) throw std::invalid_argument("bench fleet: --schemes: there is no '" + name + "'");
    options.vehicles.schemes.push_back(*scheme);
  }
  std::sort(options.vehicles.vehicles.begin(), options.vehicles.vehicles.end());
  options.gyros.domain = options.vehicles.domain;
  options.gyros.repeats = options.vehicles.repeats;
  Json json;
  bool good = true;
  if (options.only != "vehicles") good = bench_gyros(options.gyros, json);
  if (options.only != "gyros") good = bench_vehicles(options.vehicles, json) && good;
  if (!options.json.empty()) report::write_json(options.json, json);
  return good ? service::kExitDone : service::kExitNo;
}

void add_vehicle_process(CLI::App& bench, Run& run) {
  auto* vehicle = bench.add_subcommand("fleet-vehicle", "one light vehicle")->group("");
  auto options = std::make_shared<FleetVehicleOptions>();
  vehicle->add_option("--vehicle", options->vehicle)->required();
  vehicle->add_option("--domain", options->network.domain)->required();
  vehicle->add_option("--discovery-server", options->network.discovery_servers);
  vehicle->add_flag("--partitioned", options->is_partitioned);
  vehicle->callback([options, &run] { run = [options] { return run_fleet_vehicle(*options); }; });
}

void add_vehicles_options(CLI::App& command, FleetOptions& options) {
  auto& vehicles = options.vehicles;
  command.add_option("--vehicles", vehicles.vehicles, "sizes of fleets, by commas")
      ->delimiter(',')
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  std::vector<std::string> names;
  for (const auto& known : kFleetSchemes) names.emplace_back(known.name);
  options.schemes = names;
  command.add_option("--schemes", options.schemes, "how the vehicles find each other, by commas")
      ->delimiter(',')
      ->check(CLI::IsMember(names))
      ->capture_default_str();
  command
      .add_option("--give-up", vehicles.give_up_s,
                  "seconds: a fleet that takes longer to match is the last one")
      ->check(CLI::Range(1.0, 3600.0))
      ->capture_default_str();
  command.add_option("--memory", vehicles.largest_memory_gib, "GiB: no fleet that may take more")
      ->check(CLI::Range(0.1, 1024.0))
      ->capture_default_str();
}

void add_gyros_options(CLI::App& command, FleetGyrosOptions& gyros) {
  command.add_option("--gyros", gyros.gyros, "numbers of gyros on one machine, by commas")
      ->delimiter(',')
      ->check(CLI::Range(1, 120))
      ->capture_default_str();
  command.add_option("--rate", gyros.rate_hz, "of each gyro, to begin with")
      ->check(CLI::Range(10.0, 20000.0))
      ->capture_default_str();
  command.add_option("--seconds", gyros.seconds, "of a steady stream")
      ->check(CLI::Range(0.1, 3600.0))
      ->capture_default_str();
  command.add_option("--deadline", gyros.deadline_ms, "ms: an answer that comes later is late")
      ->check(CLI::Range(0.01, 60000.0))
      ->capture_default_str();
}

}  // namespace

void add_bench_fleet(CLI::App& bench, Run& run) {
  auto* command = bench.add_subcommand(
      "fleet", "how discovery, traffic and CPU grow with gyros and with vehicles");
  auto options = std::make_shared<FleetOptions>();
  options->gyros.gyros = {1, 10, 100};
  options->vehicles.vehicles = {1, 2, 3, 4, 5, 8};
  options->vehicles.domain = kDomain;
  add_gyros_options(*command, options->gyros);
  add_vehicles_options(*command, *options);
  command->add_option("--only", options->only, "one of the two parts")
      ->check(CLI::IsMember({"gyros", "vehicles"}));
  command->add_option("--repeat", options->vehicles.repeats, "runs of each, of which the median")
      ->check(CLI::Range(1, 101))
      ->capture_default_str();
  command->add_option("--json", options->json, "also as JSON, to this file");
  command
      ->add_option("--domain", options->vehicles.domain,
                   "DDS domain; with a domain a vehicle those after it too")
      ->capture_default_str();
  command->callback([options, &run] { run = [options] { return bench_fleet(*options); }; });
  add_vehicle_process(bench, run);
}

}  // namespace zerodrift::services
