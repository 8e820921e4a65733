// SPDX-License-Identifier: Apache-2.0
// zerodrift_bench latency: from one process to another by every way there is, side by side in one
// run, up to our whole chain.
#include "tests/bench/bench_latency.h"

#include <sys/mman.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <iostream>
#include <stdexcept>
#include <thread>

#include "common/report/json_file.h"
#include "common/service/main.h"
#include "common/service/one_of.h"
#include "services/zerodrift/progress_bar.h"
#include "tests/bench/latency_end.h"
#include "tests/bench/latency_table.h"
#include "tests/bench/measured_hop.h"

namespace zerodrift::bench {
namespace {

constexpr unsigned kLossPermille = 20;  // of --alternatives

enum class Loads : std::uint8_t { kNone, kHog, kBoth };

struct LatencyBenchOptions {
  std::uint32_t domain = kBenchDomain;
  std::vector<double> rates_hz{200.0, 1000.0, 2000.0};
  double duration_s = 1.5;
  Loads loads = Loads::kBoth;
  bool alternatives = false;
  std::vector<std::string> only;
  service::RealtimeOptions realtime;
  std::string json;
};

std::vector<RowOptions> rows_of_the_bench() {
  std::vector<RowOptions> rows{{"udp", "raw UDP"},
                               {"futex", "futex"},
                               {"best-effort", "best effort"},
                               {"topic", "topic's QoS"}};
  if (has_cyclone_link()) rows.push_back({"cyclone", "Cyclone DDS"});
  rows.push_back({"chain", "whole chain"});
  return rows;
}

std::vector<RowOptions> rows_of_the_alternatives(const std::vector<std::string>& only) {
  std::vector<RowOptions> rows;
  for (const auto& alternative : dds::hop_alternatives()) {
    const std::string name(alternative.name);
    const bool is_reference = rows.empty();
    if (!is_reference && !only.empty() && std::find(only.begin(), only.end(), name) == only.end()) {
      continue;
    }
    rows.push_back({name, name});
  }
  return rows;
}

LatencyPlan plan_of(const LatencyBenchOptions& options) {
  LatencyPlan plan{.rows = rows_of_the_bench(),
                   .rates_hz = options.rates_hz,
                   .loads = {},
                   .directions = {Direction::kOneWay, Direction::kRoundTrip},
                   .duration_s = options.duration_s,
                   .setting = {.domain = options.domain, .realtime = options.realtime}};
  if (options.loads != Loads::kHog) plan.loads.push_back(Load::kNone);
  if (options.loads != Loads::kNone) plan.loads.push_back(Load::kHog);
  return plan;
}

LatencyCells measure_with_progress(const LatencyPlan& plan, const std::string& what) {
  services::ProgressBar bar(what);
  return measure_latencies(plan, [&](double share) { bar.show(share); });
}

std::uint64_t lost_in(const LatencyCells& cells, std::size_t row) {
  std::uint64_t lost = 0;
  for (const auto& [key, cell] : cells) lost += key.row == row ? cell.lost : 0;
  return lost;
}

// The options are others': nothing is changed here for good.
void check_permitted(const service::RealtimeOptions& options) {
  if (!options.wanted) return;
  service::apply(options);
  service::leave_realtime();
  munlockall();
}

void write_if_asked(const LatencyBenchOptions& options, const nlohmann::ordered_json& json) {
  if (!options.json.empty()) report::write_json(options.json, json);
}

int bench_rows(const LatencyBenchOptions& options) {
  const LatencyPlan plan = plan_of(options);
  const auto index_of = [&](const std::string& kind) {
    return static_cast<std::size_t>(
        std::find_if(plan.rows.begin(), plan.rows.end(),
                     [&](const RowOptions& row) { return row.kind == kind; }) -
        plan.rows.begin());
  };
  const LatencyReferences references{.floor = index_of("udp"),
                                     .best_effort = index_of("best-effort")};
  const LatencyCells cells = measure_with_progress(plan, "latency");
  std::printf(
      "Two processes on one machine; every row of a block was measured in turns of at most half a\n"
      "second. late: longer on the way than a sample period. -: too few samples to tell "
      "(--seconds).\n"
      "The chain's round trip: from a process through the compensation service back to it.\n%s",
      latency_table(plan, references, cells).c_str());
  write_if_asked(options, latency_json(plan, references, cells));
  bool good = lost_in(cells, index_of("topic")) + lost_in(cells, index_of("chain")) == 0;
  if (options.loads != Loads::kHog) {
    const ChainVerdict verdict =
        judge_chain(plan, index_of("chain"), references.best_effort, cells);
    std::printf("%s", verdict.text.c_str());
    good = good && verdict.met;
  }
  return good ? service::kExitDone : service::kExitNo;
}

// The same alternatives without and with loss, one way, machine idle.
int bench_alternatives(const LatencyBenchOptions& options) {
  LatencyPlan plan = plan_of(options);
  plan.rows = rows_of_the_alternatives(options.only);
  plan.loads = {Load::kNone};
  plan.directions = {Direction::kOneWay};
  const LatencyReferences references{};
  const LatencyCells whole = measure_with_progress(plan, "without loss");
  plan.lose_permille = kLossPermille;
  const LatencyCells lossy = measure_with_progress(plan, "with loss");
  for (const auto& alternative : dds::hop_alternatives()) {
    std::printf("%-26s%s\n", std::string(alternative.name).c_str(),
                std::string(alternative.text).c_str());
  }
  LatencyPlan whole_plan = plan;
  whole_plan.lose_permille = 0;
  std::printf("\nwithout loss; the floor is best effort\n%s\n2 %% of all UDP datagrams lost\n%s",
              latency_table(whole_plan, references, whole).c_str(),
              latency_table(plan, references, lossy).c_str());
  write_if_asked(options, {{"without_loss", latency_json(whole_plan, references, whole)},
                           {"with_loss", latency_json(plan, references, lossy)}});
  return service::kExitDone;
}

int bench_latency(const LatencyBenchOptions& options) {
  check_permitted(options.realtime);
  return options.alternatives ? bench_alternatives(options) : bench_rows(options);
}

// A process that never rests, until its standard input ends.
int be_busy() {
  std::atomic<bool> stopping{false};
  std::thread busy([&] {
    while (!stopping.load(std::memory_order_relaxed)) {
    }
  });
  for (std::string line; std::getline(std::cin, line);) {
  }
  stopping = true;
  busy.join();
  return service::kExitDone;
}

void add_own_processes(CLI::App& bench, Run& run) {
  auto* busy = bench.add_subcommand("busy", "a process that never rests")->group("");
  busy->callback([&run] { run = be_busy; });
  auto* end = bench.add_subcommand("latency-end", "one end of bench latency")->group("");
  auto options = std::make_shared<LatencyEndOptions>();
  end->add_option("--kind", options->link.kind)->required();
  end->add_option("--end", options->link.end)
      ->required()
      ->transform(service::one_of<LinkEnd>(
          {{"near", LinkEnd::kNear}, {"far", LinkEnd::kFar}, {"loop", LinkEnd::kLoop}}));
  end->add_option("--name", options->link.name)->required();
  end->add_option("--domain", options->link.network.domain)->required();
  end->add_option("--capacity", options->capacity)->required();
  service::add_realtime_options(*end, options->realtime);
  end->callback([options, &run] { run = [options] { return run_latency_end(*options); }; });
}

}  // namespace

void add_bench_latency(CLI::App& bench, Run& run) {
  auto* command = bench.add_subcommand(
      "latency", "from process to process: the floor, the middleware, the whole chain");
  auto options = std::make_shared<LatencyBenchOptions>();
  command->add_option("--rate", options->rates_hz, "samples a second, by commas")
      ->delimiter(',')
      ->check(CLI::Range(1.0, 20000.0))
      ->capture_default_str();
  command
      ->add_option("--seconds", options->duration_s,
                   "of each row, rate and load; p99.9 needs 2000 samples")
      ->check(CLI::Range(0.05, 3600.0))
      ->capture_default_str();
  command->add_option("--load", options->loads, "none, hog (a process that never rests) or both")
      ->transform(service::one_of<Loads>(
          {{"none", Loads::kNone}, {"hog", Loads::kHog}, {"both", Loads::kBoth}}))
      ->default_str("both");
  auto* alternatives = command->add_flag(
      "--alternatives", options->alternatives,
      "choices of quality of service for the hot topics instead, without and with loss");
  command->add_option("--only", options->only, "alternatives to be measured, by commas")
      ->delimiter(',')
      ->needs(alternatives);
  command->add_option("--json", options->json, "a file for the figures");
  command->add_option("--domain", options->domain, "DDS domain")
      ->check(CLI::Range(0, 232))
      ->capture_default_str();
  service::add_realtime_options(*command, options->realtime);
  command->callback([options, &run] { run = [options] { return bench_latency(*options); }; });
  add_own_processes(bench, run);
}

}  // namespace zerodrift::bench
