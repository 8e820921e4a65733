// SPDX-License-Identifier: Apache-2.0
// What the publishers of rates and of temperatures have in common: a source that is the twin or a
// record, and the thread that publishes it.
#pragma once

#include <CLI/CLI.hpp>
#include <atomic>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "common/replay/record_source.h"
#include "common/service/host.h"
#include "common/twin/model.h"
#include "common/twin/profile.h"

namespace zerodrift::replay {

struct PublisherOptions {
  std::uint32_t gyro_id = 1;  // of a record with several, too
  std::string model{};        // simulation
  std::string profile{};
  std::uint64_t seed = 1;
  record::RecordInput record{};  // record
  double duration_s = 0.0;       // of both; 0: to the end
  std::string speed = "1";
  std::vector<std::string> wait_for{"compensation"};
};

// `of_gyro`: what --gyro-id is the key of.
void add_options(CLI::App& app, PublisherOptions& options, const std::string& of_gyro);

struct Experiment {
  twin::Model model{};
  twin::Profile profile{};
};
// Throws std::invalid_argument where a file isn't named, config::ConfigError where one is wrong.
[[nodiscard]] Experiment load_experiment(const PublisherOptions& options, const Warn& warn);

[[nodiscard]] RecordSourceOptions record_of(const PublisherOptions& options);

// Raises what is odd about a source as an event of the host.
[[nodiscard]] Warn warn_by(service::Host& host, std::uint32_t gyro_id);

// `publish` runs in a thread of its own until its source is over or `stopping` is set; the host
// meanwhile. The process ends with its source. Exit code: a source may turn out bad on the way.
int run_publisher(service::Host& host, std::uint32_t gyro_id, std::atomic<bool>& stopping,
                  const std::function<void()>& publish,
                  const std::function<service::Status()>& status);

}  // namespace zerodrift::replay
