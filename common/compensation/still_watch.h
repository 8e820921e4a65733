// SPDX-License-Identifier: Apache-2.0
// Tells a level that stays, give or take noise and drift, from one that only turns round there.
#pragma once

#include <cstddef>

#include "common/core/axis.h"
#include "common/core/state_archive.h"
#include "common/core/time.h"

namespace zerodrift::compensation {

// Follows the block means from the first one of a still stretch on, wherever their level is. The
// stretch ends with a block outside of the noise, with a trend that is faster than drift, or with a
// curvature that no drift has: a sway that turns round. Cost: O(1) a block. One thread.
class StillWatch {
 public:
  // What an axis measured in a block, and what may move it at rest.
  struct Block {
    bool is_measured = false;
    double mean_radps = 0.0;
    double sigma_radps = 0.0;  // of a block mean at rest
    double slew_radps2 = 0.0;  // by which drift moves the level at most
  };

  // Whether the stretch goes on; else it ended before this block, which is of another level, or is
  // known by it to have been none.
  enum class Finding { kStays, kJumps, kMoves };
  Finding add(core::SensorTime begin, core::SensorTime end,
              const core::PerAxis<Block>& blocks) noexcept;
  void restart() noexcept;

  // The beginning of the stretch; kNever before the first block.
  [[nodiscard]] core::SensorTime since() const noexcept { return since_; }
  [[nodiscard]] core::SensorTime end() const noexcept { return end_; }  // of its newest block
  // The level that the stretch began with, moved by no more than drift.
  [[nodiscard]] double anchor(core::Axis axis) const noexcept {
    return axes_[core::index(axis)].anchor;
  }

  void carry(core::StateArchive& archive) { archive(since_, end_, axes_); }

 private:
  struct AxisState {
    std::size_t blocks = 0;
    bool is_even = true;  // without pauses
    double first = 0.0;
    double level = 0.0;
    double anchor = 0.0;
    double sum = 0.0;    // of the first blocks' distances from the first one, and of the same times
    double sum_k = 0.0;  // the block's number
    double sum_kk = 0.0;  // and its square

    void carry(core::StateArchive& archive) {
      archive.counts(blocks);
      archive(is_even, first, level, anchor, sum, sum_k, sum_kk);
    }
  };
  static Finding follow(const Block& block, double elapsed_s, AxisState& state) noexcept;
  [[nodiscard]] static bool turns(const Block& block, double slew_radps,
                                  const AxisState& state) noexcept;

  core::SensorTime since_{core::kNever};
  core::SensorTime end_{core::kNever};
  core::PerAxis<AxisState> axes_{};
};

}  // namespace zerodrift::compensation
