// SPDX-License-Identifier: Apache-2.0
// What a stack of experts says of the drift to come, as small as a data path wants it: one linear
// form, the online SVR's share and an interval for each horizon, 240 numbers in all.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>

#include "common/experts/expert.h"
#include "common/experts/linear_forecast.h"
#include "common/experts/stated_intervals.h"
#include "common/experts/thermal_basis.h"

namespace zerodrift::experts {

// What the online SVR says of an instant.
struct SvrForecast {
  double drift = 0.0;
  bool interpolates = false;  // it has learned such features; else it goes beyond what it learned
  bool holds = false;         // it is not in force: the drift is that of the last minute
};

// The mean of all experts at one age of the newest label.
struct StackMean {
  LinearForecast linear{};  // of all but the SVR
  double svr_share = 0.0;
  // Only at the longest horizon, else 0: the share of all experts that map the temperature, and
  // what two kinds of them say. Where the temperature and its rate are such as were learned maps
  // interpolate, while an expert in time goes on with what it saw last: maps then have
  // kInterpolationOdds times their odds. If the SVR is in force, the drift is a function of these
  // two, and it and the cubic expert, which knows them alone as well, have half each; the memory of
  // others may be where nobody was. If it isn't, no such function was found, and all but the SVR
  // count by what they have earned.
  double maps_share = 0.0;
  LinearForecast cubic{};
  LinearForecast linear_maps{};

  // O(terms); no allocation.
  [[nodiscard]] double at(double time_s, const Basis& basis,
                          const std::optional<SvrForecast>& by_svr) const noexcept;
  void carry(core::StateArchive& archive) {
    archive(linear, svr_share, maps_share, cubic, linear_maps);
    archive.require(maps_share >= 0.0 && maps_share <= 1.0 + 1e-9);
  }
};

// What is not known of what drift owes to the temperature and to its rate, from what they were at
// the newest label on.
struct ThermalDoubt {
  double temperature = 0.0;
  double rate = 0.0;
  double temperature_variance = 0.0;  // of the coefficient
  double rate_variance = 0.0;
  double covariance = 0.0;

  // Of the drift's change until then.
  [[nodiscard]] double variance_at(const ThermalState& now) const noexcept {
    const double warmer = now.temperature - temperature;
    const double faster = now.rate - rate;
    return std::max(temperature_variance * warmer * warmer + rate_variance * faster * faster +
                        2.0 * covariance * warmer * faster,
                    0.0);
  }
  void carry(core::StateArchive& archive) {
    archive(temperature, rate, temperature_variance, rate_variance, covariance);
  }
};

struct StackForecast {
  struct Horizon {
    StackMean mean{};
    double half_width = -1.0;   // holds 95 % of the errors at labels; negative: never judged
    double judged_age_s = 0.0;  // of the forecasts that were judged, in the mean; 0: the horizon's
    std::array<double, kExperts> shares{};  // of the experts; they sum to 1
  };
  struct Prediction {
    double drift = 0.0;
    double variance = -1.0;   // of the drift, a label's noise not included; negative: unknown
    bool was_judged = false;  // forecasts of this age were; else the variance is an extrapolation
  };

  [[nodiscard]] bool knows() const noexcept { return label_variance > 0.0; }
  // At a time from the newest label's on; one before it is of unknown age: the longest horizon's.
  // `by_svr`: what the online SVR says of that time. How far the temperature is from that of the
  // newest label, by what isn't known of its effect, comes on top of the intervals; the errors that
  // were judged are without it. O(terms), no allocation.
  [[nodiscard]] Prediction predict(double now_s, const ThermalState& thermal,
                                   const std::optional<SvrForecast>& by_svr = {}) const noexcept;
  // Of a level that is held from one thermal state to another: the square of how much the drift
  // changes by what was learned of temperature for the longest horizon, and what isn't known of
  // that. The level itself need not be known. O(terms), no allocation.
  [[nodiscard]] double held_variance(const ThermalState& from,
                                     const ThermalState& to) const noexcept;
  [[nodiscard]] StatedIntervals intervals() const noexcept;
  // Shares of the experts at an age of the newest label, where the SVR says that; they sum to 1.
  [[nodiscard]] std::array<double, kExperts> shares(
      double age_s, const std::optional<SvrForecast>& by_svr = {}) const noexcept;
  // The longest age of the newest label that was judged, s; nothing: none was.
  [[nodiscard]] std::optional<double> longest_judged_s() const noexcept;

  double time_s = 0.0;          // of the newest label
  double spacing_s = 0.0;       // between labels, smoothed
  double label_variance = 0.0;  // of the newest label as a measurement; 0: there is none
  // What the drift at the newest label is known by at best: by how many labels have told of it
  // since it was last lost sight of.
  double level_variance = 0.0;
  ThermalDoubt doubt{};                // of the linear expert; zeros for experts in time
  double reference_temperature = 0.0;  // what the basis is about
  std::array<Horizon, kHorizons> horizons{};

 private:
  struct Between {
    std::size_t lower;
    std::size_t upper;
    double share;  // of the upper one
  };
  [[nodiscard]] double age_of(std::size_t h) const noexcept;
  [[nodiscard]] Between between(double age_s) const noexcept;
};

}  // namespace zerodrift::experts
