// SPDX-License-Identifier: Apache-2.0
// What the drift may be linear in: temperature about that of the first reading, its powers and
// rate, and thermal memory, which is how far the temperature is from what it was on the whole over
// the last minutes to an hour (heat that is still on its way through a coil).
#pragma once

#include <array>
#include <cstddef>
#include <optional>

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

// One thread. O(1) a reading, no allocation; a temperature in any unit of the order of 10 degrees,
// its rate in any unit of the order of a degree a minute.
class ThermalBasis {
 public:
  // The basis at `time_s`, which is after that of the call before. Between two readings the
  // temperature counts as linear in time, for which the low passes are exact.
  const Basis& advance(double time_s, double temperature, double rate) noexcept {
    if (!before_) {
      first_ = temperature;
      low_pass_.fill(0.0);
    }
    const double now = temperature - first_;
    if (before_) {
      const double elapsed_s = time_s - before_->time_s;
      const double slope = (now - before_->temperature) / elapsed_s;
      for (std::size_t i = 0; i < low_pass_.size(); ++i) {
        const double lag = slope * kMemoryTimesS[i];
        low_pass_[i] =
            now - lag +
            (low_pass_[i] - before_->temperature + lag) * std::exp(-elapsed_s / kMemoryTimesS[i]);
      }
    }
    before_ = {time_s, now};
    basis_ = {now, rate, now * now / 3.0, now * now * now / 9.0, now * rate / 3.0};
    for (std::size_t i = 0; i < low_pass_.size(); ++i)
      basis_[kFirstMemory + i] = now - low_pass_[i];
    return basis_;
  }

 private:
  struct Reading {
    double time_s;
    double temperature;  // about the first
  };
  double first_ = 0.0;
  std::optional<Reading> before_{};
  std::array<double, kMemoryTimesS.size()> low_pass_{};
  Basis basis_{};
};

}  // namespace zerodrift::experts
