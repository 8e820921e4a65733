// SPDX-License-Identifier: Apache-2.0
// zerodrift_bench end-to-end: the whole chain of processes without losing a sample, either one
// simulated gyro as fast as it goes, or many gyros at rising rates until the first late or lost
// sample.
#include "tests/bench/bench_end_to_end.h"

#include <chrono>
#include <cstdio>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/service/host.h"
#include "common/service/main.h"
#include "services/control/status_table.h"
#include "services/zerodrift/progress_bar.h"
#include "tests/bench/bench_latency.h"
#include "tests/bench/bench_process.h"
#include "tests/bench/gyro_fleet.h"
#include "tests/bench/gyro_load.h"

namespace zerodrift::bench {
namespace {

using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

struct BenchOptions {
  dds::NetworkOptions network;
  std::string model;
  std::string profile;
  double duration_s = 18000.0;
  GyroLoadOptions load;
};

std::string text(double value) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.9g", value);
  return buffer;
}

using Arguments = std::vector<std::string>;

Arguments with(Arguments base, const Arguments& more) {
  base.insert(base.end(), more.begin(), more.end());
  return base;
}

int as_fast_as_it_goes(const BenchOptions& options) {
  const Arguments domain{"--domain", std::to_string(options.network.domain)};
  const Arguments source =
      with({"--source", "simulation", "--model", options.model, "--profile", options.profile,
            "--speed", "max", "--duration", text(options.duration_s)},
           domain);
  dds::Participant participant("zerodrift_bench", options.network);
  services::StatusBoard board(participant);
  constexpr auto kQuiet = BenchProcess::Streams::kQuiet;
  const BenchProcess monitor("allan_monitor", domain, kQuiet);
  const BenchProcess compensation("compensation", with(domain, {"--await-subscribers", "1"}),
                                  kQuiet);
  const BenchProcess thermal("thermal_publisher", source, kQuiet);
  const BenchProcess gyro("gyro_publisher",
                          with(source, {"--wait-for", "compensation,allan_monitor"}), kQuiet);

  services::ProgressBar bar("end to end");
  std::optional<Clock::time_point> first;
  std::int64_t monitor_early_kb = 0;
  std::int64_t compensation_early_kb = 0;
  double answered = 0.0;
  auto progressed = Clock::now();
  while (!board.finished() || !board.nothing_lost()) {
    if (service::wait_for_stop(50ms)) return service::kExitNo;
    const double now = board.answered();
    if (now > 0.0 && !first) first = Clock::now();
    if (now != answered) progressed = Clock::now();
    answered = now;
    if (Clock::now() - progressed > 30s) {
      std::fprintf(stderr, "bench end-to-end: no progress for 30 s after %.0f samples\n", answered);
      return service::kExitNo;
    }
    bar.show(board.sensor_time_s() / options.duration_s);
    if (monitor_early_kb == 0 && board.sensor_time_s() > 0.2 * options.duration_s) {
      monitor_early_kb = monitor.usage().resident_kb;
      compensation_early_kb = compensation.usage().resident_kb;
    }
  }
  const double elapsed_s =
      std::chrono::duration<double>(Clock::now() - first.value_or(Clock::now())).count();
  std::printf(
      "end to end: %.0f samples of 3 axes in %.1f s: %.0f samples/s, %.0f times real time\n",
      answered, elapsed_s, answered / elapsed_s, options.duration_s / elapsed_s);
  std::printf(
      "resident memory at 20 %% and at the end: compensation %lld and %lld kB, allan_monitor %lld "
      "and %lld kB\n",
      static_cast<long long>(compensation_early_kb),
      static_cast<long long>(compensation.usage().resident_kb),
      static_cast<long long>(monitor_early_kb),
      static_cast<long long>(monitor.usage().resident_kb));
  std::printf("%s", board.summary().c_str());
  return service::kExitDone;
}

int end_to_end(BenchOptions options) {
  if (!options.load.gyros.empty()) {
    options.load.domain = options.network.domain;
    return bench_gyro_load(options.load);
  }
  if (options.model.empty() || options.profile.empty()) {
    throw std::invalid_argument("bench end-to-end: give --model and --profile, or --gyros");
  }
  return as_fast_as_it_goes(options);
}

void add_fleet_process(CLI::App& bench, Run& run) {
  auto* fleet = bench.add_subcommand("gyro-fleet", "many gyros in one process")->group("");
  auto options = std::make_shared<GyroFleetOptions>();
  fleet->add_option("--gyros", options->gyros)->required();
  fleet->add_option("--domain", options->network.domain)->required();
  fleet->callback([options, &run] { run = [options] { return run_gyro_fleet(*options); }; });
}

}  // namespace

void add_bench_end_to_end(CLI::App& bench, Run& run) {
  auto* command =
      bench.add_subcommand("end-to-end", "samples a second through all processes, none lost");
  auto options = std::make_shared<BenchOptions>();
  options->network.domain = kBenchDomain;
  auto* model = command->add_option("--model", options->model, "the twin's model file");
  auto* profile = command->add_option("--profile", options->profile, "what the experiment does");
  command->add_option("--duration", options->duration_s, "simulated seconds")
      ->capture_default_str();
  command
      ->add_option("--gyros", options->load.gyros,
                   "instead: so many synthetic gyros at rising rates, until the first late or lost "
                   "sample; by commas, e.g. 1,10,100")
      ->delimiter(',')
      ->check(CLI::Range(1, 120))
      ->excludes(model)
      ->excludes(profile);
  command->add_option("--rate", options->load.first_rate_hz, "with --gyros: the rate to begin with")
      ->check(CLI::Range(1.0, 20000.0))
      ->capture_default_str();
  command->add_option("--seconds", options->load.step_s, "with --gyros: at each rate")
      ->check(CLI::Range(0.1, 3600.0))
      ->capture_default_str();
  command->add_option("--largest-rate", options->load.largest_rate_hz, "with --gyros: no further")
      ->check(CLI::Range(1.0, 100000.0))
      ->capture_default_str();
  command
      ->add_option("--deadline", options->load.deadline_ms,
                   "with --gyros: an answer is late that comes so many ms after its sample was due")
      ->check(CLI::Range(0.01, 60000.0))
      ->capture_default_str();
  command->add_option("--json", options->load.json, "with --gyros: a file for the figures");
  command->add_option("--domain", options->network.domain, "DDS domain")->capture_default_str();
  command->callback([options, &run] { run = [options] { return end_to_end(*options); }; });
  add_fleet_process(bench, run);
}

}  // namespace zerodrift::bench
