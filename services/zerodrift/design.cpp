// SPDX-License-Identifier: Apache-2.0
// zerodrift design: the experiment that tells apart what a diagnosis could not.
#include <cstdio>
#include <memory>

#include "common/config/twin_config.h"
#include "common/files/atomic_file.h"
#include "common/report/plain_text.h"
#include "common/service/main.h"
#include "services/zerodrift/commands.h"
#include "services/zerodrift/design_run.h"
#include "services/zerodrift/ending.h"
#include "services/zerodrift/paragraph.h"

namespace zerodrift::services {
namespace {

struct DesignCommand {
  DesignRequest request;
  std::string out;
  std::string json;
  Invocation made_by;
};

void check_files(const DesignCommand& command) {
  std::vector<files::NamedFile> inputs{{"--model", command.request.model},
                                       {"--diagnosis", command.request.diagnosis},
                                       {"--limits", command.request.limits}};
  for (const std::string& file : command.request.against) inputs.push_back({"--against", file});
  files::check_outputs(inputs, {{"--out", command.out}, {"--json", command.json}});
}

int design(const DesignCommand& command) {
  const EndsAtOnce on_signal;
  check_files(command);
  const DesignResult result = run_design(command.request);
  for (const std::string& note : result.notes)
    std::fprintf(stderr, "%s\n", report::one_line(note).c_str());
  if (result.questions.empty()) {
    std::printf("%s leaves nothing to tell apart: no profile was written\n",
                report::one_line(command.request.diagnosis).c_str());
    return service::kExitDone;
  }
  const bool separates =
      result.design.inseparable.size() < result.design.judgement.separations.size();
  std::vector<std::string> inputs{command.request.model, command.request.diagnosis};
  inputs.insert(inputs.end(), command.request.against.begin(), command.request.against.end());
  const Provenance provenance = provenance_of(command.made_by, command.request.limits, inputs);
  write_report({command.json, ""}, design_json(command.request, result), {}, provenance);
  for (const std::string& sentence : design_sentences(result))
    print_paragraph(report::one_line(sentence));
  print_design_tables(result);
  if (!separates) {
    std::printf(
        "Nothing is expected to be told apart within these limits: no profile was written\n");
    return service::kExitDone;
  }
  config::save_profile(result.design.profile,
                       {"Designed by " + report::one_line(command.made_by.command_line)},
                       command.out);
  print_paragraph(report::one_line(command.out) +
                  ": the profile, for zerodrift simulate and for a chamber");
  return service::kExitDone;
}

}  // namespace

void add_design(CLI::App& app, Run& run, const Invocation& made_by) {
  auto* command = app.add_subcommand(
      "design", "compose the experiment that tells apart what a diagnosis could not");
  auto options = std::make_shared<DesignCommand>();
  options->made_by = made_by;
  DesignRequest& request = options->request;
  command->add_option("--model", request.model, "the model that was diagnosed")->required();
  command->add_option("--diagnosis", request.diagnosis, "what diagnose --json wrote")->required();
  command->add_option("--limits", request.limits, "what the laboratory can do, YAML or JSON")
      ->required();
  command->add_option("--out", options->out, "file for the profile")->required();
  command->add_option("--against", request.against,
                      "profiles to compare with, beside a menu of usual experiments");
  command->add_option("--seed", request.seed, "seed of the search and of all noise")
      ->capture_default_str();
  command
      ->add_option("--replicates", request.replicates,
                   "records of each explanation that are simulated and diagnosed, some seconds "
                   "each; 0: none")
      ->check(CLI::Range(0, 1000))
      ->capture_default_str();
  command->add_option("--json", options->json, "file for all figures");
  command->footer(
      "Exit codes: 0 a profile was written, or there is nothing that one could tell apart; 2 wrong "
      "usage or bad input.");
  command->callback([options, &run] { run = [options] { return design(*options); }; });
}

}  // namespace zerodrift::services
