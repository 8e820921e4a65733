// SPDX-License-Identifier: Apache-2.0
// zerodrift info: what a record holds, before anything is done with it.
#include <cstdio>
#include <string>

#include "common/record/record_reader.h"
#include "common/service/main.h"
#include "services/zerodrift/commands.h"

namespace zerodrift::services {
namespace {

struct InfoOptions {
  std::string record;
  std::string columns;
};

std::string axes(const core::PerAxis<bool>& has) {
  std::string names;
  for (const auto axis : core::kAxes) {
    if (has[core::index(axis)]) names += core::name(axis);
  }
  return names.empty() ? "none" : names;
}

int info(const InfoOptions& options) {
  const auto record =
      record::inspect(options.record, {.columns = record::parse_column_map(options.columns)});
  std::string probes;
  for (const auto& probe : record.probes) probes += (probes.empty() ? "" : ", ") + probe;
  std::printf("%s: rate axes %s, reference axes %s, thermometers %s, a sample every %g s\n",
              options.record.c_str(), axes(record.has_rate).c_str(),
              axes(record.has_reference).c_str(), probes.empty() ? "none" : probes.c_str(),
              record.sample_period_s);
  for (const auto& line : record.warnings) std::printf("%s\n", line.c_str());
  return service::kExitDone;
}

}  // namespace

void add_info(CLI::App& app, Run& run) {
  auto* command = app.add_subcommand("info", "what a record holds");
  auto options = std::make_shared<InfoOptions>();
  command->add_option("--record", options->record, "a .csv, .csv.gz or .csv.xz file")->required();
  command->add_option("--columns", options->columns, "names and units of a foreign CSV");
  command->callback([options, &run] { run = [options] { return info(*options); }; });
}

}  // namespace zerodrift::services
