// SPDX-License-Identifier: Apache-2.0
// What an effect of the catalogue is: a definition (name, equation, parameters) that makes a
// running instance for one axis of one gyro.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "common/core/axis.h"
#include "common/twin/random.h"
#include "common/twin/temperature_point.h"
#include "common/twin/thermal_plant.h"

namespace zerodrift::twin {

// What an effect may depend on at one sample.
struct EffectInputs {
  std::uint64_t sample = 0;                 // index of the sample since the record's start
  double time_s = 0.0;                      // end of the integration interval
  double since_power_on_s = 0.0;            // >= 0
  ThermalState thermal;                     // at time_s
  core::PerAxis<double> true_rate_radps{};  // mean over the interval, frame b
  double rate_radps = 0.0;  // for output effects: the rate that all others give together
};

// One running effect on one axis. Steps once a sample, in order; no allocation.
class Effect {
 public:
  virtual ~Effect() = default;
  // What it adds to the measured rate, rad/s.
  virtual double step(const EffectInputs& inputs) noexcept = 0;
};

// Which part of the measured rate an effect makes, for the truth accessors of the simulation.
enum class Contribution {
  kDrift,   // deterministic, or slow and stochastic: what a compensation may hope to follow
  kNoise,   // white: never part of the true drift
  kOutput,  // acts on the total, after all others; never part of the true drift
};

struct ParameterDefinition {
  std::string name;  // ends in its unit
  std::string meaning;
  double default_value = 0.0;  // a typical magnitude
  double minimum = -std::numeric_limits<double>::max();
  double maximum = std::numeric_limits<double>::max();
};

// Everything an instance is made from.
struct EffectContext {
  std::map<std::string, double> parameters;  // complete: defaults filled in
  std::vector<TemperaturePoint> inputs;      // complete: defaults filled in
  core::Axis axis = core::Axis::kX;
  double interval_s = 0.0;
  NoiseStream noise;

  [[nodiscard]] double parameter(const std::string& name) const { return parameters.at(name); }
};

struct EffectDefinition {
  std::string kind;
  std::string equation;
  std::string source;
  Contribution contribution = Contribution::kDrift;
  std::vector<ParameterDefinition> parameters;
  std::vector<TemperaturePoint> inputs;  // defaults of the temperatures it reads
  std::function<std::unique_ptr<Effect>(const EffectContext&)> make;
};

// The lag parameter that temperature effects share.
inline ParameterDefinition lag_parameter() {
  return {"lag_s", "first-order lag of the effect behind the temperature", 0.0, 0.0, 1e5};
}

inline double temperature_degc(const EffectInputs& inputs, TemperaturePoint point) noexcept {
  return inputs.thermal.temperature_degc[index(point)];
}

inline double temperature_rate_degc_per_s(const EffectInputs& inputs,
                                          TemperaturePoint point) noexcept {
  return inputs.thermal.temperature_rate_degc_per_s[index(point)];
}

}  // namespace zerodrift::twin
