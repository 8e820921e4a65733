// SPDX-License-Identifier: Apache-2.0
#include "services/gyro_publisher/gyro_source.h"

#include <memory>
#include <stdexcept>

#include "common/config/twin_config.h"
#include "common/twin/simulation.h"

namespace zerodrift::services {
namespace {

using replay::Warn;

GyroSource open_simulation(const GyroSourceOptions& options, const Warn& warn) {
  if (options.model.empty())
    throw std::invalid_argument("--model: missing; a simulation needs a twin's model file");
  if (options.profile.empty())
    throw std::invalid_argument("--profile: missing; a simulation needs a profile file");
  const auto loaded = config::load_model(options.model);
  for (const auto& line : loaded.warnings) warn(line);
  twin::Profile profile = config::load_profile(options.profile);
  if (options.duration_s > 0.0) profile.duration_s = options.duration_s;
  const double rate_hz = options.rate_hz > 0.0 ? options.rate_hz : loaded.model.nominal_rate_hz;
  auto simulation =
      std::make_shared<twin::GyroSimulation>(loaded.model, profile, options.seed, rate_hz);
  return [simulation]() -> std::optional<GyroReading> {
    auto sample = simulation->next();
    if (!sample) return std::nullopt;
    return GyroReading{*sample, std::nullopt};
  };
}

GyroSource open_record(const GyroSourceOptions& options, const Warn& warn) {
  return replay::open_gyro_record({.record = options.record,
                                   .columns = options.columns,
                                   .to_s = options.duration_s,
                                   .preferred_gyro_id = options.gyro_id},
                                  warn);
}

}  // namespace

GyroSource open_gyro_source(const GyroSourceOptions& options, const Warn& warn) {
  return options.kind == GyroSourceKind::kRecord ? open_record(options, warn)
                                                 : open_simulation(options, warn);
}

}  // namespace zerodrift::services
