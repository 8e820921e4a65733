// SPDX-License-Identifier: Apache-2.0
// zerodrift export: a recording (MCAP) as a CSV record, a CSV record as a recording, and what is
// attached to a recording.
#include <cstdio>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>

#include "common/dds/topics.h"
#include "common/files/atomic_file.h"
#include "common/record/bag_files.h"
#include "common/recording/record_export.h"
#include "common/service/main.h"
#include "services/zerodrift/commands.h"
#include "services/zerodrift/ending.h"
#include "services/zerodrift/record_options.h"
#include "services/zerodrift/write_progress.h"

namespace zerodrift::services {
namespace {

const std::string kRates(dds::kAngularRate.name);
const std::string kCompensated(dds::kCompensatedRate.name);

struct ExportOptions {
  recording::ExportRequest request{};
  std::string topic = kRates;
  std::string attachment{};
};

recording::ExportResult convert(const ExportOptions& options) {
  const bool to_mcap = options.request.to.extension() == ".mcap";
  const bool is_mcap = record::is_mcap_record(options.request.from.file);
  if (to_mcap == is_mcap) {
    throw std::invalid_argument(options.request.from.file + ": is " +
                                (is_mcap ? "an MCAP file" : "no MCAP file") +
                                (is_mcap ? ", expected --out to be .csv, .csv.gz or .csv.xz"
                                         : ", expected --out to be .mcap"));
  }
  WriteProgress progress("export", options.request.to);
  if (to_mcap) return import_record(options.request, std::ref(progress));
  if (options.topic == kCompensated) return export_compensated(options.request, std::ref(progress));
  recording::ExportRequest request = options.request;
  if (options.topic != kRates) request.from.topics.rates = options.topic;
  return export_record(request, std::ref(progress));
}

int run_export(const ExportOptions& options) {
  const EndsAtOnce on_signal;
  files::check_outputs({{"--record", options.request.from.file}}, {{"--out", options.request.to}});
  if (!options.attachment.empty()) {
    recording::export_attachment(options.request.from.file, options.attachment, options.request.to);
    return service::kExitDone;
  }
  const recording::ExportResult result = convert(options);
  for (const auto& line : result.warnings) std::fprintf(stderr, "%s\n", line.c_str());
  std::printf("%s: %llu rows\n", options.request.to.c_str(),
              static_cast<unsigned long long>(result.rows));
  return service::kExitDone;
}

}  // namespace

void add_export(CLI::App& app, Run& run) {
  auto* command = app.add_subcommand(
      "export", "a recording (.mcap) as a CSV record or the other way round; its attachments");
  auto options = std::make_shared<ExportOptions>();
  command->add_option("record,--record", options->request.from.file, kRecordHelp)->required();
  command
      ->add_option("--out", options->request.to,
                   "of a recording .csv, .csv.gz or .csv.xz; of a CSV record .mcap")
      ->required();
  command
      ->add_option(
          "--topic", options->topic,
          "angular_rate: with references, environment and temperatures, a row for each time; "
          "compensated_rate: as `record` and `compensate` write it; of a ROS 2 bag its "
          "topic of sensor_msgs/Imu, where there are several")
      ->capture_default_str();
  add_columns(*command, options->request.from.columns);
  add_temperature_topics(*command, options->request.from.topics);
  add_gyro_choice(*command, options->request.from.gyro_id);
  add_compression(*command, options->request.compression);
  command->add_option("--attachment", options->attachment,
                      "write this attachment instead; `info` names them");
  command->callback([options, &run] { run = [options] { return run_export(*options); }; });
}

}  // namespace zerodrift::services
