// SPDX-License-Identifier: Apache-2.0
#include "services/zerodrift/diagnosis_output.h"

#include <cstdio>

#include "common/config/twin_config.h"
#include "common/diagnosis/unit_history.h"
#include "common/report/plain_text.h"
#include "services/zerodrift/diagnosis_report.h"
#include "services/zerodrift/doubts.h"
#include "services/zerodrift/paragraph.h"

namespace zerodrift::services {
namespace {

std::string check_date(const std::string& text) {
  if (diagnosis::is_date(text)) return {};
  return "found '" + text + "', expected a date as 2026-03-31";
}

}  // namespace

void add_axis_option(CLI::App& command, std::vector<std::string>& axes) {
  command.add_option("--axis", axes, "only these axes: x,y,z")
      ->delimiter(',')
      ->check(CLI::IsMember({"x", "y", "z"}));
}

std::vector<core::Axis> axes_named(const std::vector<std::string>& names) {
  std::vector<core::Axis> axes;
  for (const std::string& name : names) {
    for (const auto axis : core::kAxes) {
      if (core::name(axis) == name) axes.push_back(axis);
    }
  }
  return axes;
}

void add_output_options(CLI::App& command, DiagnosisRequest& request, DiagnosisOutputs& outputs) {
  command
      .add_option("--date", request.date,
                  "date that the model gives for the origin of what is new; today without")
      ->check(check_date);
  command.add_option("--json", outputs.report.json, "file for all figures");
  command.add_option("--html", outputs.report.html, "file for a report with pictures");
}

void check_against(const std::vector<files::NamedFile>& inputs, const DiagnosisOutputs& outputs) {
  files::check_outputs(inputs, {{"--out-model", outputs.model},
                                {"--json", outputs.report.json},
                                {"--html", outputs.report.html}});
}

void hand_out(const DiagnosisResult& result, const DiagnosisOutputs& outputs,
              const Provenance& provenance) {
  write_report(
      outputs.report, diagnosis_json(result), [&] { return diagnosis_page(result); }, provenance);
  if (!outputs.model.empty()) config::save_model(result.diagnosis.repaired, outputs.model);
  print_doubts(result.doubts);
  for (const auto& line : result.warnings)
    std::fprintf(stderr, "%s\n", report::one_line(line).c_str());
  for (const std::string& sentence : diagnosis_sentences(result))
    print_paragraph(report::one_line(sentence));
  for (const report::Table& table : diagnosis_tables(result))
    std::printf("%s\n", report::text_table(table).c_str());
  for (const std::string& note : diagnosis_notes(result)) print_paragraph(report::one_line(note));
  if (!outputs.model.empty()) {
    print_paragraph(
        outputs.model + ": " +
        (result.change == ModelChange::kRepaired ? outputs.if_changed : outputs.if_unchanged));
  }
  for (const std::string& sentence : provenance_sentences(provenance))
    print_paragraph(report::one_line(sentence));
  std::fflush(stdout);
}

}  // namespace zerodrift::services
