// SPDX-License-Identifier: Apache-2.0
// zerodrift diagnose: where twin and measurement disagree, what is missing, and the repaired twin.
// Every honest verdict is exit code 0; what it is stands in the JSON.
#include <chrono>
#include <cstdio>
#include <map>
#include <memory>
#include <stdexcept>
#include <utility>

#include "common/config/twin_config.h"
#include "common/files/atomic_file.h"
#include "common/record/record_reader.h"
#include "common/report/json_file.h"
#include "common/report/numbers.h"
#include "common/report/plain_text.h"
#include "common/service/main.h"
#include "common/service/monotonic_clock.h"
#include "services/zerodrift/commands.h"
#include "services/zerodrift/diagnosis_live.h"
#include "services/zerodrift/diagnosis_report.h"
#include "services/zerodrift/diagnosis_run.h"
#include "services/zerodrift/ending.h"
#include "services/zerodrift/paragraph.h"
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
  std::string out_model;
  std::string json;
  std::string html;
};

std::string today() {
  using std::chrono::floor;
  const std::chrono::sys_time<std::chrono::nanoseconds> now{
      std::chrono::nanoseconds(service::unix_time_ns())};
  const std::chrono::year_month_day date{floor<std::chrono::days>(now)};
  char text[32];
  std::snprintf(text, sizeof text, "%04d-%02u-%02u", static_cast<int>(date.year()),
                static_cast<unsigned>(date.month()), static_cast<unsigned>(date.day()));
  return text;
}

std::string check_date(const std::string& text) {
  int year = 0;
  unsigned month = 0;
  unsigned day = 0;
  int used = 0;
  const bool read = std::sscanf(text.c_str(), "%4d-%2u-%2u%n", &year, &month, &day, &used) == 3 &&
                    text.size() == 10 && used == 10;
  const std::chrono::year_month_day date{std::chrono::year(year), std::chrono::month(month),
                                         std::chrono::day(day)};
  if (read && date.ok()) return {};
  return "found '" + text + "', expected a date as 2026-03-31";
}

void check_outputs(const DiagnoseOptions& options) {
  std::vector<files::NamedFile> inputs{{"--model", options.request.model}};
  if (!options.live) inputs.push_back({"--record", options.request.record});
  for (const std::string& file : options.request.validation) inputs.push_back({"--validate", file});
  files::check_outputs(
      inputs,
      {{"--out-model", options.out_model}, {"--json", options.json}, {"--html", options.html}});
}

// Better known before listening for an hour than after.
void check_inputs(const DiagnoseOptions& options) {
  if (options.live != options.request.record.empty()) {
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
    static_cast<void>(record::inspect(file, {.gyro_id = options.request.gyro_id}));
}

void take(const DiagnoseOptions& options, const DiagnosisResult& result) {
  if (!options.json.empty()) report::write_json(options.json, diagnosis_json(result));
  if (!options.html.empty()) report::write_html(options.html, diagnosis_page(result));
  if (!options.out_model.empty()) config::save_model(result.diagnosis.repaired, options.out_model);
  for (const auto& line : result.warnings)
    std::fprintf(stderr, "%s\n", report::one_line(line).c_str());
  for (const std::string& sentence : diagnosis_sentences(result))
    print_paragraph(report::one_line(sentence));
  for (const report::Table& table : diagnosis_tables(result))
    std::printf("%s\n", report::text_table(table).c_str());
  for (const std::string& note : diagnosis_notes(result)) print_paragraph(report::one_line(note));
  if (!options.out_model.empty()) {
    print_paragraph(options.out_model + (result.change == ModelChange::kRepaired
                                             ? ": the repaired model"
                                             : ": the model as it was, nothing was changed"));
  }
  std::fflush(stdout);
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

DiagnosisResult diagnosed(const DiagnoseOptions& options) {
  const EndsAtOnce on_signal;
  DiagnosisResult result = run_diagnosis(options.request);
  take(options, result);
  return result;
}

int diagnose(DiagnoseOptions options) {
  for (const std::string& name : options.axes) {
    for (const auto axis : core::kAxes) {
      if (core::name(axis) == name) options.request.axes.push_back(axis);
    }
  }
  if (options.request.date.empty()) options.request.date = today();
  check_outputs(options);
  check_inputs(options);
  if (options.live) {
    LiveDiagnosis live(options.request, options.listening);
    live.run([&options](const DiagnosisResult& result) { take(options, result); });
    service::end_within(service::kStopWithin, service::kExitDone);
    return service::kExitDone;
  }
  const DiagnosisResult result = diagnosed(options);
  return options.publish ? publish_result(options, result) : service::kExitDone;
}

}  // namespace

void add_diagnose(CLI::App& app, Run& run) {
  auto* command = app.add_subcommand(
      "diagnose", "find where twin and measurement disagree, name what is missing, repair, prove");
  auto options = std::make_shared<DiagnoseOptions>();
  DiagnosisRequest& request = options->request;
  command->add_option("--model", request.model, "the twin's model file")->required();
  command->add_option("--record", request.record, kRecordHelp);
  command->add_flag("--live", options->live,
                    "in place of a record: what a running system publishes; Ctrl-C diagnoses what "
                    "was heard so far");
  command
      ->add_option("--duration", options->listening.duration_s,
                   "with --live: listen for so long, in sensor time: 90min, 5h; s without a unit")
      ->transform(CLI::AsNumberWithUnit(
          std::map<std::string, double>{{"s", 1.0}, {"min", 60.0}, {"h", 3600.0}}))
      ->capture_default_str();
  command->add_flag("--publish", options->publish,
                    "with --record: tell a running system, so that its console shows the finding; "
                    "--live always does");
  const auto* gyro_id = command
                            ->add_option("--gyro-id", options->listening.gyro_id,
                                         "with --live and --publish: which gyro; of .mcap files: "
                                         "which, where there are several")
                            ->capture_default_str();
  service::add_network_options(*command, options->listening.network);
  command->add_option("--columns", request.columns,
                      "names and units of a foreign CSV; of all records");
  command->add_option("--validate", request.validation,
                      "records that the repair is proved on; without, blocks of the record");
  command->add_option("--axis", options->axes, "only these axes: x,y,z")
      ->delimiter(',')
      ->check(CLI::IsMember({"x", "y", "z"}));
  command
      ->add_option("--date", request.date,
                   "date that the repaired model gives for its origin; today without")
      ->check(check_date);
  command->add_option("--out-model", options->out_model,
                      "file for the repaired model; if nothing is repaired, the model as it was");
  command->add_option("--json", options->json, "file for all figures");
  command->add_option("--html", options->html, "file for a report with pictures");
  command->footer(
      "Exit codes: 0 diagnosed, whatever the verdict; 1 nobody heard --publish; 2 wrong usage or "
      "bad input.");
  command->callback([options, gyro_id, &run] {
    options->request.gyro_id = chosen_gyro(*gyro_id);
    run = [options] { return diagnose(*options); };
  });
}

}  // namespace zerodrift::services
