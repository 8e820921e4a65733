// SPDX-License-Identifier: Apache-2.0
#include "common/compensation/residual_correction.h"

#include <algorithm>
#include <cmath>

namespace zerodrift::compensation {

void ResidualCorrection::restart() noexcept {
  epoch_count_ = refused_in_row_ = 0;
  epochs_ = {};
  axes_ = {};
  stepped_ = core::kNever;
}

void ResidualCorrection::note_epoch(core::SensorTime time, std::uint64_t epoch) noexcept {
  if (epoch_count_ > 0 && epochs_[(epoch_count_ - 1) % kEpochs].epoch == epoch) return;
  epochs_[epoch_count_ % kEpochs] = {time, epoch};
  ++epoch_count_;
  axes_ = {};
  refused_in_row_ = 0;
}

bool ResidualCorrection::was_in_force(std::uint64_t epoch, core::SensorTime time) const noexcept {
  const std::uint64_t oldest = epoch_count_ > kEpochs ? epoch_count_ - kEpochs : 0;
  for (std::uint64_t k = epoch_count_; k > oldest; --k) {
    const EpochSpan& span = epochs_[(k - 1) % kEpochs];
    if (span.since <= time) return span.epoch == epoch;
  }
  return false;
}

ReferenceVerdict ResidualCorrection::take(const core::RateReferenceSample& residual, bool at_rest,
                                          const core::PerAxis<OwnForecast>& forecast) noexcept {
  if (at_rest) return ReferenceVerdict::kAtRest;
  if (refused_in_row_ >= kRefusalsBeforeDistrust) return ReferenceVerdict::kDistrusted;
  if (!was_in_force(residual.model_epoch, residual.time))
    return refuse(ReferenceVerdict::kWrongEpoch);
  return judge(residual, forecast);
}

ReferenceVerdict ResidualCorrection::refuse(ReferenceVerdict verdict) noexcept {
  if (++refused_in_row_ < kRefusalsBeforeDistrust) return verdict;
  for (AxisState& axis : axes_) axis.target = 0.0;
  return verdict;
}

// All axes or none: who is wrong on one is not believed on another.
ReferenceVerdict ResidualCorrection::judge(const core::RateReferenceSample& residual,
                                           const core::PerAxis<OwnForecast>& forecast) noexcept {
  core::PerAxis<double> targets{};
  core::PerAxis<bool> moves{};
  for (std::size_t i = 0; i < targets.size(); ++i) {
    const double own = forecast[i].variance;
    if (!residual.valid[i] || !(own > 0.0)) continue;
    const double sum = own + residual.variance[i];
    const double innovation = residual.rate_radps[i] - forecast[i].drift_radps;
    if (!(std::abs(innovation) <= options_.innovation_sigmas * std::sqrt(sum)))
      return refuse(ReferenceVerdict::kImplausible);
    const double bound =
        std::min(options_.largest_correction_radps, options_.innovation_sigmas * std::sqrt(own));
    targets[i] = std::clamp(own / sum * innovation, -bound, bound);
    moves[i] = true;
  }
  if (moves == core::PerAxis<bool>{}) return ReferenceVerdict::kNoForecast;
  refused_in_row_ = 0;
  for (std::size_t i = 0; i < targets.size(); ++i) {
    if (moves[i]) axes_[i].target = targets[i];
  }
  return ReferenceVerdict::kTaken;
}

void ResidualCorrection::step(core::SensorTime time) noexcept {
  const double elapsed_s =
      stepped_ == core::kNever || time <= stepped_ ? 0.0 : core::seconds(time - stepped_);
  stepped_ = time;
  const double kept = std::exp(-elapsed_s / options_.correction_memory_s);
  const double step = options_.correction_slew_radps2 * elapsed_s;
  const double bound = options_.largest_correction_radps;
  for (AxisState& axis : axes_) {
    axis.target *= kept;
    axis.correction += std::clamp(axis.target - axis.correction, -step, step);
    axis.correction = std::clamp(axis.correction, -bound, bound);
  }
}

}  // namespace zerodrift::compensation
