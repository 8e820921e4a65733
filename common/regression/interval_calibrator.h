// SPDX-License-Identifier: Apache-2.0
// Makes the predictive variance of any scheme honest at the horizon at which it is used: scales it
// so that 95 % of the labels lie within kIntervalHalfWidth standard deviations of the prediction.
//
// Adaptive conformal inference (Gibbs & Candès, NeurIPS 2021) on the logarithm of the scale, with
// decreasing steps at first (Angelopoulos, Barber & Bates, ICML 2024):
//
//   log s += step (missed - 0.05),   missed: error² > 1.96² (stated s² raw + label variance)
//
// What counts is the interval that was really stated, so whatever the law of the errors, however
// they are correlated and however late their labels come, the share of misses over n errors at one
// step is within |change of log s| / (n step) of 5 %. The later labels come, the longer a burst of
// misses goes unanswered; the step is therefore at most one over the errors that came in between.
// The scale belongs to the drift's variance alone: an overstated variance of the labels can't be
// made good and leaves the intervals too wide.
#pragma once

#include <cstdint>

namespace zerodrift::regression {

inline constexpr double kIntervalMissRate = 0.05;
inline constexpr double kIntervalHalfWidth = 1.959963984540054;  // standard deviations

// To be kept with the prediction until its label comes.
struct StatedVariance {
  double raw = -1.0;              // by the scheme; negative: unknown
  double calibrated = -1.0;       // of the drift, the label's noise not included; negative: unknown
  bool is_error_based = true;     // calibrated comes from past errors, not from raw
  std::uint64_t errors_seen = 0;  // when it was stated
};

// One calibrator for one scheme at one horizon. O(1), nothing allocated. One thread.
class IntervalCalibrator {
 public:
  // Variance of a new prediction's drift. Where the scheme states none, or too few of its variances
  // have been seen yet, it comes from the mean square of past errors. Before the first error: as
  // the scheme states it.
  [[nodiscard]] StatedVariance calibrate(double raw_variance) const noexcept;

  // A prediction's label has come: its drift less the prediction, what calibrate() gave with the
  // prediction, and the label's own variance, > 0.
  void observe(double error, const StatedVariance& stated, double label_variance) noexcept;

 private:
  struct Error {
    double square;
    double label_variance;
    double most_step;
    bool missed;
  };

  // The scale of one kind of raw variance: started from the first errors' mean square, then
  // following their quantile.
  class Scale {
   public:
    void follow(const Error& error, double raw) noexcept;
    [[nodiscard]] double apply(double raw) const noexcept;
    [[nodiscard]] bool is_started() const noexcept;

   private:
    std::uint64_t count_ = 0;
    double raw_sum_ = 0.0;    // over the start
    double drift_sum_ = 0.0;  // of error² less label variance
    double logarithm_ = 0.0;
  };

  [[nodiscard]] double error_based() const noexcept;
  [[nodiscard]] double bounded(double raw) const noexcept;

  std::uint64_t count_ = 0;
  double mean_square_ = 0.0;        // of the errors, exponentially weighted
  double mean_drift_square_ = 0.0;  // the same less the labels' variances
  Scale scheme_scale_, error_scale_;
};

}  // namespace zerodrift::regression
