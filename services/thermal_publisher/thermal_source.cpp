// SPDX-License-Identifier: Apache-2.0
#include "services/thermal_publisher/thermal_source.h"

#include <memory>
#include <vector>

#include "common/twin/simulation.h"

namespace zerodrift::services {
namespace {

using replay::Warn;

// Of what a profile moves; its ramps last seconds.
constexpr double kEnvironmentRateHz = 10.0;

twin::Model without_effects(twin::Model model) {
  model.effects.clear();
  return model;
}

// Merges the streams of the probes and of the environment by time; ties in the model's order.
class SimulatedReadings {
 public:
  SimulatedReadings(const twin::Model& model, const twin::Profile& profile, std::uint64_t seed)
      : channels_(twin::environment_channels(model, profile)),
        surroundings_(without_effects(model), profile, seed, kEnvironmentRateHz) {
    advance();
    for (const auto& probe : model.probes) {
      probes_.push_back(
          {twin::ThermometerSimulation(model, profile, seed, probe.name), std::nullopt});
      probes_.back().next = probes_.back().simulation.next();
    }
  }

  [[nodiscard]] core::EnvironmentChannels channels() const noexcept { return channels_; }

  std::optional<replay::ThermalReading> next() {
    Probe* first = nullptr;
    for (auto& probe : probes_) {
      if (probe.next && (first == nullptr || probe.next->time < first->next->time)) first = &probe;
    }
    if (environment_ && (first == nullptr || environment_->time < first->next->time)) {
      const core::EnvironmentSample sample = *environment_;
      advance();
      return sample;
    }
    if (first == nullptr) return std::nullopt;
    auto sample = std::move(first->next);
    first->next = first->simulation.next();
    return *sample;
  }

 private:
  void advance() {
    environment_.reset();
    const auto at = channels_ == 0 ? std::nullopt : surroundings_.next();
    if (!at) return;
    environment_ = core::EnvironmentSample{.sequence = at->sequence,
                                           .time = at->time,
                                           .channels = channels_,
                                           .values = surroundings_.environment(),
                                           .clock = at->clock};
  }

  struct Probe {
    twin::ThermometerSimulation simulation;
    std::optional<core::TemperatureSample> next;
  };
  std::vector<Probe> probes_;
  core::EnvironmentChannels channels_;
  twin::GyroSimulation surroundings_;
  std::optional<core::EnvironmentSample> environment_;
};

ThermalSource open_simulation(const replay::PublisherOptions& options, const Warn& warn) {
  const auto [model, profile] = replay::load_experiment(options, warn);
  auto readings = std::make_shared<SimulatedReadings>(model, profile, options.seed);
  ThermalSource source{.environment = readings->channels(),
                       .next = [readings] { return readings->next(); }};
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
