// SPDX-License-Identifier: Apache-2.0
// Several experts for the drift of one axis under one roof: each is judged at several ages of the
// newest label, and the forecast for an age is their mean with weights that this age has earned.
// Never a switch: who was best is rarely so for long.
//
// For each horizon h the forecasts made h ago are compared with each new label, before it is
// learned. With e_k the error of expert k, dt between two labels:
//   S_k <- a S_k + e_k^2,  N <- a N + 1,  a = exp(-dt / (8 max(h, 30 dt)))
//   weight_k ~ exp(-n/2 ln(S_k / N)),  n = 1 + N dt / h   (errors overlap), one ahead 1 + N / 2
// which is exponential weighting by the log-likelihood of errors whose variance is S_k / N. Holding
// the last minute has one nat of credit. A horizon that was never judged borrows the weights of the
// longest one below it.
//
// The interval of a horizon is the 95 % quantile of the stack's own past errors at it.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string_view>
#include <vector>

#include "common/core/ring_buffer.h"
#include "common/experts/kalman_bank.h"
#include "common/experts/linear_forecast.h"

namespace zerodrift::experts {

enum class Expert : std::uint8_t {
  kHold,
  kRandomWalk,
  kTrend,
  kLinear,
  kCubic,
  kLagged,
  kShupe,
  kOnlineSvr,
};
inline constexpr std::array kLinearExperts{Expert::kHold,   Expert::kRandomWalk, Expert::kTrend,
                                           Expert::kLinear, Expert::kCubic,      Expert::kLagged,
                                           Expert::kShupe};
inline constexpr std::size_t kExperts = kLinearExperts.size() + 1;
// hold, random-walk, trend, linear, cubic, lagged, shupe, online-svr.
[[nodiscard]] std::string_view name(Expert expert);
[[nodiscard]] KalmanBankOptions bank_options(Expert expert);  // of the linear ones but kHold

// Ages of the newest label at which experts are judged, s; the first is one label ahead.
inline constexpr std::array<double, 5> kHorizonsS{0.0, 60.0, 300.0, 900.0, 3600.0};
inline constexpr std::size_t kHorizons = kHorizonsS.size();

// The mean of the labels of the last minute.
class Hold {
 public:
  void learn(const Labelled& label);
  [[nodiscard]] const LinearForecast& forecast() const noexcept { return forecast_; }

 private:
  static constexpr double kWindowS = 60.0;
  struct Held {
    double time_s = 0.0;
    double drift = 0.0;
  };
  core::RingBuffer<Held> held_{256};
  LinearForecast forecast_{};
};

// What the online SVR, which is not linear and is kept elsewhere, foretold of a label when its
// newest label was as old as each horizon; nothing where it did not know or is left out.
using Foretold = std::array<std::optional<double>, kHorizons>;

// One thread. 0.3 MB; learn() is O(banks), some microseconds, without allocation.
class ExpertStack {
 public:
  ExpertStack();

  void learn(const Labelled& label, const Foretold& by_svr = {});
  [[nodiscard]] bool knows() const noexcept { return labels_ > 0; }

  struct Prediction {
    double drift = 0.0;
    double variance = -1.0;  // of the drift and a label's noise together; negative: never judged
  };
  // At a time from the newest label's on. `by_svr`: what the online SVR says now. O(terms).
  [[nodiscard]] Prediction predict(double time_s, const Basis& basis,
                                   std::optional<double> by_svr = {}) const noexcept;
  // Shares of the experts at an age of the newest label; they sum to 1.
  [[nodiscard]] std::array<double, kExperts> shares(double age_s) const noexcept;
  [[nodiscard]] const LinearForecast& forecast(Expert expert) const noexcept;

 private:
  static constexpr std::size_t kSnapshots = 32;  // over a horizon
  static constexpr std::size_t kErrors = 256;
  // Of the linear experts, and how much of the SVR comes to it.
  struct Mean {
    LinearForecast linear{};
    double svr_share = 0.0;
    [[nodiscard]] double at(double time_s, const Basis& basis,
                            std::optional<double> by_svr) const noexcept {
      const double sum = linear.at(time_s, basis);
      return by_svr ? sum + svr_share * (*by_svr - sum) : sum;
    }
  };
  struct Snapshot {
    std::array<LinearForecast, kLinearExperts.size()> expert{};
    Mean mean{};
  };
  struct Horizon {
    core::RingBuffer<Snapshot> made{kSnapshots + 1};
    std::array<double, kExperts> squares{};
    double count = 0.0;
    std::array<double, kExperts> weights{};
    Mean mean{};
    core::RingBuffer<double> errors{kErrors};  // the stack's own, as they came
    std::vector<double> sorted{};              // the same
    double half_width = -1.0;                  // holds 95 % of the errors; negative: never judged
  };
  struct Between {
    std::size_t lower;
    std::size_t upper;
    double share;  // of the upper one
  };
  void judge(std::size_t h, const Snapshot& made, const Labelled& label,
             std::optional<double> by_svr);
  void note_error(std::size_t h, double error);
  void weigh(std::size_t h);
  void keep(std::size_t h);
  [[nodiscard]] Between between(double age_s) const noexcept;

  std::size_t labels_ = 0;
  double time_s_ = 0.0;
  double spacing_s_ = 0.0;  // between labels, smoothed
  Hold hold_;
  std::vector<KalmanBank> banks_;  // of all experts but the first
  std::array<Horizon, kHorizons> horizons_{};
};

}  // namespace zerodrift::experts
