// SPDX-License-Identifier: Apache-2.0
#include "common/twin/simulation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

#include "common/core/closest_name.h"
#include "common/twin/effect_catalogue.h"
#include "common/twin/sample_clock.h"

namespace zerodrift::twin {
namespace {

// The model itself where it and the profile are sound.
const Model& checked(const Model& model, const Profile& profile) {
  if (const auto wrong = model.validate()) throw std::invalid_argument("model: " + *wrong);
  if (const auto wrong = profile.validate()) throw std::invalid_argument("profile: " + *wrong);
  return model;
}

double checked_rate(double rate_hz) {
  if (rate_hz > 0.0 && rate_hz <= 1e5) return rate_hz;
  throw std::invalid_argument("rate_hz: must be above 0 and at most 1e5 Hz, found " +
                              std::to_string(rate_hz));
}

// Named after what the effect is, not where it stands in the list. Repeated effects of one kind
// on one axis are counted.
NoiseStream noise_of(const Model& model, std::size_t effect, std::uint64_t seed) {
  const EffectSpec& spec = model.effects[effect];
  const auto end = model.effects.begin() + static_cast<std::ptrdiff_t>(effect);
  const auto repetition = std::count_if(model.effects.begin(), end, [&spec](const EffectSpec& e) {
    return e.kind == spec.kind && e.axis == spec.axis;
  });
  const std::string name = model.gyro_id + "/effect/" + spec.kind + '/' +
                           std::string(core::name(spec.axis)) + '/' + std::to_string(repetition);
  return NoiseStream(seed, name);
}

const ProbeSpec& find_probe(const Model& model, std::string_view name) {
  std::vector<std::string> names;
  for (const ProbeSpec& probe : model.probes) {
    if (probe.name == name) return probe;
    names.push_back(probe.name);
  }
  throw std::invalid_argument("probe: the model has no '" + std::string(name) + "'" +
                              core::suggestion(name, names));
}

double quantised(double value, double step) {
  return step > 0.0 ? std::round(value / step) * step : value;
}

double sum_of(const std::vector<std::unique_ptr<Effect>>& effects,
              const EffectInputs& inputs) noexcept {
  double sum = 0.0;
  for (const auto& effect : effects) sum += effect->step(inputs);
  return sum;
}

void excite(const Profile& profile, EffectInputs& inputs) noexcept {
  inputs.magnetic_ut = {};
  inputs.acceleration_mps2 = {};
  inputs.vibration_g = 0.0;
  inputs.source_current_ma = kNominalSourceCurrentMa;
  inputs.supply_v = kNominalSupplyV;
  for (const Excitation& excitation : profile.excitations) {
    const double value = excited_value(excitation, inputs.time_s);
    const std::size_t axis = core::index(excitation.axis);
    switch (excitation.quantity) {
      case ExcitedQuantity::kMagneticUt: inputs.magnetic_ut[axis] += value; break;
      case ExcitedQuantity::kAccelerationMps2: inputs.acceleration_mps2[axis] += value; break;
      case ExcitedQuantity::kVibrationG: inputs.vibration_g += value; break;
      case ExcitedQuantity::kSourceCurrentMa: inputs.source_current_ma += value; break;
      case ExcitedQuantity::kSupplyV: inputs.supply_v += value; break;
    }
  }
}

}  // namespace

GyroSimulation::GyroSimulation(const Model& model, const Profile& profile, std::uint64_t seed,
                               double rate_hz)
    : rate_hz_(checked_rate(rate_hz)),
      end_(core::from_seconds(profile.duration_s)),
      profile_(profile),
      plant_(checked(model, profile).thermal_plant, profile),
      motion_(profile, 1.0 / rate_hz) {
  for (std::size_t i = 0; i < model.effects.size(); ++i) {
    const EffectSpec& spec = model.effects[i];
    const DefinitionPtr definition = definition_of(spec);
    if (definition == nullptr || spec.parameters.empty()) continue;
    AxisEffects& axis = effects_[core::index(spec.axis)];
    auto& group = definition->contribution == Contribution::kDrift   ? axis.drift
                  : definition->contribution == Contribution::kNoise ? axis.noise
                                                                     : axis.output;
    group.push_back(make_effect(spec, 1.0 / rate_hz, noise_of(model, i, seed)));
  }
}

std::optional<core::AngularRateSample> GyroSimulation::next() noexcept {
  const core::SensorTime time = sample_time(next_sample_, rate_hz_);
  if (time >= end_) return std::nullopt;
  prepare_inputs(time);
  core::AngularRateSample sample;
  sample.sequence = next_sample_++;
  sample.time = time;
  sample.interval_s = 1.0 / rate_hz_;
  sample.clock = core::ClockSource::kSimulation;
  for (const core::Axis axis : core::kAxes) measure(axis, sample);
  return sample;
}

void GyroSimulation::prepare_inputs(core::SensorTime time) noexcept {
  inputs_.sample = next_sample_;
  inputs_.time_s = core::seconds(time);
  const PowerState state = power_at(profile_, inputs_.time_s);
  power_ = state.power;
  inputs_.since_power_on_s = state.since_on_s;
  inputs_.thermal = plant_.at(time);
  true_rate_ = motion_.step(time);
  inputs_.true_rate_radps = true_rate_;
  excite(profile_, inputs_);
}

core::Environment GyroSimulation::environment() const noexcept {
  return {inputs_.magnetic_ut, inputs_.acceleration_mps2, inputs_.vibration_g,
          inputs_.source_current_ma, inputs_.supply_v};
}

core::EnvironmentChannels environment_channels(const Model& model, const Profile& profile) {
  struct Of {
    ExcitedQuantity quantity;
    Need need;
    core::EnvironmentChannels channels;
  };
  constexpr std::array kAll{
      Of{ExcitedQuantity::kMagneticUt, Need::kMagnetic, 0b111U},
      Of{ExcitedQuantity::kAccelerationMps2, Need::kAcceleration, 0b111U << 3U},
      Of{ExcitedQuantity::kVibrationG, Need::kVibration, 1U << 6U},
      Of{ExcitedQuantity::kSourceCurrentMa, Need::kSourceCurrent, 1U << 7U},
      Of{ExcitedQuantity::kSupplyV, Need::kSupply, 1U << 8U}};
  core::EnvironmentChannels channels = 0;
  for (const Of& of : kAll) {
    const bool moved = std::any_of(
        profile.excitations.begin(), profile.excitations.end(),
        [&](const Excitation& excitation) { return excitation.quantity == of.quantity; });
    if (moved || depends_on(model, of.need)) channels |= of.channels;
  }
  return channels;
}

void GyroSimulation::measure(core::Axis axis, core::AngularRateSample& sample) noexcept {
  const std::size_t i = core::index(axis);
  sample.rate_radps[i] = std::numeric_limits<double>::quiet_NaN();
  if (power_ == Power::kNotYetOn) return;
  const SampleStatus status = step_axis(axis);
  if (power_ == Power::kOff || status == SampleStatus::kLost) return;
  sample.valid[i] = true;
  sample.clipped[i] = status == SampleStatus::kClipped;
  sample.rate_radps[i] = inputs_.rate_radps;
}

SampleStatus GyroSimulation::step_axis(core::Axis axis) noexcept {
  const std::size_t i = core::index(axis);
  AxisEffects& effects = effects_[i];
  true_drift_[i] = sum_of(effects.drift, inputs_);
  inputs_.rate_radps = true_rate_[i] + true_drift_[i] + sum_of(effects.noise, inputs_);
  SampleStatus worst = SampleStatus::kMeasured;
  for (const auto& effect : effects.output) {
    inputs_.rate_radps += effect->step(inputs_);
    worst = std::max(worst, effect->status());
  }
  return worst;
}

ThermometerSimulation::ThermometerSimulation(const Model& model, const Profile& profile,
                                             std::uint64_t seed, std::string_view probe)
    : probe_(find_probe(checked(model, profile), probe)),
      end_(core::from_seconds(profile.duration_s)),
      plant_(model.thermal_plant, profile),
      noise_(seed, model.gyro_id + "/probe/" + probe_.name) {}

std::optional<core::TemperatureSample> ThermometerSimulation::next() {
  const core::SensorTime time = sample_time(next_sample_, probe_.rate_hz);
  if (time >= end_) return std::nullopt;
  const ThermalState state = plant_.at(time);
  const std::size_t node = index(probe_.node);
  const double reading =
      lagged(state.temperature_degc[node], state.temperature_rate_degc_per_s[node]) +
      probe_.noise_degc * noise_.gaussian(next_sample_);
  core::TemperatureSample sample;
  sample.probe = probe_.name;
  sample.sequence = next_sample_++;
  sample.time = time;
  sample.temperature_degc = quantised(reading, probe_.quantisation_degc);
  sample.clock = core::ClockSource::kSimulation;
  return sample;
}

double ThermometerSimulation::lagged(double temperature_degc, double rate_degc_per_s) noexcept {
  const double previous_degc = std::exchange(true_temperature_degc_, temperature_degc);
  if (next_sample_ == 0 || probe_.lag_s == 0.0) {
    return lagged_degc_ = temperature_degc - probe_.lag_s * rate_degc_per_s;
  }
  const double interval_s = 1.0 / probe_.rate_hz;
  const double behind_degc = probe_.lag_s * (temperature_degc - previous_degc) / interval_s;
  const double memory = std::exp(-interval_s / probe_.lag_s);
  lagged_degc_ =
      temperature_degc - behind_degc + memory * (lagged_degc_ - previous_degc + behind_degc);
  return lagged_degc_;
}

}  // namespace zerodrift::twin
