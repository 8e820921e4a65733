// SPDX-License-Identifier: Apache-2.0
// What a compensated sample says of itself. The numbers go out on compensated_rate and are part of
// the interface: idl/dds/compensated_rate.idl and docs/subscribing.md list them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

namespace zerodrift::core {

enum class Mode : std::uint8_t {
  kPassthrough = 0,  // nothing taken off
  kLearning = 1,     // the model compensates, and learns from what comes in
  kFrozen = 2,       // the model compensates and does not learn
  kFallback = 3,     // a simpler estimate compensates, since an input or every label is missing
  kOutOfDomain = 4,  // temperature or rate outside what was learned: the last safe value, or a
                     // forecast that proved itself there, compensates
  kHolding = 5,      // the last stationary mean compensates: nothing known predicts better
};

inline constexpr std::size_t kModes = 6;

enum class Reason : std::uint8_t {
  kNone = 0,                 // learning: all is as it should be
  kNoEstimateYet = 1,        // nothing learned yet
  kInitialSet = 2,           // the initial set is not complete
  kMotion = 3,               // not at rest: true rotation is never learned
  kEarthRateUnknown = 4,     // attitude unknown: Earth rate must not be learned as drift
  kLevelImplausible = 5,     // at rest, but above the largest plausible drift
  kCommanded = 6,            // frozen by command
  kTemperatureMissing = 7,   // no temperature of a probe the model needs
  kTemperatureStale = 8,     // no recent temperature
  kProbeStuck = 9,           // a probe does not move while others do
  kRateNotReady = 10,        // the temperature rate or a lagged temperature needs a longer history
  kModelWorseThanBias = 11,  // the last stationary bias predicts better than the model
  kOutsideLearned = 12,      // see Mode::kOutOfDomain
  kInvalidInput = 13,  // the raw sample was not finite or marked invalid; it passes as it came
  kSchemeNone = 14,    // configured to compensate nothing
  kSettling = 15,      // still again, waiting out the dwell
  kPolarityReversed =
      16,  // the axis turns the other way round than its reference or the Earth says
};

inline constexpr std::size_t kReasons = 17;

// Which rung of the fallback ladder gave the applied drift. With a prior, kStationaryBias,
// kOnlineSvr and kStack speak of what it leaves, and it is part of the applied drift.
enum class Rung : std::uint8_t {
  kNone = 0,
  kFactoryPolynomial = 1,
  kStationaryBias = 2,
  kOnlineSvr = 3,
  kPrior = 4,  // the twin's model alone; between the factory polynomial and the stationary bias
  kStack = 5,  // several experts by their weights, the online SVR among them; where a temperature
               // fails, of those that need none
};

inline constexpr std::size_t kRungs = 6;

constexpr std::string_view name(Mode mode) {
  switch (mode) {
    case Mode::kPassthrough: return "passthrough";
    case Mode::kLearning: return "learning";
    case Mode::kFrozen: return "frozen";
    case Mode::kFallback: return "fallback";
    case Mode::kOutOfDomain: return "out_of_domain";
    case Mode::kHolding: return "holding";
  }
  return "unknown";
}

constexpr std::string_view name(Reason reason) {
  switch (reason) {
    case Reason::kNone: return "none";
    case Reason::kNoEstimateYet: return "no_estimate_yet";
    case Reason::kInitialSet: return "initial_set";
    case Reason::kMotion: return "motion";
    case Reason::kEarthRateUnknown: return "earth_rate_unknown";
    case Reason::kLevelImplausible: return "level_implausible";
    case Reason::kCommanded: return "commanded";
    case Reason::kTemperatureMissing: return "temperature_missing";
    case Reason::kTemperatureStale: return "temperature_stale";
    case Reason::kProbeStuck: return "probe_stuck";
    case Reason::kRateNotReady: return "temperature_rate_not_ready";
    case Reason::kModelWorseThanBias: return "model_worse_than_bias";
    case Reason::kOutsideLearned: return "outside_learned";
    case Reason::kInvalidInput: return "invalid_input";
    case Reason::kSchemeNone: return "scheme_none";
    case Reason::kSettling: return "settling";
    case Reason::kPolarityReversed: return "polarity_reversed";
  }
  return "unknown";
}

// Part of a start, of a drive or of ordinary learning: nobody has to do anything about it.
constexpr bool passes_by_itself(Reason reason) {
  switch (reason) {
    case Reason::kNone:
    case Reason::kNoEstimateYet:
    case Reason::kInitialSet:
    case Reason::kMotion:
    case Reason::kRateNotReady:
    case Reason::kModelWorseThanBias:
    case Reason::kOutsideLearned:
    case Reason::kSettling: return true;
    case Reason::kEarthRateUnknown:
    case Reason::kLevelImplausible:
    case Reason::kCommanded:
    case Reason::kTemperatureMissing:
    case Reason::kTemperatureStale:
    case Reason::kProbeStuck:
    case Reason::kInvalidInput:
    case Reason::kSchemeNone:
    case Reason::kPolarityReversed: return false;
  }
  return false;
}

// A thermometer fails whoever needs one.
constexpr bool lacks_temperature(Reason reason) {
  return reason == Reason::kTemperatureMissing || reason == Reason::kTemperatureStale ||
         reason == Reason::kProbeStuck;
}

constexpr std::string_view name(Rung rung) {
  switch (rung) {
    case Rung::kNone: return "none";
    case Rung::kFactoryPolynomial: return "factory_polynomial";
    case Rung::kStationaryBias: return "stationary_bias";
    case Rung::kOnlineSvr: return "online_svr";
    case Rung::kPrior: return "prior";
    case Rung::kStack: return "stack";
  }
  return "unknown";
}

}  // namespace zerodrift::core
