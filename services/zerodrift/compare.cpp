// SPDX-License-Identifier: Apache-2.0
// zerodrift compare: all schemes on one record, judged honestly, and as the paper did.
#include <cstdio>
#include <memory>

#include "common/config/compensation_config.h"
#include "common/files/atomic_file.h"
#include "common/report/json_file.h"
#include "common/service/main.h"
#include "services/zerodrift/commands.h"
#include "services/zerodrift/comparison_report.h"
#include "services/zerodrift/comparison_run.h"
#include "services/zerodrift/ending.h"
#include "services/zerodrift/paragraph.h"
#include "services/zerodrift/record_options.h"

namespace zerodrift::services {
namespace {

struct CompareOptions {
  ComparisonRequest request;
  std::string config;
  std::string json;
  std::string html;
  std::optional<double> train_until;
};

int compare(CompareOptions options) {
  const EndsAtOnce on_signal;
  files::check_outputs({{"--record", options.request.record}, {"--config", options.config}},
                       {{"--json", options.json}, {"--html", options.html}});
  if (!options.config.empty()) options.request.options = config::load_compensation(options.config);
  if (options.train_until) options.request.train_until_s = options.train_until;
  const ComparisonResult result = run_comparison(options.request);
  if (!options.json.empty()) report::write_json(options.json, comparison_json(result));
  if (!options.html.empty()) report::write_html(options.html, comparison_page(result));
  if (!result.no_model.empty()) std::printf("%s\n", result.no_model.c_str());
  for (const auto& line : result.warnings) std::fprintf(stderr, "%s\n", line.c_str());
  if (!result.no_model.empty()) return service::kExitDone;
  for (const report::Table& table : comparison_tables(result))
    std::printf("%s\n", report::text_table(table).c_str());
  for (const std::string& note : comparison_notes(result)) print_paragraph(note);
  return service::kExitDone;
}

}  // namespace

void add_compare(CLI::App& app, Run& run) {
  auto* command = app.add_subcommand(
      "compare", "judge compensation schemes on a record: test-then-train, delayed, frozen");
  auto options = std::make_shared<CompareOptions>();
  ComparisonRequest& request = options->request;
  request.schemes.assign(comparison::kSchemeNames.begin(), comparison::kSchemeNames.end());
  request.delays_s = {60.0, 600.0};
  command->add_option("--record", request.record, kRecordHelp)->required();
  add_gyro_choice(*command, request.gyro_id);
  command->add_option("--columns", request.columns, "names and units of a foreign CSV");
  command->add_option("--config", options->config, "YAML or JSON file (docs/configuration.md)");
  command->add_option("--schemes", request.schemes, "which to compare")
      ->delimiter(',')
      ->check(CLI::IsMember(std::vector<std::string>(comparison::kSchemeNames.begin(),
                                                     comparison::kSchemeNames.end())))
      ->capture_default_str();
  command->add_option("--delays", request.delays_s, "ages of the newest label to judge at, s")
      ->delimiter(',')
      ->capture_default_str();
  command->add_option("--train-until", options->train_until,
                      "record time from which models are frozen, s; without, the last leg of the "
                      "temperature is kept unseen");
  command->add_option("--json", options->json, "file for all figures");
  command->add_option("--html", options->html, "file for a report with pictures");
  command->callback([options, &run] { run = [options] { return compare(*options); }; });
}

}  // namespace zerodrift::services
