// SPDX-License-Identifier: Apache-2.0
// zerodrift record: the live compensated topic as a CSV record, or all topics as an MCAP file.
#include <algorithm>
#include <atomic>
#include <cstdio>
#include <filesystem>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>

#include "common/core/bounded_table.h"
#include "common/core/counted.h"
#include "common/dds/conversions.h"
#include "common/dds/raw_reader.h"
#include "common/files/atomic_file.h"
#include "common/recording/arrival_count.h"
#include "common/recording/compensated_csv.h"
#include "common/recording/discovery_complete.h"
#include "common/recording/recorder.h"
#include "common/service/host.h"
#include "common/service/main.h"
#include "common/service/monotonic_clock.h"
#include "common/service/replay_pacer.h"
#include "common/service/time_option.h"
#include "services/zerodrift/commands.h"
#include "services/zerodrift/ending.h"
#include "services/zerodrift/record_options.h"

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
        csv_(open(options.out)),
        host_("recorder", options.network),
        progress_(host_.participant(), "recorder"),
        reader_(
            host_.participant(),
            [this](const msg::CompensatedRate& message, dds::Bytes, const dds::WireOrigin& origin) {
              take(message, origin);
            },
            host_.observer(),
            [this](const recording::ArrivalCount::Writer& writer) {
              arrivals_.note_matched(writer);
            }) {}

  int run() {
    host_.run([this] { return status(); }, [this] { tick(); }, [this] { end_if_stalled(); });
    const std::lock_guard lock(mutex_);
    done_ = true;
    guarded([this] { csv_.commit(); });
    if (failure_) {
      const std::filesystem::path kept = csv_.keep();
      std::fprintf(stderr, "record: %s; %s\n", failure_->c_str(),
                   kept.empty() ? "nothing is kept"
                                : ("what was written before is in " + kept.string()).c_str());
    } else {
      std::printf("%s: %llu samples", options_.out.c_str(),
                  static_cast<unsigned long long>(taken_.load()));
      if (lost() > 0)
        std::printf(", %llu lost: they did not arrive", static_cast<unsigned long long>(lost()));
      std::printf("\n");
      if (const std::string fault = csv_.fault_of_times(); !fault.empty())
        std::fprintf(stderr, "%s\n", fault.c_str());
    }
    const bool complete =
        !failure_ && lost() == 0 && (options_.samples == 0 || taken_ >= options_.samples);
    const int exit_code = complete ? service::kExitDone : service::kExitNo;
    service::end_within(service::kStopWithin, exit_code);
    return exit_code;
  }

 private:
  static constexpr std::uint64_t kReportEvery = 32;

  // A pipe waits for its reader.
  static recording::CompensatedCsv open(const std::string& out) {
    const EndsAtOnce on_signal;
    return recording::CompensatedCsv(out);
  }

  // Writes, unless that failed before; a failure ends the recording.
  template <typename Action>
  void guarded(Action&& write) {
    if (failure_) return;
    try {
      write();
    } catch (const std::exception& error) {
      failure_ = error.what();
      service::request_stop();
    }
  }

  void take(const msg::CompensatedRate& message, const dds::WireOrigin& origin) {
    const std::lock_guard lock(mutex_);
    // What comes from then on is not asked for.
    if (done_ || failure_ || (options_.samples > 0 && taken_ == options_.samples)) return;
    arrivals_.note_answer(
        origin.writer, origin.number,
        {message.gyro_id(), message.run_id(), message.sequence_number(), origin.is_repeat});
    if (origin.is_repeat) return;
    const auto sample = dds::from_message(message);
    if (message.gyro_id() != options_.gyro_id) return note_progress(message.gyro_id(), sample.raw);
    guarded([&] { csv_.write(sample); });
    if (failure_) return;
    ++taken_;
    note_progress(options_.gyro_id, sample.raw);
    if (taken_ == options_.samples) service::request_stop();
  }

  // A pipe may never take what is under way; a file must get it.
  void end_if_stalled() const {
    std::error_code error;
    const auto status = std::filesystem::status(options_.out, error);
    if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status))
      service::end_within(service::kStopWithin, service::kExitNo);
  }

  // A replay waits for who is named, whichever gyro's is recorded.
  void note_progress(std::uint32_t gyro_id, const core::AngularRateSample& sample) {
    if (!core::is_paced_by_consumers(sample.clock)) return;
    const std::lock_guard lock(progress_mutex_);
    Progress* known = progress_of_.find_or_make(gyro_id);
    if (known == nullptr) return;
    known->newest = sample.sequence;
    if (++known->samples % kReportEvery == 0)
      progress_.report(gyro_id, known->newest, core::kNever);
  }

  void report_progress() {
    const std::lock_guard lock(progress_mutex_);
    for (const auto& [gyro_id, known] : progress_of_.entries())
      progress_.report(gyro_id, known.newest, core::kNever);
  }

  void tick() {
    progress_.announce();
    report_progress();
    if (!has_begun_ && discovery_.note(host_.participant().acquaintance(), reader_.matched(),
                                       service::monotonic_ns())) {
      arrivals_.begin();
      has_begun_ = true;
      std::printf("recording to %s\n", options_.out.c_str());
      std::fflush(stdout);
    }
    // A hole may be filled by another instance's answers, so the count may shrink.
    const std::uint64_t lost_now = std::max(lost(), reported_lost_);
    host_.raise_counted({.code = "recording_incomplete",
                         .severity = service::Severity::kWarning,
                         .text = recording::kDidNotArrive,
                         .gyro_id = options_.gyro_id,
                         .sensor_time_ns = 0},
                        lost_now - reported_lost_);
    reported_lost_ = lost_now;
  }

  [[nodiscard]] std::uint64_t lost() const { return arrivals_.missing_of(options_.gyro_id); }

  service::Status status() {
    return {.state = taken_ > 0 ? service::State::kRunning : service::State::kWaiting,
            .summary = core::counted(taken_, "sample") + " recorded",
            .metrics = {{"samples", "1", static_cast<double>(taken_)},
                        {"messages_lost", "1", static_cast<double>(lost())}}};
  }

  struct Progress {
    std::uint64_t newest = 0;
    std::uint64_t samples = 0;
  };

  RecordOptions options_;
  std::mutex mutex_;
  recording::CompensatedCsv csv_;
  std::atomic<std::uint64_t> taken_{0};  // read without the mutex, which a stalled pipe holds up
  bool done_ = false;
  std::optional<std::string> failure_;  // of the disk
  recording::ArrivalCount arrivals_;
  recording::DiscoveryComplete discovery_;  // these three: of the status thread
  bool has_begun_ = false;
  std::uint64_t reported_lost_ = 0;
  service::Host host_;
  std::mutex progress_mutex_;
  core::BoundedTable<std::uint32_t, Progress> progress_of_{256};  // by gyro
  service::ReplayProgressReporter progress_;
  dds::RawReader<msg::CompensatedRate> reader_;
};

// The options of the command line; those of MCAP files alone are kept as they are used.
struct RecordArguments {
  RecordOptions csv;
  recording::McapRecordOptions mcap;
  double chunk_kb = 1024.0;
  double split_mb = 0.0;
  double split_s = 0.0;
  double queue_mb = 64.0;
  CLI::Option* gyro_id = nullptr;
  std::vector<CLI::Option*> only_mcap;
};

// What was recorded can't be recorded again.
void refuse_finished(const std::string& out) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(out, error)) return;
  throw std::invalid_argument(
      "--out: " + out +
      ": is there, and a recording is not written over; expected another name, or move it away");
}

int record(const RecordArguments& arguments) {
  std::vector<files::NamedFile> attached;
  for (const auto& file : arguments.mcap.disk.file.attachments)
    attached.push_back({"--attach", file});
  files::check_outputs(attached, {{"--out", arguments.csv.out}});
  if (!arguments.csv.out.ends_with(".mcap")) {
    for (const auto* option : arguments.only_mcap) {
      if (option->count() == 0) continue;
      throw std::invalid_argument(option->get_name() +
                                  ": is for recordings, so --out must end in .mcap");
    }
    return Recorder(arguments.csv).run();
  }
  recording::McapRecordOptions options = arguments.mcap;
  options.network = arguments.csv.network;
  options.samples = arguments.csv.samples;
  if (arguments.gyro_id->count() > 0) options.gyro_id = arguments.csv.gyro_id;
  options.queue_bytes = static_cast<std::size_t>(1e6 * arguments.queue_mb);
  options.disk.file.out = arguments.csv.out;
  options.disk.file.writer.chunk_bytes = static_cast<std::size_t>(1024.0 * arguments.chunk_kb);
  options.disk.file.split_bytes = static_cast<std::uint64_t>(1e6 * arguments.split_mb);
  options.disk.file.split_ns = static_cast<std::int64_t>(1e9 * arguments.split_s);
  if (options.disk.pre_trigger_s > 0.0)
    options.disk.file.opening = recording::Opening::kWithTheFirstMessage;
  options.disk.file.is_numbered = options.disk.file.split_bytes > 0 ||
                                  options.disk.file.split_ns > 0 ||
                                  options.disk.pre_trigger_s > 0.0;
  options.disk.file.metadata = {
      {"domain", std::to_string(options.network.domain)},
      {"log_time", "Unix time of arrival at the recorder, ns"},
      {"publish_time", "sensor time where the message has one above 0, else log_time"},
      {"sequence", "the low 32 bits of sequence_number where the message has one"}};
  if (!options.disk.file.is_numbered) refuse_finished(arguments.csv.out);
  return recording::record_mcap(options);
}

void add_mcap_options(CLI::App& command, RecordArguments& arguments) {
  recording::McapRecordOptions& mcap = arguments.mcap;
  arguments.only_mcap = {
      command.add_option("--topics", mcap.topics, ".mcap: these alone, by commas; all without")
          ->delimiter(','),
      command
          .add_option("--duration", mcap.duration_s,
                      ".mcap: stop so long after \"recording to ...\"")
          ->transform(service::in_seconds_above_0()),
      add_compression(command, mcap.disk.file.writer.compression),
      command.add_option("--chunk-size", arguments.chunk_kb, ".mcap: kB of a chunk, uncompressed")
          ->check(CLI::Range(1.0, 65536.0))
          ->capture_default_str(),
      command
          .add_option("--split-size", arguments.split_mb,
                      ".mcap: a new file every so many MB: <out>_0001.mcap, ...")
          ->check(CLI::Range(0.01, 1e6)),
      command.add_option("--split-duration", arguments.split_s, ".mcap: a new file every so often")
          ->transform(service::in_seconds())
          ->check(CLI::Range(0.1, 1e7)),
      command
          .add_option("--pre-trigger", mcap.disk.pre_trigger_s,
                      ".mcap: keep so long in memory and write it when an event of severity "
                      "warning or error comes")
          ->transform(service::in_seconds())
          ->check(CLI::Range(0.1, 86400.0)),
      service::show_default_in("s", command
                                        .add_option("--post-trigger", mcap.disk.post_trigger_s,
                                                    ".mcap: and so long after it")
                                        ->transform(service::in_seconds())
                                        ->check(CLI::Range(0.0, 86400.0))),
      command.add_option("--trigger", mcap.trigger, ".mcap: events of this code alone"),
      command.add_option("--attach", mcap.disk.file.attachments,
                         ".mcap: a file that belongs to the recording (repeatable)"),
      command.add_option("--attach-checkpoint", mcap.disk.file.checkpoint_dir,
                         ".mcap: the compensation's --checkpoint-dir; the newest of each gyro at "
                         "begin and end"),
      command.add_option("--queue", arguments.queue_mb, ".mcap: MB that may wait for the disk")
          ->check(CLI::Range(0.01, 65536.0))
          ->capture_default_str()};
}

}  // namespace

void add_record(CLI::App& app, Run& run) {
  auto* command = app.add_subcommand(
      "record", "write the live compensated topic to a CSV record, or all topics to an MCAP file");
  auto options = std::make_shared<RecordArguments>();
  service::add_network_options(*command, options->csv.network);
  options->gyro_id =
      command->add_option("--gyro-id", options->csv.gyro_id, "which gyro; .mcap: all without")
          ->capture_default_str();
  command->add_option("--out", options->csv.out, "file to write: .csv, .csv.gz, .csv.xz or .mcap")
      ->required();
  command->add_option("--samples", options->csv.samples,
                      "stop after so many compensated samples; without, at Ctrl-C");
  add_mcap_options(*command, *options);
  command->callback([options, &run] { run = [options] { return record(*options); }; });
}

}  // namespace zerodrift::services
