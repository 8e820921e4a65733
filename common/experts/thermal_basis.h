// SPDX-License-Identifier: Apache-2.0
// What the drift may be linear in: temperature about a reference, its powers and rate, and thermal
// memory, which is how far the temperature is from what it was on the whole over the last minutes
// to an hour (heat that is still on its way through a coil).
//
// Temperatures in any unit of the order of 10 degrees, rates in any unit of the order of a degree a
// minute, times in s.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <optional>

#include "common/core/integer_time.h"
#include "common/core/state_archive.h"
#include "common/experts/linear_forecast.h"

namespace zerodrift::experts {

enum BasisTerm : std::size_t {
  kTemperature = 0,
  kTemperatureRate,
  kTemperatureSquared,
  kTemperatureCubed,
  kTemperatureTimesRate,
  kFirstMemory,  // temperature less its low pass, one for each of kMemoryTimesS
};
// Time constants of the low passes, s: Shupe's effect and mounts have between a minute and an hour.
inline constexpr std::array<double, kBasisTerms - kFirstMemory> kMemoryTimesS{120.0, 360.0, 1080.0,
                                                                              3240.0};

// Of an instant.
struct ThermalState {
  double temperature = 0.0;
  double rate = 0.0;
  std::array<double, kMemoryTimesS.size()> memory{};  // temperature less its low passes

  // Sums and means, term by term.
  void add(const ThermalState& other) noexcept {
    temperature += other.temperature;
    rate += other.rate;
    for (std::size_t i = 0; i < memory.size(); ++i) memory[i] += other.memory[i];
  }
  [[nodiscard]] ThermalState over(double count) const noexcept {
    ThermalState mean{temperature / count, rate / count, memory};
    for (double& term : mean.memory) term /= count;
    return mean;
  }
  friend bool operator==(const ThermalState&, const ThermalState&) = default;

  void carry(core::StateArchive& archive) { archive(temperature, rate, memory); }
};

// Powers are of the temperature about `reference`, and scaled so that those of a record's whole
// range are of the order of the temperature itself.
[[nodiscard]] inline Basis basis_of(const ThermalState& state, double reference) noexcept {
  const double now = state.temperature - reference;
  Basis basis{now, state.rate, now * now / 3.0, now * now * now / 9.0, now * state.rate / 3.0};
  for (std::size_t i = 0; i < kMemoryTimesS.size(); ++i) basis[kFirstMemory + i] = state.memory[i];
  return basis;
}

// Follows a thermometer. One thread. O(1) a reading, no allocation.
class ThermalMemory {
 public:
  // A reading at `time`, which is after that of the call before, be it by a nanosecond. Between two
  // readings the temperature counts as linear in time, for which the low passes are exact. They
  // begin at the first reading, so that nothing is on its way then.
  const ThermalState& advance(core::SensorTime time, double temperature, double rate) noexcept {
    if (newest_) {
      const double elapsed_s = core::seconds(core::saturating_difference(time, *newest_));
      const double slope = (temperature - state_.temperature) / elapsed_s;
      for (std::size_t i = 0; i < kMemoryTimesS.size(); ++i) {
        const double lag = slope * kMemoryTimesS[i];
        state_.memory[i] += (state_.memory[i] - lag) * std::expm1(-elapsed_s / kMemoryTimesS[i]);
      }
    }
    newest_ = time;
    state_.temperature = temperature;
    state_.rate = rate;
    return state_;
  }
  [[nodiscard]] const ThermalState& state() const noexcept { return state_; }
  // Forgets all: the clock was set back, or another stream began.
  void restart() noexcept {
    newest_.reset();
    state_ = {};
  }

  // Its state (core/state_archive.h).
  void carry(core::StateArchive& archive) { archive(newest_, state_); }

 private:
  std::optional<core::SensorTime> newest_{};
  ThermalState state_{};
};

}  // namespace zerodrift::experts
