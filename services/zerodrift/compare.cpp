// SPDX-License-Identifier: Apache-2.0
// zerodrift compare: all schemes on one record, judged honestly, and as the paper did; or on
// several seeds of a simulation, judged together.
#include <cstdio>
#include <memory>
#include <stdexcept>

#include "common/config/compensation_config.h"
#include "common/evaluation/comparison_report.h"
#include "common/evaluation/comparison_run.h"
#include "common/evaluation/comparison_seeds.h"
#include "common/evaluation/comparison_verdict.h"
#include "common/files/atomic_file.h"
#include "common/service/main.h"
#include "common/service/time_option.h"
#include "services/zerodrift/commands.h"
#include "services/zerodrift/doubts.h"
#include "services/zerodrift/ending.h"
#include "services/zerodrift/paragraph.h"
#include "services/zerodrift/progress_bar.h"
#include "services/zerodrift/record_options.h"

namespace zerodrift::services {
namespace {

struct CompareOptions {
  evaluation::ComparisonRequest request;
  evaluation::SeedsRequest seeds;  // of the options below without a record
  std::string config;
  ReportFiles report;
  std::optional<double> train_until;
  Invocation made_by;
};

void print(const std::vector<report::Table>& tables) {
  for (const report::Table& table : tables) std::printf("%s\n", report::text_table(table).c_str());
}

void print(const Provenance& provenance) {
  for (const std::string& sentence : provenance_sentences(provenance)) print_paragraph(sentence);
}

int compare_seeds(const CompareOptions& options) {
  evaluation::SeedsRequest request = options.seeds;
  request.comparison = options.request;
  const evaluation::SeedsResult result = run_seeds(request, ProgressBars());
  const Provenance provenance =
      provenance_of(options.made_by, options.config, {options.seeds.model, options.seeds.profile});
  write_report(
      options.report, seeds_json(result), [&] { return seeds_page(result); }, provenance);
  for (const auto& line : result.warnings) std::fprintf(stderr, "%s\n", line.c_str());
  print(seeds_tables(result));
  print_paragraph(seeds_verdict(result));
  print(provenance);
  return service::kExitDone;
}

int compare(CompareOptions options) {
  const EndsAtOnce on_signal;
  files::check_outputs({{"--record", options.request.record.file},
                        {"--config", options.config},
                        {"--model", options.seeds.model},
                        {"--profile", options.seeds.profile}},
                       {{"--json", options.report.json}, {"--html", options.report.html}});
  if (!options.config.empty()) options.request.options = config::load_compensation(options.config);
  if (options.train_until) options.request.train_until_s = options.train_until;
  if (options.request.record.file.empty()) {
    if (options.seeds.model.empty())
      throw std::invalid_argument("--record: found none, expected it, or --model and --profile");
    return compare_seeds(options);
  }
  const evaluation::ComparisonResult result = run_comparison(options.request, ProgressBars());
  const Provenance provenance =
      provenance_of(options.made_by, options.config, {options.request.record.file});
  write_report(
      options.report, comparison_json(result), [&] { return comparison_page(result); }, provenance);
  print_doubts(result.doubts);
  if (!result.no_model.empty()) std::printf("%s\n", result.no_model.c_str());
  for (const auto& line : result.warnings) std::fprintf(stderr, "%s\n", line.c_str());
  if (!result.no_model.empty()) return service::kExitDone;
  print_paragraph(recommendation(result));
  std::printf("\n");
  print(comparison_tables(result));
  for (const std::string& note : comparison_notes(result)) print_paragraph(note);
  print(provenance);
  return service::kExitDone;
}

}  // namespace

void add_compare(CLI::App& app, Run& run, const Invocation& made_by) {
  auto* command = app.add_subcommand(
      "compare", "judge compensation schemes on a record: test-then-train, delayed, frozen");
  auto options = std::make_shared<CompareOptions>();
  options->made_by = made_by;
  evaluation::ComparisonRequest& request = options->request;
  request.schemes.assign(comparison::kSchemeNames.begin(), comparison::kSchemeNames.end());
  request.delays_s = {60.0, 600.0};
  auto* record = command->add_option("--record", request.record.file, kRecordHelp);
  evaluation::SeedsRequest& seeds = options->seeds;
  auto* model = command->add_option("--model", seeds.model, "instead of a record: a twin's model");
  auto* profile = command->add_option("--profile", seeds.profile, "and what the experiment does");
  model->needs(profile)->excludes(record);
  profile->needs(model);
  command->add_option("--seeds", seeds.seeds, "so many records are simulated and judged together")
      ->needs(model)
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  command->add_option("--seed", seeds.first_seed, "the first of them")
      ->needs(model)
      ->capture_default_str();
  command->add_option("--rate", seeds.rate_hz, "sample rate; the model's nominal rate without")
      ->needs(model)
      ->transform(service::in_hertz());
  add_reading(*command, request.record);
  command->add_option("--config", options->config, "YAML or JSON file (docs/configuration.md)");
  command
      ->add_option("--schemes", request.schemes,
                   "which to compare: " + comparison::listed_schemes())
      ->delimiter(',')
      ->option_text("NAME,... [all]")
      ->check(CLI::IsMember(std::vector<std::string>(comparison::kSchemeNames.begin(),
                                                     comparison::kSchemeNames.end())));
  service::show_default_in(
      "s", command->add_option("--delays", request.delays_s, "ages of the newest label to judge at")
               ->delimiter(',')
               ->transform(service::in_seconds()));
  command
      ->add_option("--train-until", options->train_until,
                   "time after the record's first row from which models are frozen; without, the "
                   "last leg of the temperature is kept unseen")
      ->transform(service::in_seconds());
  command->add_option("--json", options->report.json, "file for all figures");
  command->add_option("--html", options->report.html, "file for a report with pictures");
  command->callback([options, &run] { run = [options] { return compare(*options); }; });
}

}  // namespace zerodrift::services
