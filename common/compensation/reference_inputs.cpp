// SPDX-License-Identifier: Apache-2.0
#include "common/compensation/reference_inputs.h"

#include <utility>

namespace zerodrift::compensation {
namespace {

constexpr std::size_t kWaiting = 4096;  // of each kind
// Samples farther apart are no stream that a filter could answer within kFeedbackDelay.
constexpr core::SensorTime kFarthestApart = kFeedbackDelay / 2;

}  // namespace

ReferenceInputs::ReferenceInputs(const ReferenceOptions& options)
    : options_(options),
      true_rates_(kWaiting),
      rests_(kWaiting),
      residuals_(kWaiting),
      correction_(options) {
  if (options.await_feedback) rests_.expect();
}

const ReferenceQueue& ReferenceInputs::queue_of(core::ReferenceKind kind) const noexcept {
  if (kind == core::ReferenceKind::kNavigationResidual) return residuals_;
  return kind == core::ReferenceKind::kRest ? rests_ : true_rates_;
}

ReferenceQueue& ReferenceInputs::queue_of(core::ReferenceKind kind) noexcept {
  return const_cast<ReferenceQueue&>(std::as_const(*this).queue_of(kind));
}

void ReferenceInputs::push(const core::RateReferenceSample& sample) noexcept {
  core::RateReferenceSample reference = sample;
  const ReferenceVerdict verdict = screen(options_, reference);
  const bool is_residual = sample.kind == core::ReferenceKind::kNavigationResidual;
  // A residual that can be used is judged, and counted, when it is due.
  if (!is_residual || verdict != ReferenceVerdict::kTaken) count(verdict);
  if (verdict == ReferenceVerdict::kUnknownKind || verdict == ReferenceVerdict::kNotAccepted ||
      verdict == ReferenceVerdict::kTimeUnusable) {
    return;
  }
  queue_of(sample.kind).push(reference);
}

void ReferenceInputs::give_up_waiting() noexcept {
  true_rates_.give_up_waiting();
  rests_.give_up_waiting();
}

bool ReferenceInputs::complete_for(const core::AngularRateSample& sample,
                                   core::SensorTime stream_began) const noexcept {
  if (!true_rates_.complete_to(sample.time)) return false;
  // A filter of a slower gyro can't have answered by then.
  if (!(sample.interval_s <= core::seconds(kFarthestApart)) || follows_gap(sample)) return true;
  if (stream_began == core::kNever || sample.time - kFeedbackDelay < stream_began) return true;
  return rests_.complete_to(sample.time - kFeedbackDelay);
}

// Of a gap no filter has anything to say: it hears of it by this sample's answer.
bool ReferenceInputs::follows_gap(const core::AngularRateSample& sample) const noexcept {
  return sample.interval_s <= core::seconds(kFarthestApart) && newest_ != core::kNever &&
         sample.time - newest_ > kFarthestApart;
}

void ReferenceInputs::begin(const core::AngularRateSample& sample) noexcept {
  is_behind_gap_ = follows_gap(sample);
  newest_ = sample.time;
}

const core::RateReferenceSample* ReferenceInputs::true_rate(core::SensorTime now) noexcept {
  return true_rates_.at(now, kOldestReference);
}

const core::RateReferenceSample* ReferenceInputs::rest(core::SensorTime now,
                                                       EarthRateMode mode) noexcept {
  if (is_behind_gap_) return nullptr;  // whatever has come by now
  const core::RateReferenceSample* rest =
      rests_.at(now - kFeedbackDelay, kOldestReference - kFeedbackDelay);
  if (rest == nullptr || rest->valid == core::PerAxis<bool>{}) return nullptr;
  if (mode != EarthRateMode::kIncluded) return rest;
  if (rest->time != refused_rest_) count(ReferenceVerdict::kEarthRateIncluded);
  refused_rest_ = rest->time;
  return nullptr;
}

void ReferenceInputs::correct(core::SensorTime now, std::uint64_t model_epoch, bool at_rest,
                              const core::PerAxis<OwnForecast>& forecast) noexcept {
  if (options_.navigation_residual != ReferencePolicy::kAccept) return;
  correction_.note_epoch(now, model_epoch);
  const core::RateReferenceSample* residual =
      residuals_.at(now - kFeedbackDelay, kOldestReference - kFeedbackDelay);
  if (residual != nullptr && residual->valid != core::PerAxis<bool>{} &&
      residual->time != taken_residual_) {
    taken_residual_ = residual->time;
    count(correction_.take(*residual, at_rest, forecast));
  }
  correction_.step(now);
}

void ReferenceInputs::restart_ended() noexcept {
  true_rates_.restart_ended();
  rests_.restart_ended();
  residuals_.restart_ended();
}

void ReferenceInputs::restart() noexcept {
  true_rates_.restart();
  rests_.restart();
  residuals_.restart();
}

void ReferenceInputs::forget_time() noexcept {
  correction_.restart();
  newest_ = core::kNever;
  if (options_.await_feedback) rests_.expect();
}

bool ReferenceInputs::has_received(const core::RateReferenceSample& sample) const noexcept {
  return sample.time <= queue_of(sample.kind).spoken_to();
}

}  // namespace zerodrift::compensation
