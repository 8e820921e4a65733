// SPDX-License-Identifier: Apache-2.0
// What a stack of experts says of the drift to come, as small as a data path wants it: one linear
// form, the online SVR's share and an interval for each horizon, 130 numbers in all.
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "common/experts/expert.h"
#include "common/experts/linear_forecast.h"
#include "common/experts/thermal_basis.h"

namespace zerodrift::experts {

// Ages of the newest label at which experts are judged, s; the first is one label ahead.
inline constexpr std::array<double, 5> kHorizonsS{0.0, 60.0, 300.0, 900.0, 3600.0};
inline constexpr std::size_t kHorizons = kHorizonsS.size();

// What the online SVR says of an instant.
struct SvrForecast {
  double drift = 0.0;
  bool interpolates = false;  // it has learned such features; else it went beyond what it learned
};

// The mean of the linear experts, and how much of the SVR comes to it.
struct StackMean {
  LinearForecast linear{};
  double svr_share = 0.0;

  [[nodiscard]] double at(double time_s, const Basis& basis,
                          const std::optional<SvrForecast>& by_svr) const noexcept {
    const double sum = linear.at(time_s, basis);
    return by_svr ? sum + svr_share * (by_svr->drift - sum) : sum;
  }
  // The same at the longest horizon. Of its errors too few are ever seen to tell who is right, and
  // those were made by experts that had learned less. What is known is whether the SVR has learned
  // such features: if so, a map of the temperature interpolates, while an expert in time goes on
  // with what it saw last. SVR and cubic, half of each, then have kInterpolationOdds times the
  // SVR's odds.
  [[nodiscard]] double at_longest(double time_s, const Basis& basis,
                                  const std::optional<SvrForecast>& by_svr,
                                  const LinearForecast& cubic) const noexcept;
  void carry(core::StateArchive& archive) { archive(linear, svr_share); }
};

struct StackForecast {
  struct Horizon {
    StackMean mean{};
    double half_width = -1.0;  // holds 95 % of the errors at labels; negative: never judged
    std::array<double, kExperts> shares{};  // of the experts; they sum to 1
  };
  struct Prediction {
    double drift = 0.0;
    double variance = -1.0;   // of the drift, a label's noise not included; negative: unknown
    bool was_judged = false;  // forecasts of this age were; else the variance is an extrapolation
  };

  [[nodiscard]] bool knows() const noexcept { return label_variance > 0.0; }
  // At a time from the newest label's on; one before it is of unknown age: the longest horizon's.
  // `by_svr`: what the online SVR says of that time. An age never judged has the interval of the
  // longest one that was, growing in proportion. O(terms), no allocation.
  [[nodiscard]] Prediction predict(double now_s, const ThermalState& thermal,
                                   const std::optional<SvrForecast>& by_svr = {}) const noexcept;
  // Shares of the experts at an age of the newest label, where the SVR interpolates or not; they
  // sum to 1.
  [[nodiscard]] std::array<double, kExperts> shares(double age_s,
                                                    bool interpolates = false) const noexcept;
  // The longest age of the newest label that was judged, s; nothing: none was.
  [[nodiscard]] std::optional<double> longest_judged_s() const noexcept;

  double time_s = 0.0;                 // of the newest label
  double spacing_s = 0.0;              // between labels, smoothed
  double label_variance = 0.0;         // of the newest label as a measurement; 0: there is none
  double reference_temperature = 0.0;  // what the basis is about
  LinearForecast cubic{};              // beside the SVR, where that interpolates
  std::array<Horizon, kHorizons> horizons{};

 private:
  struct Between {
    std::size_t lower;
    std::size_t upper;
    double share;  // of the upper one
  };
  [[nodiscard]] double mean_at(std::size_t h, double now_s, const Basis& basis,
                               const std::optional<SvrForecast>& by_svr) const noexcept;
  [[nodiscard]] double age_of(std::size_t h) const noexcept;
  [[nodiscard]] Between between(double age_s) const noexcept;
  [[nodiscard]] double half_width(double age_s, const Between& at) const noexcept;
};

}  // namespace zerodrift::experts
