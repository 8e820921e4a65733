// SPDX-License-Identifier: Apache-2.0
#include "services/thermal_publisher/thermal_source.h"

#include <memory>
#include <stdexcept>
#include <vector>

#include "common/config/twin_config.h"
#include "common/twin/simulation.h"

namespace zerodrift::services {
namespace {

using replay::Warn;

// Merges the probes' own streams by time; ties in the model's order.
class SimulatedProbes {
 public:
  SimulatedProbes(const twin::Model& model, const twin::Profile& profile, std::uint64_t seed) {
    for (const auto& probe : model.probes) {
      probes_.push_back(
          {twin::ThermometerSimulation(model, profile, seed, probe.name), std::nullopt});
      probes_.back().next = probes_.back().simulation.next();
    }
  }

  std::optional<core::TemperatureSample> next() {
    Probe* first = nullptr;
    for (auto& probe : probes_) {
      if (probe.next && (first == nullptr || probe.next->time < first->next->time)) first = &probe;
    }
    if (first == nullptr) return std::nullopt;
    auto sample = std::move(first->next);
    first->next = first->simulation.next();
    return sample;
  }

 private:
  struct Probe {
    twin::ThermometerSimulation simulation;
    std::optional<core::TemperatureSample> next;
  };
  std::vector<Probe> probes_;
};

ThermalSource open_simulation(const ThermalSourceOptions& options, const Warn& warn) {
  if (options.model.empty())
    throw std::invalid_argument("--model: missing; a simulation needs a twin's model file");
  if (options.profile.empty())
    throw std::invalid_argument("--profile: missing; a simulation needs a profile file");
  const auto loaded = config::load_model(options.model);
  for (const auto& line : loaded.warnings) warn(line);
  twin::Profile profile = config::load_profile(options.profile);
  if (options.duration_s > 0.0) profile.duration_s = options.duration_s;
  auto probes = std::make_shared<SimulatedProbes>(loaded.model, profile, options.seed);
  ThermalSource source{.next = [probes] { return probes->next(); }};
  for (const auto& probe : loaded.model.probes) source.probes.push_back(probe.name);
  return source;
}

ThermalSource open_record(const ThermalSourceOptions& options, const Warn& warn) {
  return replay::open_thermal_record({.record = options.record,
                                      .columns = options.columns,
                                      .to_s = options.duration_s,
                                      .preferred_gyro_id = options.gyro_id},
                                     warn);
}

}  // namespace

ThermalSource open_thermal_source(const ThermalSourceOptions& options, const Warn& warn) {
  return options.kind == ThermalSourceKind::kRecord ? open_record(options, warn)
                                                    : open_simulation(options, warn);
}

}  // namespace zerodrift::services
