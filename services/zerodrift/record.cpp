// SPDX-License-Identifier: Apache-2.0
// zerodrift record: the live compensated topic as a record.
#include <cstdio>
#include <mutex>
#include <optional>
#include <string>

#include "common/dds/conversions.h"
#include "common/service/host.h"
#include "common/service/main.h"
#include "common/service/replay_pacer.h"
#include "services/zerodrift/commands.h"
#include "services/zerodrift/compensated_csv.h"

namespace zerodrift::services {
namespace {

struct RecordOptions {
  dds::NetworkOptions network;
  std::uint32_t gyro_id = 1;
  std::string out;
  std::uint64_t samples = 0;
};

class Recorder {
 public:
  explicit Recorder(const RecordOptions& options)
      : options_(options),
        csv_(options.out),
        host_("recorder", options.network),
        progress_(host_.participant(), "recorder"),
        reader_(
            host_.participant(),
            [this](const msg::CompensatedRate& m, const dds::SampleOrigin&) { take(m); },
            host_.observer()) {}

  int run() {
    host_.run([this] { return status(); }, [this] { tick(); });
    const std::lock_guard lock(mutex_);
    done_ = true;
    csv_.commit();
    std::printf("%s: %llu samples\n", options_.out.c_str(),
                static_cast<unsigned long long>(taken_));
    const bool complete = options_.samples == 0 || taken_ >= options_.samples;
    const int exit_code = complete ? service::kExitDone : service::kExitNo;
    std::fflush(stdout);
    service::end_within(service::kStopWithin, exit_code);
    return exit_code;
  }

 private:
  static constexpr std::uint64_t kReportEvery = 32;

  void take(const msg::CompensatedRate& message) {
    if (message.gyro_id() != options_.gyro_id) return;
    const std::lock_guard lock(mutex_);
    if (done_ || (options_.samples > 0 && taken_ == options_.samples)) return;
    const auto sample = dds::from_message(message);
    csv_.write(sample);
    newest_ = sample.raw.sequence;
    ++taken_;
    if (core::is_paced_by_consumers(sample.raw.clock) && taken_ % kReportEvery == 0) report();
    if (taken_ == options_.samples) service::request_stop();
  }

  void report() { progress_.report(options_.gyro_id, newest_, core::kNever); }

  void tick() {
    progress_.announce();
    const std::lock_guard lock(mutex_);
    if (taken_ > 0) report();
  }

  service::Status status() {
    const std::lock_guard lock(mutex_);
    return {.state = taken_ > 0 ? service::State::kRunning : service::State::kWaiting,
            .summary = std::to_string(taken_) + " samples recorded",
            .metrics = {{"samples", "1", static_cast<double>(taken_)}}};
  }

  RecordOptions options_;
  std::mutex mutex_;
  CompensatedCsv csv_;
  std::uint64_t taken_ = 0;
  std::uint64_t newest_ = 0;
  bool done_ = false;
  service::Host host_;
  service::ReplayProgressReporter progress_;
  dds::Reader<msg::CompensatedRate> reader_;
};

}  // namespace

void add_record(CLI::App& app, Run& run) {
  auto* command = app.add_subcommand("record", "write the live compensated topic to a record");
  auto options = std::make_shared<RecordOptions>();
  service::add_network_options(*command, options->network);
  command->add_option("--gyro-id", options->gyro_id, "which gyro")->capture_default_str();
  command->add_option("--out", options->out, "record to write: .csv, .csv.gz or .csv.xz")
      ->required();
  command->add_option("--samples", options->samples, "stop after so many; without, at Ctrl-C");
  command->callback([options, &run] { run = [options] { return Recorder(*options).run(); }; });
}

}  // namespace zerodrift::services
