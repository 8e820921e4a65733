// SPDX-License-Identifier: Apache-2.0
// Tells a level that stays, give or take noise and drift, from the turning point of a sway.
#pragma once

#include <cstddef>

#include "common/core/axis.h"
#include "common/core/state_archive.h"
#include "common/core/time.h"

namespace zerodrift::compensation {

// Follows the block means whatever their level is: in stretches, which are still as far as noise
// and permitted drift tell, and in legs, which are what was travelled one way. A leg is fast where
// its end is further off its beginning than drift may come in that time. Who came by a fast leg has
// stayed only after twice the time that it took: a sway stays at its turning points for less. Drift
// within the permitted slew never makes a fast leg. Cost: O(1) a block. One thread.
class StillWatch {
 public:
  // What an axis measured in a block, and what may move it at rest.
  struct Block {
    bool is_measured = false;
    double mean_radps = 0.0;
    double margin_radps = 0.0;         // of one block mean's noise
    double drift_slew_radps2 = 0.0;    // by which drift moves the level at most,
    double slew_radps2 = 0.0;          // or where noise hides more,
    double resting_slew_radps2 = 0.0;  // or where it is followed at rest; each no smaller
  };

  // Whether the stretch goes on; else the block begins one. `is_believed`: it is taken for rest so
  // far.
  bool add(core::SensorTime begin, core::SensorTime end, const core::PerAxis<Block>& blocks,
           bool is_believed) noexcept;
  // A level of `blocks` blocks that ended now is the stretch's.
  void adopt(core::Axis axis, double level_radps, std::size_t blocks) noexcept;
  void begin(core::SensorTime since, core::SensorTime end) noexcept;
  // What was known from elsewhere to be motion ends the stretch and all legs.
  void jerk() noexcept;
  void skip(core::SensorTime by) noexcept;

  // Whether the axis has a level in this stretch.
  [[nodiscard]] bool follows(core::Axis axis) const noexcept {
    return axes_[core::index(axis)].blocks > 0;
  }
  [[nodiscard]] double level(core::Axis axis) const noexcept {
    return axes_[core::index(axis)].level;
  }
  // Whether the stretch is long enough for a level, after how the axis came to it.
  [[nodiscard]] bool has_stayed(core::Axis axis) const noexcept;
  // The largest change from block to block that the stretch was come to by, of any axis, rad/s;
  // what came before counts half at each stretch.
  [[nodiscard]] double jolt() const noexcept { return jolt_; }

  void carry(core::StateArchive& archive) {
    archive(since_, end_, is_believed_, jolt_, axes_);
    archive.require((since_ == core::kNever) == (end_ == core::kNever));
    for (const AxisState& state : axes_)
      archive.require(since_ == core::kNever || state.leg_since != core::kNever);
  }

 private:
  // The least-squares parabola through blocks without a pause between them.
  class Parabola {
   public:
    void add(double value) noexcept;
    void restart() noexcept { count_ = 0; }
    // Its trend, or its curvature, as the sign says, where one is beyond noise and drift; else 0.
    [[nodiscard]] double turn(double margin, double slew) const noexcept;

    void carry(core::StateArchive& archive) {
      archive.counts(count_);
      archive(first_, sum_, sum_k_, sum_kk_);
    }

   private:
    std::size_t count_ = 0;
    double first_ = 0.0;
    double sum_ = 0.0;     // of the blocks' distances from the first one, of the same times
    double sum_k_ = 0.0;   // the block's number,
    double sum_kk_ = 0.0;  // and its square
  };
  struct AxisState {
    std::size_t blocks = 0;
    double level = 0.0;
    double newest = 0.0;
    double grain = 0.0;  // smallest change from block to block: the step of a coarse output
    Parabola parabola{};
    bool is_rising = false;
    double leg_level = 0.0;
    core::SensorTime leg_since{core::kNever};
    core::SensorTime owed{0};  // the longest fast leg since the axis last stayed,
    core::SensorTime due{0};   // with this one

    void carry(core::StateArchive& archive) {
      archive.counts(blocks);
      archive(level, newest, grain, parabola, is_rising, leg_level, leg_since, owed, due);
    }
  };

  // Which way the axis leaves the stretch with this block; 0: it doesn't.
  [[nodiscard]] static double leaves(const Block& block, double elapsed_s,
                                     const AxisState& state) noexcept;
  void end_stretch(core::SensorTime begin, const core::PerAxis<double>& moves) noexcept;
  void follow(const Block& block, double block_s, double elapsed_s, AxisState& state) noexcept;

  core::SensorTime since_{core::kNever};
  core::SensorTime end_{core::kNever};
  bool is_believed_ = false;  // this stretch, at some time
  double jolt_ = 0.0;
  core::PerAxis<AxisState> axes_{};
};

}  // namespace zerodrift::compensation
