// SPDX-License-Identifier: Apache-2.0
// What a twin's model says of the drift before anything is learned:
//
//   drift(t) = prior(t) + remainder(t),  prior = sum of the model's effects of the axis
//
// Only deterministic effects whose inputs are temperatures and the time since power-on take part;
// those that need a rate, a field, an acceleration, vibration, current or voltage, noise and faults
// are left out and can be named (effects_left_out).
//
// The effects are stepped on a fixed grid of sensor time, once at each full second, with the newest
// temperatures and temperature rates at hand; between two steps the value is held. The error
// of holding is at most one second of the prior's slope: .006 deg/h where a rate of 1 °C/min comes
// or goes within 10 minutes on a coil with 3.3 deg/h per °C/min, less than half the noise of that
// gyro's one-second mean.
//
// Lags and hysteresis begin from the first temperatures. A pause of up to kLongestPauseS is stepped
// through with the temperatures after it; after a longer one, or where the source started anew,
// they begin anew. While a temperature that an axis reads is missing, its value and states stand
// still.
//
// Deterministic: equal readings at equal sensor times give equal values to the bit.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/core/axis.h"
#include "common/core/mode.h"
#include "common/core/state_archive.h"
#include "common/core/time.h"
#include "common/twin/effect.h"
#include "common/twin/model.h"
#include "common/twin/temperature_point.h"

namespace zerodrift::compensation {

// Nothing when the model can be a prior, else one line that begins with "prior: ": invalid, without
// an effect that takes part, or with more than kMostPriorEffects of them on one axis.
[[nodiscard]] std::optional<std::string> find_wrong_prior(const twin::Model& model);

// One line for each effect with parameters that takes no part: "magnetic of axis x".
[[nodiscard]] std::vector<std::string> effects_left_out(const twin::Model& model);

// Names of the probes that the model's effects read, in order of first use: a place's own name. The
// coil's mean temperature is made of coil_outer and coil_inner where `configured` names both and
// not coil.
[[nodiscard]] std::vector<std::string> prior_probes(const twin::Model& model,
                                                    std::span<const std::string> configured);

// Two models with the same one give the same prior: the model's gyro_id, the number of effects that
// take part, and a hash of these (FNV-1a, 64 bit), their parameters completed and inputs resolved.
[[nodiscard]] std::string prior_identity(const twin::Model& model);

// One thermometer at a grid point; NaN where there is none, or none that is fresh.
struct PriorReading {
  double temperature_degc = std::numeric_limits<double>::quiet_NaN();
  double rate_degc_per_s = std::numeric_limits<double>::quiet_NaN();
};

enum class PriorStatus : std::uint8_t {
  kReady,
  kTemperatureMissing,  // of a place that an effect of this axis reads
  kRateNotReady,        // temperatures are there, a temperature rate is not yet
};

class DriftPrior {
 public:
  static constexpr core::SensorTime kStep{1'000'000'000};
  static constexpr std::int64_t kLongestPauseSteps = 60;
  static constexpr std::size_t kMostEffects = 64;  // an axis

  // `probes` names the readings that step() will be given, in that order. Throws
  // std::invalid_argument with one line where the model can't be a prior or reads a probe that is
  // not among them.
  DriftPrior(const twin::Model& model, std::span<const std::string> probes);

  // True where `now` lies in another second than the last step.
  [[nodiscard]] bool is_due(core::SensorTime now) const noexcept;
  // Steps every axis to the second that `now` lies in. O(effects) a second passed, at most
  // kLongestPauseSteps times that. Takes no memory before the states of an axis began anew
  // kPrepared times.
  void step(core::SensorTime now, core::SensorTime power_on,
            std::span<const PriorReading> readings) noexcept;
  // The source started anew: states begin anew with the next step, values stand until then.
  void restart() noexcept;

  // The model has effects of this axis.
  [[nodiscard]] bool covers(core::Axis axis) const noexcept {
    return !axes_[core::index(axis)].specs.empty();
  }
  // rad/s; nothing before the first complete step.
  [[nodiscard]] std::optional<double> drift_radps(core::Axis axis) const noexcept {
    return axes_[core::index(axis)].drift_radps;
  }
  [[nodiscard]] PriorStatus status(core::Axis axis) const noexcept {
    return axes_[core::index(axis)].status;
  }
  // Why an axis that is covered has no value, or one that stands still; kNone: it has one.
  [[nodiscard]] core::Reason reason(core::Axis axis) const noexcept;

  // Its state (core/state_archive.h).
  void carry(core::StateArchive& archive);

 private:
  static constexpr std::size_t kPrepared = 16;
  using Effects = std::vector<std::unique_ptr<twin::Effect>>;

  // Which readings give a place's temperature: one, or the mean of two.
  struct Source {
    std::size_t first = 0;
    std::size_t second = 0;
  };
  struct AxisPrior {
    std::vector<twin::EffectSpec> specs;
    std::vector<twin::TemperaturePoint> reads;
    Effects effects;
    std::vector<Effects> prepared;  // as new, for when states begin anew
    std::optional<std::int64_t> stepped_to;
    std::uint64_t steps = 0;  // since states began
    std::optional<double> drift_radps;
    PriorStatus status = PriorStatus::kTemperatureMissing;
  };

  [[nodiscard]] static Effects make_effects(const std::vector<twin::EffectSpec>& specs);
  static void begin_anew(AxisPrior& axis);
  void resolve(twin::TemperaturePoint point, std::span<const std::string> probes);
  [[nodiscard]] twin::ThermalState thermal_state(
      std::span<const PriorReading> readings) const noexcept;
  static void step(AxisPrior& axis, std::int64_t to, core::SensorTime power_on,
                   twin::EffectInputs& inputs) noexcept;

  twin::PerPoint<std::optional<Source>> sources_{};
  core::PerAxis<AxisPrior> axes_{};
  std::optional<std::int64_t> newest_;
};

}  // namespace zerodrift::compensation
