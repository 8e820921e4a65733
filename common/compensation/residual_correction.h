// SPDX-License-Identifier: Apache-2.0
// What a navigation filter's residual may do while the model is frozen: shift the applied drift, a
// little, for a while.
//
// A residual reference states the drift: what was applied at its time + what the filter found left.
// It is no label: nothing is learned from it, the model and its forecasts stay to the bit what they
// would be without. The forecast it is held against is the one without correction, so the filter's
// answer to a correction is no new correction, and a filter that is wrong in any way moves the
// output by at most `largest_correction_radps`:
//
//   innovation = residual - forecast,   refused beyond innovation_sigmas sqrt(V_f + V_r)
//   target = V_f / (V_f + V_r) innovation, within +-min(largest, innovation_sigmas sqrt(V_f))
//
// and the correction goes there at a limited slew. It fades with correction_memory_s, ends at once
// when the next label is learned (which measures the drift anew: never two corrections of one
// thing), and several refusals in a row end it too: then the filter is not used until that label.
// The published variance stays the forecast's: the filter's opinion rests on the same samples.
//
// O(1) a sample, no allocation, deterministic in sensor time.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "common/compensation/reference_screen.h"
#include "common/core/state_archive.h"

namespace zerodrift::compensation {

// The compensator's own estimate of one axis, without correction; a variance below 0: none.
struct OwnForecast {
  double drift_radps = 0.0;
  double variance = -1.0;
};

class ResidualCorrection {
 public:
  explicit ResidualCorrection(const ReferenceOptions& options) : options_(options) {}

  // The model in force from this sample on.
  void note_epoch(core::SensorTime time, std::uint64_t epoch) noexcept;
  // A residual that came due, each once.
  ReferenceVerdict take(const core::RateReferenceSample& residual, bool at_rest,
                        const core::PerAxis<OwnForecast>& forecast) noexcept;
  void step(core::SensorTime time) noexcept;
  void restart() noexcept;

  [[nodiscard]] double correction_radps(std::size_t axis) const noexcept {
    return axes_[axis].correction;
  }

  // Its state (core/state_archive.h).
  void carry(core::StateArchive& archive) {
    archive(epochs_, epoch_count_, axes_, stepped_, refused_in_row_);
  }

 private:
  struct EpochSpan {
    core::SensorTime since{core::kNever};
    std::uint64_t epoch = 0;
    void carry(core::StateArchive& archive) { archive(since, epoch); }
  };
  struct AxisState {
    double correction = 0.0;
    double target = 0.0;
    void carry(core::StateArchive& archive) { archive(correction, target); }
  };
  static constexpr std::size_t kEpochs = 8;  // a label takes 5 s: 1 s needs two
  static constexpr std::uint64_t kRefusalsBeforeDistrust = 3;

  [[nodiscard]] bool was_in_force(std::uint64_t epoch, core::SensorTime time) const noexcept;
  [[nodiscard]] ReferenceVerdict judge(const core::RateReferenceSample& residual,
                                       const core::PerAxis<OwnForecast>& forecast) noexcept;
  ReferenceVerdict refuse(ReferenceVerdict verdict) noexcept;

  ReferenceOptions options_;
  std::array<EpochSpan, kEpochs> epochs_{};  // the newest at (epoch_count_ - 1) % kEpochs
  std::uint64_t epoch_count_ = 0;
  core::PerAxis<AxisState> axes_{};
  core::SensorTime stepped_{core::kNever};
  std::uint64_t refused_in_row_ = 0;
};

}  // namespace zerodrift::compensation
