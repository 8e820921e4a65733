// SPDX-License-Identifier: Apache-2.0
// zerodrift history: what became of gyros over their records, and which is unlike the others.
#include <cstdio>
#include <memory>
#include <stdexcept>
#include <utility>

#include "common/config/twin_config.h"
#include "common/files/atomic_file.h"
#include "common/report/plain_text.h"
#include "common/service/main.h"
#include "services/zerodrift/commands.h"
#include "services/zerodrift/history_report.h"
#include "services/zerodrift/paragraph.h"

namespace zerodrift::services {
namespace {

struct HistoryOptions {
  std::vector<std::string> models;
  double false_discovery_rate = 0.05;
  std::string json;
  Invocation made_by;
};

std::string every(const std::vector<std::string>& files) {
  std::string names;
  for (const std::string& file : files) names += (names.empty() ? "" : ", ") + file;
  return names;
}

int history(const HistoryOptions& options) {
  std::vector<files::NamedFile> inputs;
  for (const std::string& file : options.models) inputs.push_back({"--model", file});
  files::check_outputs(inputs, {{"--json", options.json}});
  std::vector<diagnosis::RecordedModel> models;
  for (const std::string& file : options.models)
    models.push_back({file, config::load_model(file).model});
  diagnosis::MeasuredEffects measured = diagnosis::measured_effects(models);
  if (measured.coefficients.empty()) {
    throw std::invalid_argument(
        every(options.models) +
        ": nothing here was measured: it needs effects that calibrate or diagnose has sized, with "
        "their standard errors");
  }
  const FleetHistory fleet{
      diagnosis::history_of(std::move(measured.coefficients), options.false_discovery_rate),
      std::move(measured.partly_sized), options.false_discovery_rate};
  if (!options.json.empty()) {
    write_report({options.json, ""}, history_json(fleet), {},
                 provenance_of(options.made_by, "", options.models));
  }
  for (const std::string& sentence : history_sentences(fleet))
    print_paragraph(report::one_line(sentence));
  std::printf("\n%s", report::text_table(history_table(fleet.history)).c_str());
  return service::kExitDone;
}

}  // namespace

void add_history(CLI::App& app, Run& run, const Invocation& made_by) {
  auto* command = app.add_subcommand(
      "history", "find which gyro changed when, and which is unlike the others, from their models");
  auto options = std::make_shared<HistoryOptions>();
  options->made_by = made_by;
  command
      ->add_option("--model", options->models,
                   "models of gyros, one for each record, as calibrate and diagnose write them; "
                   "gyro_id is the unit, the effects' origin has the date")
      ->required();
  command
      ->add_option("--false-discovery-rate", options->false_discovery_rate,
                   "share of the findings that may be chance")
      ->check(CLI::Range(1e-6, 0.5))
      ->capture_default_str();
  command->add_option("--json", options->json, "file for all figures");
  command->footer(
      "A change needs records of two dates at least. Exit codes: 0 asked, whatever was found; 2 "
      "wrong usage or bad input.");
  command->callback([options, &run] { run = [options] { return history(*options); }; });
}

}  // namespace zerodrift::services
