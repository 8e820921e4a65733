// SPDX-License-Identifier: Apache-2.0
// What others say of the true rate, each kind in its queue until its sensor time has come: the true
// rate itself, rest, and a navigation filter's residual, which may correct the applied drift while
// the model is frozen.
//
// The data path's thread; noexcept, no allocation; O(1) a sample but for what came due.
#pragma once

#include <cstdint>

#include "common/compensation/input_alignment.h"
#include "common/compensation/options.h"
#include "common/compensation/reference_screen.h"
#include "common/compensation/residual_correction.h"
#include "common/core/samples.h"
#include "common/core/state_archive.h"

namespace zerodrift::compensation {

class ReferenceInputs {
 public:
  explicit ReferenceInputs(const ReferenceOptions& options);

  void push(const core::RateReferenceSample& sample) noexcept;
  // Whoever published this kind left.
  void end(core::ReferenceKind kind) noexcept { queue_of(kind).end(); }
  void give_up_waiting() noexcept;

  // Everything that is expected for this sample has come. `stream_began`: kNever before its first.
  [[nodiscard]] bool complete_for(const core::AngularRateSample& sample,
                                  core::SensorTime stream_began) const noexcept;
  // The true rate at that time, or null.
  [[nodiscard]] const core::RateReferenceSample* true_rate(core::SensorTime now) noexcept;
  // The sample whose references are asked for next.
  void begin(const core::AngularRateSample& sample) noexcept;
  // Rest as it was declared for that time, or null. `mode`: of the Earth's rate in this sample;
  // where it counts as drift, rest can't be taken for a true rate.
  [[nodiscard]] const core::RateReferenceSample* rest(core::SensorTime now,
                                                      EarthRateMode mode) noexcept;
  // Takes the residual that came due and moves the correction on to `now`.
  void correct(core::SensorTime now, std::uint64_t model_epoch, bool at_rest,
               const core::PerAxis<OwnForecast>& forecast) noexcept;
  [[nodiscard]] double correction_radps(std::size_t axis) const noexcept {
    return correction_.correction_radps(axis);
  }

  // The source of rates began anew: what is of publishers that left goes.
  void restart_ended() noexcept;
  // Their time began anew.
  void restart() noexcept;
  // The rates' time began anew: what was received of the time before is void.
  void forget_time() noexcept;

  // Part of the state already.
  [[nodiscard]] bool has_received(const core::RateReferenceSample& sample) const noexcept;
  // By verdict: when they came, residuals when due.
  [[nodiscard]] const ReferenceCounts& counts() const noexcept { return counts_; }

  // Its state (core/state_archive.h).
  void carry(core::StateArchive& archive) {
    archive(true_rates_, rests_, residuals_, correction_, counts_, refused_rest_, taken_residual_,
            newest_);
  }

 private:
  [[nodiscard]] ReferenceQueue& queue_of(core::ReferenceKind kind) noexcept;
  [[nodiscard]] const ReferenceQueue& queue_of(core::ReferenceKind kind) const noexcept;
  [[nodiscard]] bool follows_gap(const core::AngularRateSample& sample) const noexcept;
  void count(ReferenceVerdict verdict) noexcept { ++counts_[static_cast<std::size_t>(verdict)]; }

  ReferenceOptions options_;
  ReferenceQueue true_rates_;
  ReferenceQueue rests_;
  ReferenceQueue residuals_;
  ResidualCorrection correction_;
  ReferenceCounts counts_{};
  core::SensorTime refused_rest_{core::kNever};  // counted
  core::SensorTime taken_residual_{core::kNever};
  core::SensorTime newest_{core::kNever};  // of the samples
  bool is_behind_gap_ = false;             // that sample
};

}  // namespace zerodrift::compensation
