// SPDX-License-Identifier: Apache-2.0
#include "common/evaluation/comparison_seeds.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <stdexcept>
#include <system_error>

#include "common/evaluation/comparison_figures.h"
#include "common/evaluation/offline_run.h"
#include "common/evaluation/simulated_record.h"
#include "common/report/json_object.h"
#include "common/report/numbers.h"

namespace zerodrift::evaluation {
namespace {

using comparison::GeometricMean;
using report::Align;

constexpr int kSeedsDigits = 3;

// A folder among the temporary files, gone with this.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "zerodrift-XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr)
      throw std::system_error(errno, std::generic_category(), "no temporary folder");
    path_ = name;
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

// All judgements of one protocol, by scheme in the order asked for.
struct Gathered {
  std::string name;
  std::map<std::string, std::vector<double>> rms_radps;
  std::map<std::string, std::vector<double>> over_holding;
};

// Frozen from another time in each record.
std::string common_name(const comparison::Protocol& protocol) {
  return is_frozen(protocol) ? "frozen" : protocol.name;
}

Gathered& gathered_of(std::vector<Gathered>& all, const std::string& name) {
  const auto found =
      std::find_if(all.begin(), all.end(), [&](const Gathered& one) { return one.name == name; });
  if (found != all.end()) return *found;
  all.push_back({name, {}, {}});
  return all.back();
}

void gather(const ComparisonResult& result, std::vector<Gathered>& all) {
  for (const AxisComparison& axis : result.axes) {
    for (const ProtocolOutcome& protocol : axis.protocols) {
      Gathered& gathered = gathered_of(all, common_name(protocol.protocol));
      const SchemeOutcome* holding = find(protocol, kHolding);
      for (const SchemeOutcome& scheme : protocol.schemes) {
        const double rms = scheme.statistics.root_mean_square;
        gathered.rms_radps[scheme.name].push_back(rms);
        if (holding != nullptr)
          gathered.over_holding[scheme.name].push_back(rms / holding->statistics.root_mean_square);
      }
    }
  }
}

const SeedsRow* best_of(const SeedsProtocol& protocol) {
  const SeedsRow* best = nullptr;
  for (const SeedsRow& row : protocol.rows) {
    const bool is_known = std::isfinite(row.rms_radps.value);
    if (is_known && (best == nullptr || row.rms_radps.value < best->rms_radps.value)) best = &row;
  }
  return best;
}

std::string figure_text(double value) {
  return std::isfinite(value) ? report::significant(value, kSeedsDigits) : "n/a";
}

// Known before anything is simulated.
void require_probes(const SeedsRequest& request, const twin::Model& model) {
  record::RecordInfo of_model;
  for (const twin::ProbeSpec& probe : model.probes) of_model.probes.push_back(probe.name);
  const auto missing = missing_probes(request.comparison.options, of_model);
  if (missing.empty()) return;
  throw std::invalid_argument(request.model + ": probes: found none named '" + missing.front() +
                              "', expected it, as features read its temperature (--config)");
}

nlohmann::ordered_json json_of(const GeometricMean& mean, double unit) {
  return {{"value", mean.value * unit}, {"lower", mean.lower * unit}, {"upper", mean.upper * unit}};
}

}  // namespace

SeedsResult run_seeds(const SeedsRequest& request, const Progress& progress) {
  SeedsResult result{request, {}, {}};
  SimulatedRecord simulated = load_simulation(request.model, request.profile);
  require_probes(request, simulated.model);
  result.warnings = simulated.warnings;
  if (request.rate_hz > 0.0) simulated.rate_hz = request.rate_hz;
  result.request.rate_hz = simulated.rate_hz;
  const TemporaryFolder folder;
  ComparisonRequest comparison = request.comparison;
  comparison.record.file = (folder.path() / "record.csv").string();
  comparison.only_labels = true;
  std::vector<Gathered> all;
  for (std::uint64_t k = 0; k < request.seeds; ++k) {
    simulated.seed = request.first_seed + k;
    const std::string name = "seed " + std::to_string(simulated.seed);
    write_simulation(simulated, comparison.record.file,
                     [&](double share, std::uint64_t) { progress("simulating " + name, share); });
    const ComparisonResult judged = run_comparison(comparison, progress);
    for (const std::string& doubt : measurement::lines_of(judged.doubts))
      result.warnings.push_back(name + ": doubtful: " + doubt);
    for (const std::string& warning : judged.warnings)
      result.warnings.push_back(name + ": " + warning);
    if (!judged.no_model.empty()) result.warnings.push_back(name + ": no model came into force");
    gather(judged, all);
  }
  if (all.empty())
    throw std::invalid_argument(request.profile + ": found no seed with anything to judge");
  for (Gathered& gathered : all) {
    SeedsProtocol protocol{gathered.name, {}};
    for (const std::string& scheme : comparison.schemes) {
      protocol.rows.push_back({scheme, comparison::geometric_mean(gathered.rms_radps[scheme]),
                               comparison::geometric_mean(gathered.over_holding[scheme])});
    }
    result.protocols.push_back(std::move(protocol));
  }
  return result;
}

std::vector<report::Table> seeds_tables(const SeedsResult& result) {
  std::vector<report::Table> tables;
  for (const SeedsProtocol& protocol : result.protocols) {
    report::Table table;
    table.caption = protocol.name + ": RMSE of labels, geometric mean over " +
                    std::to_string(protocol.rows.front().rms_radps.count) + " axes of " +
                    std::to_string(result.request.seeds) + " seeds, with 95 % intervals";
    table.columns = {{"scheme", Align::kLeft},
                     {"RMSE deg/h", Align::kRight},
                     {"from", Align::kRight},
                     {"to", Align::kRight},
                     {"over " + std::string(kHolding), Align::kRight},
                     {"from", Align::kRight},
                     {"to", Align::kRight}};
    const SeedsRow* best = best_of(protocol);
    for (const SeedsRow& row : protocol.rows) {
      const GeometricMean& rms = row.rms_radps;
      const GeometricMean& ratio = row.over_holding;
      table.rows.push_back(
          {{row.scheme, figure_text(core::deg_h_from_radps(rms.value)),
            figure_text(core::deg_h_from_radps(rms.lower)),
            figure_text(core::deg_h_from_radps(rms.upper)), figure_text(ratio.value),
            figure_text(ratio.lower), figure_text(ratio.upper)},
           &row == best});
    }
    tables.push_back(std::move(table));
  }
  return tables;
}

std::string seeds_verdict(const SeedsResult& result) {
  std::string text;
  for (const SeedsProtocol& protocol : result.protocols) {
    const SeedsRow* best = best_of(protocol);
    if (best == nullptr) continue;
    text += (text.empty() ? "Smallest geometric mean of the RMSE: " : "; ") + protocol.name + ", " +
            best->scheme;
    if (std::isfinite(best->over_holding.value))
      text += " (" + figure_text(best->over_holding.value) + " of holding the last minute)";
  }
  return text + ".";
}

report::Document seeds_page(const SeedsResult& result) {
  report::Document page;
  page.title = "Compensation schemes compared over seeds";
  page.subtitle = result.request.model + ", " + result.request.profile;
  page.verdict = seeds_verdict(result);
  for (report::Table& table : seeds_tables(result)) page.blocks.emplace_back(std::move(table));
  for (const std::string& warning : result.warnings)
    page.blocks.emplace_back(report::Paragraph{"Note: " + warning + "."});
  return page;
}

nlohmann::ordered_json seeds_json(const SeedsResult& result) {
  nlohmann::ordered_json json{
      {"model", result.request.model},           {"profile", result.request.profile},
      {"first_seed", result.request.first_seed}, {"seeds", result.request.seeds},
      {"rate_hz", result.request.rate_hz},       {"warnings", result.warnings},
      {"verdict", seeds_verdict(result)}};
  for (const SeedsProtocol& protocol : result.protocols) {
    auto& of_protocol = report::object_at(report::object_at(json, "protocols"), protocol.name);
    for (const SeedsRow& row : protocol.rows) {
      of_protocol[row.scheme] = {
          {"judged", row.rms_radps.count},
          {"rmse_deg_h", json_of(row.rms_radps, core::deg_h_from_radps(1.0))},
          {"rmse_over_holding", json_of(row.over_holding, 1.0)}};
    }
  }
  return json;
}

}  // namespace zerodrift::evaluation
