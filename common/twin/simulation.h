// SPDX-License-Identifier: Apache-2.0
// The twin at work: what the gyro and its thermometers would say during a profile. Deterministic in
// (model, profile, seed, rate): two instances, also in different processes and for any probes in
// any order, give identical samples to the bit and share one thermal truth.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "common/core/axis.h"
#include "common/core/samples.h"
#include "common/twin/effect.h"
#include "common/twin/model.h"
#include "common/twin/profile.h"
#include "common/twin/thermal_plant.h"
#include "common/twin/true_motion.h"

namespace zerodrift::twin {

class GyroSimulation {
 public:
  // Throws std::invalid_argument naming the wrong key of model or profile, or a rate_hz that isn't
  // within 0 and 1e5 Hz.
  GyroSimulation(const Model& model, const Profile& profile, std::uint64_t seed, double rate_hz);

  // Sample k at round(k 10⁹ / rate_hz) ns, k = 0, 1, ... while that is before the profile's end;
  // then none. Invalid and NaN are samples while the gyro is off and those that dropped_samples
  // loses; what saturation cut is clipped. Effects run from the first power-on on, also while the
  // gyro is off in a power cycle. No allocation.
  [[nodiscard]] std::optional<core::AngularRateSample> next() noexcept;

  // Truth of the sample last given, rad/s, frame b. The drift is everything deterministic and
  // everything slow and stochastic: all but white noise (angle_random_walk) and output effects
  // (quantization, record faults).
  [[nodiscard]] const core::PerAxis<double>& true_rate_radps() const noexcept { return true_rate_; }
  [[nodiscard]] const core::PerAxis<double>& true_drift_radps() const noexcept {
    return true_drift_;
  }
  [[nodiscard]] const ThermalState& thermal_state() const noexcept { return inputs_.thermal; }
  // What the effects saw of the world at the sample last given (field, acceleration, vibration,
  // source current, supply beside the above).
  [[nodiscard]] const EffectInputs& inputs() const noexcept { return inputs_; }
  [[nodiscard]] core::Environment environment() const noexcept;

 private:
  struct AxisEffects {
    std::vector<std::unique_ptr<Effect>> drift;
    std::vector<std::unique_ptr<Effect>> noise;
    std::vector<std::unique_ptr<Effect>> output;
  };

  void prepare_inputs(core::SensorTime time) noexcept;
  void measure(core::Axis axis, core::AngularRateSample& sample) noexcept;
  // Leaves the measured rate in inputs_.rate_radps.
  [[nodiscard]] SampleStatus step_axis(core::Axis axis) noexcept;

  double rate_hz_;
  core::SensorTime end_;
  Profile profile_;
  ThermalPlant plant_;
  TrueMotion motion_;
  core::PerAxis<AxisEffects> effects_;
  std::uint64_t next_sample_ = 0;
  Power power_ = Power::kNotYetOn;
  EffectInputs inputs_;
  core::PerAxis<double> true_rate_{};
  core::PerAxis<double> true_drift_{};
};

// The channels that a record of such an experiment has: those that the profile moves or that one of
// the model's effects depends on; all axes of a quantity.
[[nodiscard]] core::EnvironmentChannels environment_channels(const Model& model,
                                                             const Profile& profile);

class ThermometerSimulation {
 public:
  // `probe` names one of the model's probes. Throws std::invalid_argument as GyroSimulation does.
  ThermometerSimulation(const Model& model, const Profile& profile, std::uint64_t seed,
                        std::string_view probe);

  // Reading k at round(k 10⁹ / probe rate) ns while that is before the profile's end; then none.
  // The thermometer has its own supply: it measures before the gyro's power-on too. Names of up to
  // 15 characters don't allocate.
  [[nodiscard]] std::optional<core::TemperatureSample> next();

  // The temperature the probe sits at, without lag, noise and quantisation, at the last reading.
  [[nodiscard]] double true_temperature_degc() const noexcept { return true_temperature_degc_; }

 private:
  // First-order lag behind a node that moved straight since the last reading: exact.
  [[nodiscard]] double lagged(double temperature_degc, double rate_degc_per_s) noexcept;

  ProbeSpec probe_;
  core::SensorTime end_;
  ThermalPlant plant_;
  NoiseStream noise_;
  std::uint64_t next_sample_ = 0;
  double true_temperature_degc_ = 0.0;
  double lagged_degc_ = 0.0;
};

}  // namespace zerodrift::twin
