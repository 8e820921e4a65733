// SPDX-License-Identifier: Apache-2.0
// zerodrift replay: a record's rates, references, temperatures and environment onto the live
// topics.
#include <atomic>
#include <cstdio>
#include <exception>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "common/core/counted.h"
#include "common/record/record_reader.h"
#include "common/replay/rate_replay.h"
#include "common/replay/temperature_replay.h"
#include "common/service/main.h"
#include "common/service/time_option.h"
#include "services/zerodrift/commands.h"
#include "services/zerodrift/record_options.h"

namespace zerodrift::services {
namespace {

struct ReplayOptions {
  dds::NetworkOptions network{};
  replay::RecordSourceOptions source{};
  std::uint32_t as_gyro_id = 0;  // 0: the record's own; 1 for a CSV record
  std::string speed = "1";
  std::vector<std::string> wait_for{"compensation"};
};

std::uint32_t published_id(const ReplayOptions& options) {
  if (options.as_gyro_id != 0) return options.as_gyro_id;
  const auto info = record::inspect(options.source.record.file, options.source.record.options());
  return info.gyro_id != 0 ? info.gyro_id : 1;
}

class Replay {
 public:
  explicit Replay(const ReplayOptions& options)
      : gyro_id_(published_id(options)),
        host_("replay", options.network),
        rates_(host_, gyro_id_, options.speed, options.wait_for),
        temperatures_(host_, gyro_id_, options.speed, options.wait_for),
        rate_source_(replay::open_gyro_record(options.source, warn())),
        temperature_source_(replay::open_thermal_record(options.source, warn())) {}

  int run() {
    std::thread temperatures(
        [this] { guarded([this] { temperatures_.publish(temperature_source_, stopping_); }); });
    std::thread rates([this, &temperatures] {
      guarded([this] { rates_.publish(rate_source_, stopping_); });
      if (failed_) stopping_ = true;
      temperatures_.need_all();
      temperatures.join();
      if (failed_) host_.give_up(service::kExitBadInput);
      service::request_stop();
    });
    host_.run([this] { return status(); }, {},
              [this] { service::end_within(service::kStopWithin, exit_code()); });
    stopping_ = true;
    rates.join();
    std::printf("%llu samples, %llu readings replayed as gyro %u\n",
                static_cast<unsigned long long>(rates_.published()),
                static_cast<unsigned long long>(temperatures_.published()), gyro_id_);
    return exit_code();
  }

 private:
  replay::Warn warn() {
    return [this](const std::string& line) {
      host_.raise({.code = "record_warning",
                   .severity = service::Severity::kWarning,
                   .text = line,
                   .gyro_id = gyro_id_,
                   .sensor_time_ns = 0});
    };
  }

  template <typename Publish>
  void guarded(Publish&& publish) {
    try {
      publish();
    } catch (const std::exception& error) {
      failed_ = true;
      host_.raise({.code = "source_failed",
                   .severity = service::Severity::kError,
                   .text = error.what(),
                   .gyro_id = gyro_id_,
                   .sensor_time_ns = 0});
    }
  }

  [[nodiscard]] int exit_code() const {
    if (failed_) return service::kExitBadInput;
    return rates_.finished() ? service::kExitDone : service::kExitNo;
  }

  service::Status status() const {
    const std::uint64_t published = rates_.published();
    const std::string summary = core::counted(published, "sample") + " replayed";
    return {.state = published > 0 ? service::State::kRunning : service::State::kWaiting,
            .summary = summary,
            .parts = {{.name = std::to_string(gyro_id_),
                       .metrics = {{"samples_published", "1", static_cast<double>(published)},
                                   {"readings_published", "1",
                                    static_cast<double>(temperatures_.published())},
                                   {"finished", "1", rates_.finished() ? 1.0 : 0.0}},
                       .summary = summary}}};
  }

  std::uint32_t gyro_id_;
  service::Host host_;
  replay::RateReplay rates_;
  replay::TemperatureReplay temperatures_;
  replay::GyroSource rate_source_;
  replay::ThermalSource temperature_source_;
  std::atomic<bool> stopping_{false};
  std::atomic<bool> failed_{false};
};

}  // namespace

void add_replay(CLI::App& app, Run& run) {
  auto* command = app.add_subcommand(
      "replay", "publish a record's rates, references, temperatures and environment");
  auto options = std::make_shared<ReplayOptions>();
  service::add_network_options(*command, options->network);
  command->add_option("record,--record", options->source.record.file, kRecordHelp)->required();
  add_reading(*command, options->source.record);
  command->add_option("--speed", options->speed, "times real time: 60, 60x, or max")
      ->capture_default_str();
  command->add_option("--from", options->source.from_s, "begin so long after the first rate")
      ->transform(service::in_seconds_from_0());
  command->add_option("--to", options->source.to_s, "end so long after the first rate")
      ->transform(service::in_seconds_above_0());
  command
      ->add_option("--as-gyro-id", options->as_gyro_id,
                   "publish under this id; without, the recorded one, 1 of a CSV record")
      ->check(CLI::Range(1U, 4294967295U));
  command
      ->add_option("--wait-for", options->wait_for,
                   "consumers to keep pace with; none with an empty value")
      ->delimiter(',')
      ->capture_default_str();
  command->footer(
      "Exit codes: 0 all was replayed and taken; 1 stopped before; 2 wrong usage or bad input.");
  command->callback([options, &run] { run = [options] { return Replay(*options).run(); }; });
}

}  // namespace zerodrift::services
