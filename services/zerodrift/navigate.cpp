// SPDX-License-Identifier: Apache-2.0
// zerodrift navigate: what compensation is worth to a navigation filter, on a record.
#include <cstdio>
#include <memory>
#include <string>

#include "common/config/compensation_config.h"
#include "common/evaluation/navigation_report.h"
#include "common/files/atomic_file.h"
#include "common/navigation/arguments.h"
#include "common/service/main.h"
#include "common/service/time_option.h"
#include "services/zerodrift/commands.h"
#include "services/zerodrift/ending.h"
#include "services/zerodrift/paragraph.h"
#include "services/zerodrift/progress_bar.h"
#include "services/zerodrift/record_options.h"

namespace zerodrift::services {
namespace {

struct NavigateOptions {
  evaluation::NavigationRequest request;
  navigation::NavigationArguments arguments;
  std::string config;
  std::string prior;
  ReportFiles report;
  Invocation made_by;
};

// Without a file: as a vehicle would be configured. Earth rate is known from the filter alone, and
// the truth is kept for the judgement.
compensation::CompensationOptions compensation_options(const NavigateOptions& options) {
  if (!options.config.empty()) return config::load_compensation(options.config);
  compensation::CompensationOptions vehicle;
  vehicle.reference.truth = compensation::ReferencePolicy::kRefuse;
  if (options.arguments.latitude_deg)
    vehicle.earth_rate.mode = compensation::EarthRateMode::kUnknown;
  if (options.arguments.residual_feedback)
    vehicle.reference.navigation_residual = compensation::ReferencePolicy::kAccept;
  return vehicle;
}

int navigate(NavigateOptions options) {
  const EndsAtOnce on_signal;
  files::check_outputs({{"--record", options.request.record.file},
                        {"--config", options.config},
                        {"--prior", options.prior}},
                       {{"--json", options.report.json}, {"--html", options.report.html}});
  options.request.navigation = options.arguments.complete();
  options.request.compensation = compensation_options(options);
  if (!options.prior.empty())
    options.request.compensation.prior = config::load_prior(options.prior);
  if (options.request.gives_references &&
      options.request.compensation.reference.rest == compensation::ReferencePolicy::kAccept) {
    options.request.compensation.reference.await_feedback = true;
  }
  const evaluation::NavigationResult result = run_navigation(options.request, ProgressBars());
  if (options.report.any()) {
    std::vector<std::string> inputs{options.request.record.file};
    if (!options.prior.empty()) inputs.push_back(options.prior);
    write_report(
        options.report, navigation_json(result),
        [&] { return navigation_page(options.request, result); },
        provenance_of(options.made_by, options.config, inputs));
  }
  for (const auto& line : result.warnings) std::fprintf(stderr, "%s\n", line.c_str());
  print_paragraph(navigation_advice(result));
  std::printf("\n%s\n", report::text_table(navigation_table(result)).c_str());
  print_paragraph(navigation_note(options.request, result));
  return service::kExitDone;
}

}  // namespace

void add_navigate(CLI::App& app, Run& run, const Invocation& made_by) {
  auto* command = app.add_subcommand(
      "navigate", "attitude from a record, by raw and by compensated rates, against its truth");
  auto options = std::make_shared<NavigateOptions>();
  options->made_by = made_by;
  command->add_option("--record", options->request.record.file, kRecordHelp)->required();
  add_reading(*command, options->request.record);
  command->add_option("--config", options->config,
                      "of the compensation (docs/configuration.md); without, Earth rate is "
                      "learned of from the filter and reference columns only judge");
  command->add_option("--prior", options->prior, "a twin's model; overrides the file");
  service::show_default_in(
      "s",
      navigation::add_arguments(*command, options->arguments)->transform(service::in_seconds()));
  command->add_flag("!--no-references", options->request.gives_references,
                    "give no rate_reference back to the compensation");
  command->add_option("--json", options->report.json, "file for all figures");
  command->add_option("--html", options->report.html, "file for a report with pictures");
  command->callback([options, &run] { run = [options] { return navigate(*options); }; });
}

}  // namespace zerodrift::services
