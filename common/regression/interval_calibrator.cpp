// SPDX-License-Identifier: Apache-2.0
#include "common/regression/interval_calibrator.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace zerodrift::regression {
namespace {

// Errors whose mean square starts the scale.
constexpr std::uint64_t kStart = 30;
// Steps: kFirstStep / sqrt(n), never below kLastStep. A smaller last step leaves the intervals
// behind a drift that changes its ways; a larger one makes them restless.
constexpr double kFirstStep = 0.5;
constexpr double kLastStep = 0.02;
// Errors that the mean square error remembers.
constexpr double kMemory = 1000.0;
// A scheme that trusts itself more and more (variance ~ 1/n) while its errors stay is taken to be
// no surer than this share of its mean square error.
constexpr double kLeastShare = 0.05;
// Least part of the mean square error that is the drift's: the difference to the labels' variances
// may come out negative.
constexpr double kLeastDriftPart = 1e-3;
// Where the drift's part of the interval is below this share of the label's, a smaller scale
// changes nothing, and going on down would only delay the way up.
constexpr double kNegligible = 0.01;
constexpr double kLeastLogarithm = -3.0;
constexpr double kLargestLogarithm = 12.0;

}  // namespace

StatedVariance IntervalCalibrator::calibrate(double raw_variance) const noexcept {
  StatedVariance stated{.raw = raw_variance, .errors_seen = count_};
  if (count_ == 0) {
    stated.calibrated = raw_variance;
  } else if (raw_variance >= 0.0 && scheme_scale_.is_started()) {
    stated.calibrated = scheme_scale_.apply(bounded(raw_variance));
    stated.is_error_based = false;
  } else {
    stated.calibrated = error_scale_.apply(error_based());
  }
  return stated;
}

void IntervalCalibrator::observe(double error, const StatedVariance& stated,
                                 double label_variance) noexcept {
  assert(std::isfinite(error) && label_variance > 0.0 && stated.errors_seen <= count_ &&
         "an error must be finite, its label's variance positive, and it can't be older than us");
  const double square = error * error;
  const double width = kIntervalHalfWidth * kIntervalHalfWidth;
  const double most_step = 1.0 / static_cast<double>(count_ - stated.errors_seen + 1);
  Error seen{.square = square,
             .label_variance = label_variance,
             .most_step = most_step,
             .missed = square > width * (stated.calibrated + label_variance)};
  // Each scale answers for its own intervals only; an error may start either.
  if (stated.is_error_based && count_ > 0) {
    if (stated.calibrated < 0.0) seen.most_step = 0.0;  // nothing stated: no hit, no miss
    error_scale_.follow(seen, error_based());
  }
  if (stated.raw >= 0.0) {
    seen.most_step = stated.is_error_based ? 0.0 : most_step;
    scheme_scale_.follow(seen, count_ > 0 ? bounded(stated.raw) : stated.raw);
  }

  ++count_;
  const double weight = 1.0 / std::min(static_cast<double>(count_), kMemory);
  mean_square_ += weight * (square - mean_square_);
  mean_drift_square_ += weight * (square - label_variance - mean_drift_square_);
}

double IntervalCalibrator::error_based() const noexcept {
  return std::max(mean_drift_square_, kLeastDriftPart * mean_square_);
}

double IntervalCalibrator::bounded(double raw) const noexcept {
  return std::max(raw, kLeastShare * error_based());
}

bool IntervalCalibrator::Scale::is_started() const noexcept {
  return count_ >= kStart;
}

double IntervalCalibrator::Scale::apply(double raw) const noexcept {
  return raw * std::exp(2.0 * logarithm_);
}

void IntervalCalibrator::Scale::follow(const Error& error, double raw) noexcept {
  ++count_;
  if (count_ <= kStart) {
    raw_sum_ += raw;
    drift_sum_ += error.square - error.label_variance;
    const double ratio = drift_sum_ > 0.0 && raw_sum_ > 0.0 ? drift_sum_ / raw_sum_ : 0.0;
    logarithm_ = std::clamp(0.5 * std::log(ratio), kLeastLogarithm, kLargestLogarithm);
    return;
  }
  if (!error.missed && apply(raw) < kNegligible * error.label_variance) return;
  const double due =
      std::max(kLastStep, kFirstStep / std::sqrt(static_cast<double>(count_ - kStart)));
  const double change = (error.missed ? 1.0 : 0.0) - kIntervalMissRate;
  logarithm_ = std::min(logarithm_ + std::min(due, error.most_step) * change, kLargestLogarithm);
}

}  // namespace zerodrift::regression
