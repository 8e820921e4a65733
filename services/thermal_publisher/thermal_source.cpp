// SPDX-License-Identifier: Apache-2.0
#include "services/thermal_publisher/thermal_source.h"

#include <memory>
#include <vector>

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

ThermalSource open_simulation(const replay::PublisherOptions& options, const Warn& warn) {
  const auto [model, profile] = replay::load_experiment(options, warn);
  auto probes = std::make_shared<SimulatedProbes>(model, profile, options.seed);
  ThermalSource source{.next = [probes] { return probes->next(); }};
  for (const auto& probe : model.probes) source.probes.push_back(probe.name);
  return source;
}

}  // namespace

ThermalSource open_thermal_source(ThermalSourceKind kind, const replay::PublisherOptions& options,
                                  const Warn& warn) {
  return kind == ThermalSourceKind::kRecord
             ? replay::open_thermal_record(replay::record_of(options), warn)
             : open_simulation(options, warn);
}

}  // namespace zerodrift::services
