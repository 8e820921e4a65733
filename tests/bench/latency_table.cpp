// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/latency_table.h"

#include <cmath>
#include <cstdio>

namespace zerodrift::bench {
namespace {

constexpr double kChainOverHopP50 = 2.2;
constexpr double kChainOverHopP99 = 2.5;

const LatencyCell& cell_of(const LatencyCells& cells, const CellKey& key) {
  static const LatencyCell kEmpty;
  const auto found = cells.find(key);
  return found == cells.end() ? kEmpty : found->second;
}

// Seven characters: "-" where there is nothing to say.
std::string figure(double value) {
  char buffer[32] = "      -";
  if (!std::isnan(value))
    std::snprintf(buffer, sizeof buffer, "%7.*f", value < 1000.0 ? 1 : 0, value);
  return buffer;
}

std::string ratio(double value) {
  char buffer[32] = "     -";
  if (!std::isnan(value)) std::snprintf(buffer, sizeof buffer, "%6.2f", value);
  return buffer;
}

const char* text(Load load) {
  return load == Load::kNone ? "no load added" : "one CPU hog";
}

std::string heading(double rate_hz, Load load) {
  char buffer[256];
  std::snprintf(buffer, sizeof buffer,
                "\n%g Hz x 3 axes, %s\n"
                "%-44s|%-16s|  / floor     | / best effort|\n"
                "%-16s%7s%7s%7s%7s|%8s%8s|%7s%7s|%7s%7s|%6s%6s\n",
                rate_hz, text(load), "                one way, us", "  round trip, us", "", "p50",
                "p99", "p99.9", "max", "p50", "p99", "p50", "p99", "p50", "p99", "lost", "late");
  return buffer;
}

struct Compared {
  LatencyFigures one_way, round_trip, floor, best_effort;
};

Compared compared(const LatencyCells& cells, CellKey key, const LatencyReferences& references) {
  const auto one_way_of = [&](std::size_t row) {
    return figures_of(cell_of(cells, {key.load, key.rate_hz, row, Direction::kOneWay}));
  };
  key.direction = Direction::kRoundTrip;
  return {.one_way = one_way_of(key.row),
          .round_trip = figures_of(cell_of(cells, key)),
          .floor = one_way_of(references.floor),
          .best_effort = one_way_of(references.best_effort)};
}

std::string row_text(const std::string& label, const Compared& c, const LatencyCell& one_way,
                     const LatencyCell& round_trip) {
  char ends[64];
  std::snprintf(ends, sizeof ends, "|%6llu%6llu\n",
                static_cast<unsigned long long>(one_way.lost + round_trip.lost),
                static_cast<unsigned long long>(one_way.late + round_trip.late));
  char name[32];
  std::snprintf(name, sizeof name, "%-16s", label.c_str());
  return name + figure(c.one_way.p50_us) + figure(c.one_way.p99_us) + figure(c.one_way.p999_us) +
         figure(c.one_way.max_us) + "| " + figure(c.round_trip.p50_us) + ' ' +
         figure(c.round_trip.p99_us) + "| " + ratio(c.one_way.p50_us / c.floor.p50_us) + ' ' +
         ratio(c.one_way.p99_us / c.floor.p99_us) + "| " +
         ratio(c.one_way.p50_us / c.best_effort.p50_us) + ' ' +
         ratio(c.one_way.p99_us / c.best_effort.p99_us) + ends;
}

nlohmann::ordered_json json_of(const LatencyCell& cell) {
  const LatencyFigures figures = figures_of(cell);
  return {{"p50_us", figures.p50_us}, {"p99_us", figures.p99_us}, {"p999_us", figures.p999_us},
          {"max_us", figures.max_us}, {"sent", cell.sent},        {"lost", cell.lost},
          {"late", cell.late}};
}

}  // namespace

std::string latency_table(const LatencyPlan& plan, const LatencyReferences& references,
                          const LatencyCells& cells) {
  std::string table;
  for (const Load load : plan.loads) {
    for (const double rate_hz : plan.rates_hz) {
      table += heading(rate_hz, load);
      for (std::size_t row = 0; row < plan.rows.size(); ++row) {
        const CellKey one_way{load, rate_hz, row, Direction::kOneWay};
        const CellKey round_trip{load, rate_hz, row, Direction::kRoundTrip};
        table += row_text(plan.rows[row].label, compared(cells, one_way, references),
                          cell_of(cells, one_way), cell_of(cells, round_trip));
      }
    }
  }
  return table;
}

nlohmann::ordered_json latency_json(const LatencyPlan& plan, const LatencyReferences& references,
                                    const LatencyCells& cells) {
  auto rows = nlohmann::ordered_json::array();
  for (const auto& [key, cell] : cells) {
    if (key.direction != Direction::kOneWay) continue;
    const Compared c = compared(cells, key, references);
    const CellKey back{key.load, key.rate_hz, key.row, Direction::kRoundTrip};
    rows.push_back({{"row", plan.rows[key.row].kind},
                    {"text", plan.rows[key.row].label},
                    {"load", key.load == Load::kNone ? "none" : "hog"},
                    {"rate_hz", key.rate_hz},
                    {"one_way", json_of(cell)},
                    {"round_trip", json_of(cell_of(cells, back))},
                    {"p50_over_floor", c.one_way.p50_us / c.floor.p50_us},
                    {"p99_over_floor", c.one_way.p99_us / c.floor.p99_us},
                    {"p50_over_best_effort", c.one_way.p50_us / c.best_effort.p50_us},
                    {"p99_over_best_effort", c.one_way.p99_us / c.best_effort.p99_us}});
  }
  return {{"realtime", plan.setting.realtime.wanted},
          {"datagrams_lost_permille", plan.lose_permille},
          {"rows", rows}};
}

ChainVerdict judge_chain(const LatencyPlan& plan, std::size_t chain, std::size_t best_effort,
                         const LatencyCells& cells) {
  ChainVerdict verdict{.text = "\nthe chain (two hops) over one best-effort hop, no load added\n",
                       .met = true};
  for (const double rate_hz : plan.rates_hz) {
    const LatencyCell& cell = cell_of(cells, {Load::kNone, rate_hz, chain, Direction::kOneWay});
    const LatencyFigures ours = figures_of(cell);
    const LatencyFigures hop =
        figures_of(cell_of(cells, {Load::kNone, rate_hz, best_effort, Direction::kOneWay}));
    const double p50 = ours.p50_us / hop.p50_us;
    const double p99 = ours.p99_us / hop.p99_us;
    const bool met = p50 <= kChainOverHopP50 && p99 <= kChainOverHopP99 && cell.lost == 0;
    verdict.met = verdict.met && met;
    char line[192];
    std::snprintf(line, sizeof line,
                  "  %5g Hz   p50 %s   goal <= %.1f   p99 %s   goal <= %.1f   lost %llu   %s\n",
                  rate_hz, ratio(p50).c_str(), kChainOverHopP50, ratio(p99).c_str(),
                  kChainOverHopP99, static_cast<unsigned long long>(cell.lost),
                  met ? "met" : "not met");
    verdict.text += line;
  }
  return verdict;
}

}  // namespace zerodrift::bench
