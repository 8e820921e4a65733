// SPDX-License-Identifier: Apache-2.0
// zerodrift simulate: the twin's record of a profile, as a file.
#include <cstdio>
#include <functional>
#include <string>

#include "common/evaluation/simulated_record.h"
#include "common/files/atomic_file.h"
#include "common/service/main.h"
#include "common/service/time_option.h"
#include "services/zerodrift/commands.h"
#include "services/zerodrift/ending.h"
#include "services/zerodrift/write_progress.h"

namespace zerodrift::services {
namespace {

struct SimulateOptions {
  std::string model;
  std::string profile;
  double duration_s = 0.0;
  double rate_hz = 0.0;
  std::uint64_t seed = 1;
  std::string out;
  bool reference = false;
};

int simulate(const SimulateOptions& options) {
  const EndsAtOnce on_signal;
  files::check_outputs({{"--model", options.model}, {"--profile", options.profile}},
                       {{"--out", options.out}});
  evaluation::SimulatedRecord record = evaluation::load_simulation(options.model, options.profile);
  for (const auto& line : record.warnings) std::fprintf(stderr, "%s\n", line.c_str());
  if (options.duration_s > 0.0) record.profile.duration_s = options.duration_s;
  if (options.rate_hz > 0.0) record.rate_hz = options.rate_hz;
  record.seed = options.seed;
  record.has_reference = options.reference;
  WriteProgress progress("simulating", options.out);
  const std::uint64_t rows = write_simulation(record, options.out, std::ref(progress));
  std::printf("%s: %llu samples at %g Hz\n", options.out.c_str(),
              static_cast<unsigned long long>(rows), record.rate_hz);
  return service::kExitDone;
}

}  // namespace

void add_simulate(CLI::App& app, Run& run) {
  auto* command = app.add_subcommand("simulate", "write the twin's record of a profile");
  auto options = std::make_shared<SimulateOptions>();
  command->add_option("--model", options->model, "the twin's model file")->required();
  command->add_option("--profile", options->profile, "what the experiment does")->required();
  command->add_option("--duration", options->duration_s, "how long; the profile's without")
      ->transform(service::in_seconds_above_0());
  command->add_option("--rate", options->rate_hz, "sample rate; the model's nominal rate without")
      ->transform(service::in_hertz());
  command->add_option("--seed", options->seed, "seed of all noise")->capture_default_str();
  command->add_option("--out", options->out, "record to write: .csv, .csv.gz or .csv.xz")
      ->required();
  command->add_flag("--reference", options->reference, "with the true rate as reference columns");
  command->callback([options, &run] { run = [options] { return simulate(*options); }; });
}

}  // namespace zerodrift::services
