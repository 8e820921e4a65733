// SPDX-License-Identifier: Apache-2.0
#include "common/replay/publisher.h"

#include <exception>
#include <stdexcept>
#include <thread>

#include "common/config/twin_config.h"
#include "common/service/main.h"
#include "common/service/time_option.h"

namespace zerodrift::replay {

using service::Severity;

void add_options(CLI::App& app, PublisherOptions& options, const std::string& of_gyro) {
  app.add_option("--gyro-id", options.gyro_id, of_gyro)
      ->check(CLI::Range(1U, 4294967295U))
      ->capture_default_str();
  app.add_option("--model", options.model, "simulation: the twin's model file");
  app.add_option("--profile", options.profile, "simulation: what the experiment does");
  app.add_option("--seed", options.seed, "simulation: seed of all noise")->capture_default_str();
  app.add_option(
      "--record", options.record.file,
      "record: a .csv (also .csv.gz, .csv.xz, .csv.zst) or .mcap file, or a bag of ROS 2 "
      "in MCAP, file or folder");
  app.add_option("--columns", options.record.columns, "record: names and units of a foreign CSV");
  app.add_option("--topic", options.record.topics.rates,
                 "record: of a ROS 2 bag, its topic of sensor_msgs/Imu, where there are several");
  app.add_option("--temperature-topic", options.record.topics.temperatures,
                 "record: of a ROS 2 bag, [PROBE=]TOPIC of sensor_msgs/Temperature (repeatable); "
                 "probe coil without a name")
      ->allow_extra_args(false);
  app.add_option("--duration", options.duration_s, "simulation, record: stop after so long")
      ->transform(service::in_seconds_above_0());
  app.add_option("--speed", options.speed, "simulation, record: times real time: 60, 60x, or max")
      ->capture_default_str();
  app.add_option("--wait-for", options.wait_for,
                 "simulation, record: consumers to keep pace with; none with an empty value")
      ->delimiter(',')
      ->capture_default_str();
}

Experiment load_experiment(const PublisherOptions& options, const Warn& warn) {
  if (options.model.empty())
    throw std::invalid_argument("--model: missing; a simulation needs a twin's model file");
  if (options.profile.empty())
    throw std::invalid_argument("--profile: missing; a simulation needs a profile file");
  const auto loaded = config::load_model(options.model);
  for (const auto& line : loaded.warnings) warn(line);
  Experiment experiment{loaded.model, config::load_profile(options.profile)};
  if (options.duration_s > 0.0) experiment.profile.duration_s = options.duration_s;
  return experiment;
}

RecordSourceOptions record_of(const PublisherOptions& options) {
  return {
      .record = options.record, .to_s = options.duration_s, .preferred_gyro_id = options.gyro_id};
}

Warn warn_by(service::Host& host, std::uint32_t gyro_id) {
  return [&host, gyro_id](const std::string& line) {
    host.raise({.code = "record_warning",
                .severity = Severity::kWarning,
                .text = line,
                .gyro_id = gyro_id,
                .sensor_time_ns = 0});
  };
}

int run_publisher(service::Host& host, std::uint32_t gyro_id, std::atomic<bool>& stopping,
                  const std::function<void()>& publish,
                  const std::function<service::Status()>& status) {
  std::thread publisher([&] {
    try {
      publish();
    } catch (const std::exception& error) {
      host.raise({.code = "source_failed",
                  .severity = Severity::kError,
                  .text = error.what(),
                  .gyro_id = gyro_id,
                  .sensor_time_ns = 0});
      host.give_up(service::kExitBadInput);
    }
    service::request_stop();
  });
  const auto end = [&] {
    stopping = true;
    publisher.join();
  };
  try {
    host.run(status, {}, [&] { service::end_within(service::kStopWithin, host.exit_code()); });
  } catch (...) {
    end();
    throw;
  }
  end();
  return host.exit_code();
}

}  // namespace zerodrift::replay
