// SPDX-License-Identifier: Apache-2.0
// What `diagnose` and `calibrate` have in common: options for axes and outputs, and handing a
// result out as text, JSON, page and model.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "common/files/atomic_file.h"
#include "services/zerodrift/diagnosis_run.h"
#include "services/zerodrift/provenance.h"

namespace zerodrift::services {

struct DiagnosisOutputs {
  std::string model;
  ReportFiles report;
  // What is said of the model that was written.
  std::string if_changed = "the repaired model";
  std::string if_unchanged = "the model as it was, nothing was changed";
};

void add_axis_option(CLI::App& command, std::vector<std::string>& axes);
[[nodiscard]] std::vector<core::Axis> axes_named(const std::vector<std::string>& names);
// --date, --json and --html.
void add_output_options(CLI::App& command, DiagnosisRequest& request, DiagnosisOutputs& outputs);

// Throws std::invalid_argument where an output is also an input.
void check_against(const std::vector<files::NamedFile>& inputs, const DiagnosisOutputs& outputs);
// Writes the files, then prints what fits a terminal.
void hand_out(const DiagnosisResult& result, const DiagnosisOutputs& outputs,
              const Provenance& provenance);

}  // namespace zerodrift::services
