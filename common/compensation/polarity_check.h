// SPDX-License-Identifier: Apache-2.0
// Whether an axis turns the other way round than its reference, or than the Earth, says.
//
// Against a true rate: levels that are steady for some seconds are compared with the steady level
// before, so that neither drift nor a late reference can pass for a sign. A change of the true rate
// that the gyro shows with the opposite sign is a vote; three in a row, and none to the contrary,
// are the verdict, and one right change takes it back; a rate that moves by itself is no answer.
// A reference that is late by half a period of what the axis does all the time shows the opposite
// of it, too: where the levels of the last while can be explained by some lateness and the right
// sign, there is no verdict until something comes that can't be, such as a rest of another length.
// Against the Earth's known rate: where the largest plausible drift is configured and smaller than
// the Earth's rate on the axis, the mean of a minute at rest can be explained by one sign only. All
// else is undecidable, and says nothing.
//
// O(1) a sample, no allocation.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "common/core/axis.h"
#include "common/core/state_archive.h"
#include "common/core/time.h"

namespace zerodrift::compensation {

class PolarityCheck {
 public:
  enum class Source : std::uint8_t { kTrueRate, kEarth };

  // `largest_drift_radps`: what is larger can't be drift; no limit: above kNoLimit.
  explicit PolarityCheck(double largest_drift_radps) : largest_drift_(largest_drift_radps) {}

  // Of a sample: what the gyro measured and what is known of the true rate, rad/s.
  void add(core::Axis axis, double rate_radps, double known_radps, Source source) noexcept;
  // The block of about a second is over.
  void close(core::SensorTime now) noexcept;
  // The time began anew; verdicts stay.
  void restart() noexcept;

  [[nodiscard]] bool is_reversed(core::Axis axis) const noexcept {
    return axes_[core::index(axis)].reversed;
  }
  // How often an axis was found reversed that was not before.
  [[nodiscard]] std::uint64_t found() const noexcept { return found_; }

  // Its state (core/state_archive.h).
  void carry(core::StateArchive& archive) { archive(axes_, found_); }

 private:
  // Sums over blocks whose true rate is the same.
  struct Level {
    std::uint64_t blocks = 0;
    double rate = 0.0;
    double known = 0.0;
    double squares = 0.0;  // of the rate's differences from block to block
    double newest = 0.0;
    // Of these, the size of the largest but the newest one: a reference may be late by a block.
    double largest = 0.0;
    double newest_step = 0.0;
    core::SensorTime begin{0};
    core::SensorTime end{0};

    [[nodiscard]] double mean_rate() const { return rate / static_cast<double>(blocks); }
    [[nodiscard]] double mean_known() const { return known / static_cast<double>(blocks); }
    void carry(core::StateArchive& archive) {
      archive(blocks, rate, known, squares, newest, largest, newest_step, begin, end);
    }
  };
  static constexpr std::size_t kLevelsKept = 8;
  struct Axis {
    std::uint64_t samples = 0;  // of the block, with sums of both
    double rate = 0.0;
    double known = 0.0;
    bool of_earth = false;
    Level level{};                          // the one that lasts
    Level before{};                         // the steady one before it; no blocks: none
    std::array<Level, kLevelsKept> past{};  // steady ones, newest first; no blocks: none
    std::uint64_t votes = 0;
    bool reversed = false;

    void carry(core::StateArchive& archive) {
      archive(samples, rate, known, of_earth, level, before, past, votes, reversed);
    }
  };
  void close(Axis& axis, core::SensorTime now) noexcept;
  void judge_change(Axis& axis) noexcept;
  void judge_earth(Axis& axis) noexcept;
  void vote(Axis& axis, std::uint64_t needed) noexcept;
  // `change`: of the true rate, by which differences count. `moves`: from block to block; where the
  // rate does so by more, it has no level.
  static bool may_be_late(const Axis& axis, double change) noexcept;
  static bool is_explained(const Axis& axis, double late_s, double change, double moves) noexcept;

  double largest_drift_;
  core::PerAxis<Axis> axes_{};
  std::uint64_t found_ = 0;
};

}  // namespace zerodrift::compensation
