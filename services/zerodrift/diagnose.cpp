// SPDX-License-Identifier: Apache-2.0
// zerodrift diagnose: where twin and measurement disagree, what is missing, and the repaired twin.
// Every honest verdict is exit code 0; what it is stands in the JSON.
#include <cstdio>
#include <memory>
#include <stdexcept>

#include "common/config/twin_config.h"
#include "common/files/atomic_file.h"
#include "common/record/record_reader.h"
#include "common/report/numbers.h"
#include "common/service/main.h"
#include "common/service/monotonic_clock.h"
#include "common/service/time_option.h"
#include "services/zerodrift/commands.h"
#include "services/zerodrift/diagnosis_live.h"
#include "services/zerodrift/diagnosis_output.h"
#include "services/zerodrift/diagnosis_run.h"
#include "services/zerodrift/ending.h"
#include "services/zerodrift/record_options.h"
#include "services/zerodrift/twin_report.h"

namespace zerodrift::services {
namespace {

constexpr double kShortestS = 600.0;  // that a diagnosis can be made of

struct DiagnoseOptions {
  DiagnosisRequest request;
  bool live = false;
  bool publish = false;
  LiveOptions listening;
  std::vector<std::string> axes;
  DiagnosisOutputs outputs;
  Invocation made_by;
};

void check_outputs(const DiagnoseOptions& options) {
  std::vector<files::NamedFile> inputs{{"--model", options.request.model}};
  if (!options.live) inputs.push_back({"--record", options.request.record.file});
  for (const std::string& file : options.request.validation) inputs.push_back({"--validate", file});
  check_against(inputs, options.outputs);
}

// Better known before listening for an hour than after.
void check_inputs(const DiagnoseOptions& options) {
  if (options.live != options.request.record.file.empty()) {
    throw std::invalid_argument(options.live
                                    ? "--record: found beside --live, expected one of both"
                                    : "--record: missing; name a record, or listen with --live");
  }
  if (!options.live) return;
  if (!(options.listening.duration_s >= kShortestS)) {
    throw std::invalid_argument("--duration: found " +
                                report::significant(options.listening.duration_s, 3) +
                                " s, expected at least 600 s: less says nothing of drift");
  }
  static_cast<void>(config::load_model(options.request.model));
  for (const std::string& file : options.request.validation)
    static_cast<void>(record::inspect(file, options.request.record.options()));
}

int publish_result(const DiagnoseOptions& options, const DiagnosisResult& result) {
  const std::int64_t now = service::unix_time_ns();
  const auto published =
      publish(finding(result, options.listening.gyro_id, 0, now), options.listening.network);
  if (published == Publication::kReceived) return service::kExitDone;
  std::fprintf(stderr, "diagnose --publish: nobody in domain %u subscribes to twin_report\n",
               options.listening.network.domain);
  return service::kExitNo;
}

// The model is the configuration of a diagnosis.
Provenance diagnosis_provenance(const DiagnoseOptions& options) {
  std::vector<std::string> records = options.request.validation;
  if (!options.live) records.insert(records.begin(), options.request.record.file);
  return provenance_of(options.made_by, options.request.model, records);
}

DiagnosisResult diagnosed(const DiagnoseOptions& options) {
  const EndsAtOnce on_signal;
  DiagnosisResult result = run_diagnosis(options.request);
  hand_out(result, options.outputs, diagnosis_provenance(options));
  return result;
}

int diagnose(DiagnoseOptions options) {
  options.request.axes = axes_named(options.axes);
  if (options.request.date.empty()) options.request.date = today();
  check_outputs(options);
  check_inputs(options);
  if (options.live) {
    LiveDiagnosis live(options.request, options.listening);
    live.run([&options](const DiagnosisResult& result) {
      hand_out(result, options.outputs, diagnosis_provenance(options));
    });
    service::end_within(service::kStopWithin, service::kExitDone);
    return service::kExitDone;
  }
  const DiagnosisResult result = diagnosed(options);
  return options.publish ? publish_result(options, result) : service::kExitDone;
}

}  // namespace

void add_diagnose(CLI::App& app, Run& run, const Invocation& made_by) {
  auto* command = app.add_subcommand(
      "diagnose", "find where twin and measurement disagree, name what is missing, repair, prove");
  auto options = std::make_shared<DiagnoseOptions>();
  options->made_by = made_by;
  DiagnosisRequest& request = options->request;
  command->add_option("--model", request.model, "the twin's model file")->required();
  command->add_option("--record", request.record.file, kRecordHelp);
  auto* live = command->add_flag(
      "--live", options->live,
      "in place of a record: what a running system publishes; Ctrl-C diagnoses what "
      "was received so far");
  service::show_default_in("s", command
                                    ->add_option("--duration", options->listening.duration_s,
                                                 "with --live: listen for so long, in sensor time")
                                    ->transform(service::in_seconds_above_0())
                                    ->needs(live));
  command->add_flag("--publish", options->publish,
                    "with --record: tell a running system, so that its console shows the finding; "
                    "--live always does");
  const auto* gyro_id = command
                            ->add_option("--gyro-id", options->listening.gyro_id,
                                         "with --live and --publish: which gyro; of .mcap files: "
                                         "which, where there are several")
                            ->capture_default_str();
  service::add_network_options(*command, options->listening.network);
  add_columns(*command, request.record.columns);
  add_bag_topics(*command, request.record.topics);
  command->add_option(
      "--validate", request.validation,
      "records that the repair is proved on, read as --record is; without, blocks of it");
  add_axis_option(*command, options->axes);
  command->add_option("--out-model", options->outputs.model,
                      "file for the repaired model; if nothing is repaired, the model as it was");
  add_output_options(*command, request, options->outputs);
  command->footer(
      "Exit codes: 0 diagnosed, whatever the verdict; 1 nobody received --publish; 2 wrong usage "
      "or bad input.");
  command->callback([options, gyro_id, &run] {
    options->request.record.gyro_id = chosen_gyro(*gyro_id);
    run = [options] { return diagnose(*options); };
  });
}

}  // namespace zerodrift::services
