// SPDX-License-Identifier: Apache-2.0
// zerodrift allan: what a record says of a gyro's noise, as a metrologist would have it.
#include <algorithm>
#include <cstdio>
#include <map>
#include <memory>
#include <stdexcept>

#include "common/files/atomic_file.h"
#include "common/service/main.h"
#include "common/service/one_of.h"
#include "services/zerodrift/allan_report.h"
#include "services/zerodrift/allan_run.h"
#include "services/zerodrift/commands.h"
#include "services/zerodrift/doubts.h"
#include "services/zerodrift/ending.h"
#include "services/zerodrift/paragraph.h"
#include "services/zerodrift/record_options.h"

namespace zerodrift::services {
namespace {

using allan::Statistic;

constexpr Statistic kStatistics[] = {Statistic::kOadev, Statistic::kAdev, Statistic::kMdev,
                                     Statistic::kTdev,  Statistic::kHdev, Statistic::kOhdev,
                                     Statistic::kTotdev};

struct AllanOptions {
  AllanRequest request;
  ReportFiles report;
  Invocation made_by;
};

std::map<std::string, Statistic> statistics_by_name() {
  std::map<std::string, Statistic> names;
  for (const Statistic statistic : kStatistics)
    names.emplace(std::string(allan::name(statistic)), statistic);
  return names;
}

void check(const AllanRequest& request) {
  const auto& asked = request.statistics;
  for (auto one = asked.begin(); one != asked.end(); ++one) {
    if (std::find(asked.begin(), one, *one) != one)
      throw std::invalid_argument("--statistic " + std::string(allan::name(*one)) +
                                  " is there twice; name each once");
  }
  if (!(request.confidence > 0.0 && request.confidence < 1.0))
    throw std::invalid_argument("--confidence " + std::to_string(request.confidence) +
                                " must be between 0 and 1, as .95");
}

int allan_command(const AllanOptions& options) {
  const EndsAtOnce on_signal;
  check(options.request);
  files::check_outputs({{"--record", options.request.record.file}},
                       {{"--json", options.report.json}, {"--html", options.report.html}});
  const AllanResult result = run_allan(options.request);
  if (options.report.any()) {
    write_report(
        options.report, allan_json(result), [&] { return allan_page(result); },
        provenance_of(options.made_by, "", {options.request.record.file}));
  }
  print_doubts(result.doubts);
  for (const auto& line : result.warnings) std::fprintf(stderr, "%s\n", line.c_str());
  print_paragraph(allan_advice(result));
  for (const report::Table& table : allan_tables(result))
    std::printf("%s\n", report::text_table(table).c_str());
  for (const std::string& note : allan_notes(result)) print_paragraph(note);
  return service::kExitDone;
}

}  // namespace

void add_allan(CLI::App& app, Run& run, const Invocation& made_by) {
  auto* command = app.add_subcommand("allan", "Allan deviation and noise coefficients of a record");
  auto options = std::make_shared<AllanOptions>();
  options->made_by = made_by;
  AllanRequest& request = options->request;
  command->add_option("--record", request.record.file, kRecordHelp)->required();
  add_reading(*command, request.record);
  command
      ->add_option("--statistic", request.statistics,
                   "of oadev, adev, mdev, tdev, hdev, ohdev and totdev, by commas")
      ->delimiter(',')
      ->transform(service::one_of(statistics_by_name()))
      ->option_text("NAME,... [oadev]");
  command->add_option("--taus", request.grid, "octave or quarter: cluster times an octave has")
      ->transform(service::one_of<allan::TauGrid>(
          {{"octave", allan::TauGrid::kOctave}, {"quarter", allan::TauGrid::kQuarterOctave}}))
      ->option_text("GRID [octave]");
  command->add_option("--confidence", request.confidence, "of the intervals")
      ->capture_default_str();
  command
      ->add_option("--memory", request.memory_mb,
                   "MB for the samples; a longer record goes through a cascade of fixed size")
      ->check(CLI::Range(0, 1'000'000))
      ->capture_default_str();
  command->add_option("--json", options->report.json, "file for all figures, in SI");
  command->add_option("--html", options->report.html, "file for a report with pictures");
  command->callback([options, &run] { run = [options] { return allan_command(*options); }; });
}

}  // namespace zerodrift::services
