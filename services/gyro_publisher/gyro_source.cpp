// SPDX-License-Identifier: Apache-2.0
#include "services/gyro_publisher/gyro_source.h"

#include <memory>

#include "common/twin/simulation.h"

namespace zerodrift::services {
namespace {

using replay::Warn;

GyroSource open_simulation(const GyroSourceOptions& options, const Warn& warn) {
  const auto [model, profile] = replay::load_experiment(options.publisher, warn);
  const double rate_hz = options.rate_hz > 0.0 ? options.rate_hz : model.nominal_rate_hz;
  auto simulation =
      std::make_shared<twin::GyroSimulation>(model, profile, options.publisher.seed, rate_hz);
  return [simulation]() -> std::optional<GyroReading> {
    auto sample = simulation->next();
    if (!sample) return std::nullopt;
    return GyroReading{*sample, std::nullopt};
  };
}

}  // namespace

GyroSource open_gyro_source(const GyroSourceOptions& options, const Warn& warn) {
  return options.kind == GyroSourceKind::kRecord
             ? replay::open_gyro_record(replay::record_of(options.publisher), warn)
             : open_simulation(options, warn);
}

}  // namespace zerodrift::services
