// SPDX-License-Identifier: Apache-2.0
// A bank of linear Kalman filters for the drift of one axis, alike but for how fast things may
// change, averaged by how well each has foretold the labels (Bayesian model averaging with
// forgetting; Raftery, Karny and Ettler, Technometrics 52, 2010).
//
// State of a filter: a level that walks, with `slopes` a slope that dies away (integrated
// Ornstein-Uhlenbeck process), and a constant coefficient for each thermal term. Measurement: a
// label, level plus coefficients times basis, with the label's own variance.
//
// Times in s; drift in any one unit (the caller's), variances in its square.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/core/state_archive.h"
#include "common/experts/linear_forecast.h"

namespace zerodrift::experts {

enum class SlopeModel : std::uint8_t { kNone, kDamped };

struct KalmanBankOptions {
  std::vector<std::size_t> terms{};  // of the basis; each once, ascending
  SlopeModel slopes = SlopeModel::kNone;
};

struct Labelled {
  double time_s = 0.0;      // end of the label; strictly increasing
  double duration_s = 0.0;  // > 0
  double drift = 0.0;
  double variance = 0.0;  // of the label as a measurement, > 0
  Basis basis{};
};

// One thread. learn() is O(filters * states^2) without allocation.
class KalmanBank {
 public:
  explicit KalmanBank(const KalmanBankOptions& options);

  void learn(const Labelled& label);
  [[nodiscard]] bool knows() const noexcept { return knows_; }
  // The clock was set back: the level and slopes are learned anew, coefficients stay.
  void restart() noexcept;
  // Forgets everything.
  void reset() noexcept;
  // The mean of all filters, by their weights. Only where it knows something.
  [[nodiscard]] const LinearForecast& forecast() const noexcept { return forecast_; }
  // What isn't known of the coefficient of one of its terms, of all filters by their weights; and
  // how that goes with another's.
  [[nodiscard]] double coefficient_variance(std::size_t term) const noexcept;
  [[nodiscard]] double coefficient_correlation(std::size_t a, std::size_t b) const noexcept;
  // Weights of the filters; they sum to 1.
  [[nodiscard]] std::span<const double> weights() const noexcept { return weights_; }

  // Its state (core/state_archive.h), for one of these options.
  void carry(core::StateArchive& archive);

 private:
  // What a filter believes of how fast things change, in variances of a label and its length.
  struct Belief {
    double walk = 0.0;         // of the level, per label
    double slope_share = 0.0;  // of the slope over a label, squared
    double prior = 0.0;        // of a coefficient, squared
    std::size_t slope_time = 0;
  };

  void begin(const Labelled& label);
  void note_unit(double variance) noexcept;
  void predict(double elapsed_s);
  void update(const Labelled& label);
  void note_evidence() noexcept;
  void weigh() noexcept;
  void average() noexcept;
  // State i of all filters, and the covariance of i and j <= i: the filters are the inner loop,
  // which the compiler can put side by side.
  [[nodiscard]] double* mean(std::size_t i) noexcept { return &mean_[i * filters()]; }
  [[nodiscard]] const double* mean(std::size_t i) const noexcept { return &mean_[i * filters()]; }
  [[nodiscard]] double* covariance(std::size_t i, std::size_t j) noexcept {
    return &covariance_[(i * (i + 1) / 2 + j) * filters()];
  }
  [[nodiscard]] const double* covariance(std::size_t i, std::size_t j) const noexcept {
    return &covariance_[(i * (i + 1) / 2 + j) * filters()];
  }
  [[nodiscard]] std::size_t state_of(std::size_t term) const noexcept;
  [[nodiscard]] std::size_t filters() const noexcept { return beliefs_.size(); }

  std::vector<std::size_t> terms_;
  std::size_t first_coefficient_ = 1;
  std::size_t states_ = 1;
  std::vector<Belief> beliefs_;
  std::vector<double> mean_;
  std::vector<double> covariance_;
  std::vector<double> gain_;  // of each state, over the innovation's deviation
  // Of each filter, as all that follows.
  std::vector<double> innovation_;  // over its deviation
  std::vector<double> variance_;    // of the innovation
  std::vector<double> per_deviation_;
  std::vector<double> log_weights_;
  std::vector<double> weights_;
  bool knows_ = false;
  bool has_time_ = false;  // `time_s_` is that of the newest label
  double time_s_ = 0.0;
  double unit_variance_ = 0.0;  // of a label, see note_unit()
  double unit_weight_ = 0.0;    // of the labels that it is the mean of
  double unit_s_ = 0.0;         // the first label's length
  LinearForecast forecast_{};
};

}  // namespace zerodrift::experts
