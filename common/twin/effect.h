// SPDX-License-Identifier: Apache-2.0
// What an effect of the catalogue is: a definition (name, equation, parameters, what a record must
// hold to test it) that makes a running instance for one axis of one gyro. An instance runs on any
// inputs, a simulation's or a record's: what it adds for unit amplitudes are the columns of a
// regression that looks for the effect.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "common/core/axis.h"
#include "common/core/state_archive.h"
#include "common/core/units.h"
#include "common/twin/input_family.h"
#include "common/twin/random.h"
#include "common/twin/temperature_point.h"
#include "common/twin/thermal_plant.h"

namespace zerodrift::twin {

// What source current and supply are unless a profile or a record says otherwise.
inline constexpr double kNominalSourceCurrentMa = 100.0;
inline constexpr double kNominalSupplyV = 5.0;

// What an effect may depend on at one sample. Where a value isn't finite, effects that read it give
// NaN or hold their last state; they are finite again as soon as it is.
struct EffectInputs {
  std::uint64_t sample = 0;                 // counts up by one from 0, without gaps
  double time_s = 0.0;                      // end of the integration interval
  double since_power_on_s = 0.0;            // >= 0
  ThermalState thermal;                     // at time_s
  core::PerAxis<double> true_rate_radps{};  // mean over the interval, frame b
  double rate_radps = 0.0;  // for output effects: the rate that all others give together
  core::PerAxis<double> magnetic_ut{};        // field, frame b
  core::PerAxis<double> acceleration_mps2{};  // specific force, frame b
  double vibration_g = 0.0;                   // rms
  double source_current_ma = kNominalSourceCurrentMa;
  double supply_v = kNominalSupplyV;
};

// What became of a sample, the worse the later.
enum class SampleStatus {
  kMeasured,
  kClipped,  // measured, but the sensor saturated
  kLost,     // nothing came
};

// One running effect on one axis. Steps once a sample, in order; no allocation.
class Effect {
 public:
  virtual ~Effect() = default;
  // What it adds to the measured rate, rad/s.
  virtual double step(const EffectInputs& inputs) noexcept = 0;
  // Of the sample last stepped. Asked of output effects only.
  [[nodiscard]] virtual SampleStatus status() const noexcept { return SampleStatus::kMeasured; }
  // What it remembers from step to step, of deterministic effects of the drift
  // (core/state_archive.h).
  virtual void carry(core::StateArchive& /*archive*/) {}
};

// How an effect shows in a record, hence how one looks for it.
enum class Family {
  kDeterministic,  // a function of the inputs: a regressor
  kStochastic,     // has a spectrum
  kRecordFault,    // local: the record's own fault, not the gyro's
};

// Which part of the measured rate an effect makes, for the truth accessors of the simulation.
enum class Contribution {
  kDrift,   // deterministic, or slow and stochastic: what a compensation may hope to follow
  kNoise,   // white: never part of the true drift
  kOutput,  // acts on the total, after all others; never part of the true drift
};

// How a parameter enters, hence how it is fitted.
enum class ParameterRole {
  kAmplitude,   // what the effect adds is jointly linear in all amplitudes, and 0 where they are 0
  kShape,       // enters non-linearly: searched, then refined
  kConvention,  // a reference point that amplitudes of this or another effect absorb, or a value
                // known from elsewhere: never fitted
};

// Where a search looks for the value of a kShape parameter.
enum class SearchRule {
  kGrid,        // at the values of its grid, then between them and up to four times beyond
  kWithinGrid,  // the same, but not beyond
  kLag,         // the same, evenly in the logarithm of a minute more, up to a quarter of the record
  kFrequency,   // Hz: where the residual oscillates in time
  // Of two levels that alternate there: Hz, share of a period above, turns. Searched together.
  kCycleFrequency,
  kCycleDuty,
  kCyclePhase,
  kPeriod,     // °C: where it oscillates along the effect's temperature
  kAngle,      // arcsec: where it oscillates along the angle turned through
  kThreshold,  // °C: within the range of the effect's temperature
  kHalfWidth,  // °C: at the values of its grid and between them, up to a quarter of that range
  kTime,       // s since the start of the record: where the residual steps
  // s: of what lies between two thermometers, where the effect's temperature is their mean;
  // elsewhere its default.
  kBetweenFaces,
};

struct ParameterDefinition {
  std::string name;  // ends in its unit
  std::string meaning;
  double default_value = 0.0;  // a typical magnitude
  double minimum = -std::numeric_limits<double>::max();
  double maximum = std::numeric_limits<double>::max();
  ParameterRole role = ParameterRole::kAmplitude;
  std::vector<double> grid{};  // kShape: what a search tries, increasing, within the limits
  SearchRule rule = SearchRule::kGrid;

  [[nodiscard]] double limited(double value) const { return std::clamp(value, minimum, maximum); }
};

// What a record must hold, and move, before it can say anything about an effect.
enum class Need {
  kTemperature,
  kTemperatureDifference,  // two probes
  kTemperatureCycles,      // the same temperatures up and down
  kPowerOn,                // a power-on within the record, or its time
  kReferenceRate,          // about the gyro's own axis
  kSlowReferenceRate,      // the same, with rates near 0
  kCrossAxisRate,          // about the other two axes
  kMagnetic,
  kAcceleration,
  kVibration,
  kSourceCurrent,
  kSupply,
  kLongRecord,  // hours
  kRawRate,     // samples as the sensor gave them, not averaged
  kTimeStamps,  // of each sample, or a counter
};

using Parameters = std::map<std::string, double>;

// The laws of noise that a spectrum is fitted with.
enum class NoiseLaw {
  kNone,
  kWhite,         // scale in rad/sqrt(s)
  kFlicker,       // rad/s
  kRandomWalk,    // rad/s^1.5
  kQuantization,  // rad rms
  kFirstOrder,    // rad/s, correlated exponentially
  kTwoLevel,      // the same spectrum, but two values only
};

// What the spectrum of a first-order or two-level noise is known by.
struct FirstOrder {
  double sigma_deg_h = 0.0;
  double tau_s = 0.0;
};

// Mean dwell times at the upper and the lower of two levels.
struct TwoLevels {
  double amplitude_deg_h = 0.0;  // between them
  double up_s = 0.0;
  double down_s = 0.0;
};

// One-sided power spectral density of the rate, (rad/s)²/Hz, at 0 < frequency_hz <=
// 1/(2 interval_s); its integral up to there is the variance where that exists.
using Density = std::function<double(double frequency_hz)>;

// A stochastic effect's spectrum.
struct Spectrum {
  // The parameter whose square the density is proportional to.
  std::string scale;
  // Of the series that the effect makes at this interval. `parameters` is complete (see
  // complete_parameters()).
  std::function<Density(const Parameters& parameters, double interval_s)> density;
  NoiseLaw law = NoiseLaw::kNone;
  double si_per_unit = 0.0;  // of the scale, as the law has it
  // kFirstOrder and kTwoLevel: from complete parameters. Then the parameters that mean it, each of
  // its own law.
  std::function<FirstOrder(const Parameters& parameters)> first_order{};
  std::function<Parameters(const FirstOrder& noise)> parameters_of{};
  std::function<Parameters(const TwoLevels& noise)> parameters_of_levels{};
};

// A record's own fault that is found by what it does to single samples.
enum class LocalFault { kNone, kSpikes, kSaturation, kDroppedSamples, kRounding };

// What of an effect others of the same axis take: kConvention parameters of the same names.
enum class Lending : std::uint8_t {
  kNothing,
  kConventions,
  kBesideAnother,  // the same, where it reads the temperatures of the one that lends
};

// What a diagnosis has to know of an effect beside its definition, so that it need not name it.
struct SearchTraits {
  // The simpler effect that this one has as a limit.
  std::string limit{};
  // Adds the same to every sample: always refitted, never looked for.
  bool is_constant = false;
  // Its phase is another one in each record: what is proved elsewhere is its frequency.
  bool has_free_phase = false;
  // Belongs to the record that shows it, not to the gyro: other records neither have it nor speak
  // against it, and no repaired model has it.
  bool happens_once = false;
  // A function of the inputs though Family::kRecordFault.
  bool follows_inputs = false;
  LocalFault fault = LocalFault::kNone;
  Lending lends = Lending::kNothing;
  // Why nothing can be said of an effect where the model has none that lends. Empty: it does
  // without. Else it reads the temperatures of the one that lends.
  std::string without_lender{};
  // Its amplitudes are those of growing powers: which of the lower ones are 0 is a matter of where
  // their zero lies.
  bool has_powers = false;
  // What its only amplitude can be, in its unit: a search takes nothing beyond for the effect. A
  // file may say more.
  double least_amplitude = -std::numeric_limits<double>::infinity();
  double greatest_amplitude = std::numeric_limits<double>::infinity();
  // Reads the temperatures of its definition and no others.
  bool has_fixed_inputs = false;
};

// Everything an instance is made from.
struct EffectContext {
  Parameters parameters;                 // complete: defaults filled in
  std::vector<TemperaturePoint> inputs;  // complete: defaults filled in
  core::Axis axis = core::Axis::kX;
  double interval_s = 0.0;
  NoiseStream noise;

  [[nodiscard]] double parameter(const std::string& name) const { return parameters.at(name); }
  // Of a parameter in deg/h, or deg/h per something.
  [[nodiscard]] double radps(const std::string& name) const {
    return core::radps_from_deg_h(parameter(name));
  }
};

struct EffectDefinition {
  std::string kind{};  // as the catalogue lists it
  std::string equation;
  std::string source;
  Family family = Family::kDeterministic;
  Contribution contribution = Contribution::kDrift;
  std::vector<ParameterDefinition> parameters;
  std::vector<TemperaturePoint> inputs{};  // defaults of the temperatures it reads
  std::vector<Need> needs{};
  std::vector<std::string> confused_with{};  // effects of the catalogue that look alike
  Spectrum spectrum{};                       // Family::kStochastic only
  SearchTraits search{};
  std::function<std::unique_ptr<Effect>(const EffectContext&)> make{};
  std::string formula{};  // of an effect that is one (formula.h)
};

// A function of a record's inputs: what may be run over a record and regressed on.
[[nodiscard]] inline bool is_waveform(const EffectDefinition& definition) {
  return definition.family == Family::kDeterministic || definition.search.follows_inputs;
}

inline double temperature_degc(const EffectInputs& inputs, TemperaturePoint point) noexcept {
  return inputs.thermal.temperature_degc[index(point)];
}

inline double temperature_rate_degc_per_s(const EffectInputs& inputs,
                                          TemperaturePoint point) noexcept {
  return inputs.thermal.temperature_rate_degc_per_s[index(point)];
}

}  // namespace zerodrift::twin
