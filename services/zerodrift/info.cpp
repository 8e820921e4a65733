// SPDX-License-Identifier: Apache-2.0
// zerodrift info: what a record holds, before anything is done with it.
#include <cstdio>
#include <string>

#include "common/files/atomic_file.h"
#include "common/mcap/mcap_reader.h"
#include "common/measurement/doubts_json.h"
#include "common/measurement/plausibility.h"
#include "common/record/record_reader.h"
#include "common/record/record_rows.h"
#include "common/report/json_object.h"
#include "common/report/numbers.h"
#include "common/service/main.h"
#include "services/zerodrift/commands.h"
#include "services/zerodrift/doubts.h"
#include "services/zerodrift/ending.h"
#include "services/zerodrift/info_mcap.h"
#include "services/zerodrift/progress_bar.h"
#include "services/zerodrift/record_options.h"

namespace zerodrift::services {
namespace {

constexpr std::uint64_t kRowsPerProgress = 1 << 16;

struct InfoOptions {
  record::RecordInput record;
  std::string json;
  Invocation made_by;
};

std::string axes(const core::PerAxis<bool>& has) {
  std::string names;
  for (const auto axis : core::kAxes) {
    if (has[core::index(axis)]) names += core::name(axis);
  }
  return names.empty() ? "none" : names;
}

// The whole record, read once.
struct Seen {
  record::RecordInfo record;
  std::vector<std::string> warnings;
  std::vector<measurement::Doubt> doubts;
  std::uint64_t rows = 0;
  double duration_s = 0.0;
};

Seen look_at(const InfoOptions& options) {
  ProgressBar bar("info");
  record::RecordOptions how = options.record.options();
  how.rates = record::Rates::kOptional;
  record::RecordReader reader(options.record.file, std::move(how));
  measurement::RecordWatch watch(reader.info(), options.record.columns);
  const std::optional<double> expected_rows = record::estimated_rows(options.record.file);
  while (const record::RecordRow* row = reader.next()) {
    static_cast<void>(watch.add(*row));
    if (expected_rows && watch.rows() % kRowsPerProgress == 0)
      bar.show(static_cast<double>(watch.rows()) / *expected_rows);
  }
  return {reader.info(), reader.warnings(), watch.doubts(), watch.rows(), watch.duration_s()};
}

nlohmann::ordered_json json_of(const Seen& seen) {
  const record::RecordInfo& record = seen.record;
  nlohmann::ordered_json json{{"file", record.path.string()},
                              {"columns", record.columns},
                              {"thermometers", record.probes},
                              {"sample_period_s", record.sample_period_s},
                              {"rows", seen.rows},
                              {"duration_s", seen.duration_s},
                              {"doubts", doubts_json(seen.doubts)},
                              {"warnings", seen.warnings}};
  for (const auto& [key, value] : record.metadata) report::object_at(json, "metadata")[key] = value;
  return json;
}

int info(const InfoOptions& options) {
  const EndsAtOnce on_signal;
  files::check_outputs({{"--record", options.record.file}}, {{"--json", options.json}});
  if (mcap::is_mcap(options.record.file) && !options.record.topics.any())
    return show_mcap(options.record.file, options.json, options.made_by);
  const Seen seen = look_at(options);
  const record::RecordInfo& record = seen.record;
  print_doubts(seen.doubts);
  std::string probes;
  for (const auto& probe : record.probes) probes += (probes.empty() ? "" : ", ") + probe;
  std::printf(
      "%s: rate axes %s, reference axes %s, thermometers %s, a sample every %g s, "
      "%llu rows over %s s\n",
      options.record.file.c_str(), axes(record.has_rate).c_str(),
      axes(record.has_reference).c_str(), probes.empty() ? "none" : probes.c_str(),
      record.sample_period_s, static_cast<unsigned long long>(seen.rows),
      report::significant(seen.duration_s, 3).c_str());
  for (const auto& line : seen.warnings) std::printf("%s\n", line.c_str());
  if (!options.json.empty()) {
    write_report({options.json, ""}, json_of(seen), {},
                 provenance_of(options.made_by, "", {options.record.file}));
  }
  return service::kExitDone;
}

}  // namespace

void add_info(CLI::App& app, Run& run, const Invocation& made_by) {
  auto* command = app.add_subcommand("info", "what a record holds");
  auto options = std::make_shared<InfoOptions>();
  options->made_by = made_by;
  command->add_option("record,--record", options->record.file, kRecordHelp)->required();
  add_columns(*command, options->record.columns);
  add_bag_topics(*command, options->record.topics);
  command->add_option("--json", options->json, "file for all figures");
  command->footer(
      "Exit codes: 0 it is whole; 1 an .mcap file was cut, is damaged or lacks messages; 2 no "
      "record.");
  command->callback([options, &run] { run = [options] { return info(*options); }; });
}

}  // namespace zerodrift::services
