// SPDX-License-Identifier: Apache-2.0
// Decides when a gyro's output may be taken for drift. True rotation is never learned.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "common/compensation/still_watch.h"
#include "common/core/axis.h"
#include "common/core/mode.h"
#include "common/core/state_archive.h"
#include "common/core/time.h"

namespace zerodrift::compensation {

// Mean over about one second of what is left of the rate after reference or Earth rate is taken
// off: drift, if the gyro is at rest or the reference right.
struct DriftBlock {
  core::SensorTime begin{0};
  core::SensorTime end{0};
  core::PerAxis<double> mean_radps{};
  core::PerAxis<double> variance_radps2{};     // of the samples about the mean; 0 where count < 2
  core::PerAxis<std::size_t> count{};          // valid samples; 0: the axis was not measured
  core::PerAxis<double> reference_variance{};  // (rad/s)², largest of the references taken off
  bool has_reference = false;                  // against a rate reference, else at rest

  void carry(core::StateArchive& archive) {
    archive(begin, end, mean_radps, variance_radps2, count, reference_variance, has_reference);
    archive.require(begin != core::kNever && end != core::kNever);
  }
};

struct RestGateOptions {
  double departure_sigmas = 6.0;      // a block this many sigmas off the level is motion (5 days of
                                      // false alarms at one block a second: 1)
  double max_slew_radps2 = 2.424e-7;  // the level may move this fast: 0.05 deg/h per s
  double noise_slew_per_s = 0.05;     // or by this many block sigmas per second, for noisier gyros
  double max_level_radps = 1e30;      // without a reference, a larger level is motion
  double spread_ratio = 2.0;  // samples spread this much wider than at rest: vibration or motion;
                              // where they come faster than then, by the root of how much, too
  std::size_t initial_blocks =
      10;                // blocks that must agree before the first level is believed; also those
                         // in which an axis that appears later must be still with the others
  double dwell_s = 5.0;  // stillness before the gate opens again
};

// Where the level of an axis can be before the gate has seen it: it is known from before the clock
// was set, or from an earlier run.
struct ExpectedLevel {
  double lowest_radps = 0.0;
  double highest_radps = 0.0;
  double sigma_radps = 0.0;  // of both
};
using ExpectedLevels = core::PerAxis<std::optional<ExpectedLevel>>;

enum class RestState { kInitial, kMotion, kLevelImplausible, kSettling, kRest };
// Why nothing is learned in it; kNone: it is.
[[nodiscard]] core::Reason reason_of(RestState state) noexcept;

// A generalised likelihood ratio test on the block means: the hypothesis "same level as at rest,
// give or take what drift can do since" against "another level", with the noise estimated from the
// blocks themselves (sigma² = half the mean squared successive difference), so that no knowledge of
// the gyro is needed. Rotation slower than the slew limit onto a level within the noise cannot be
// distinguished from drift without a reference. Another level that was come to smoothly and faster
// than drift counts only once it has stayed (still_watch.h): a sway turns round there. Cost: O(1) a
// block. One thread.
class RestGate {
 public:
  explicit RestGate(const RestGateOptions& options);

  // A block without any sample says nothing and changes nothing. `expected`: the first level of an
  // axis elsewhere is motion, until it may have drifted there as any other; unless its blocks have
  // a reference. `is_reversed`: such an axis shows the Earth the wrong way round, so that its level
  // says nothing of whether it is plausible.
  RestState add(const DriftBlock& block, const ExpectedLevels& expected = {},
                const core::PerAxis<bool>& is_reversed = {}) noexcept;
  // A block known from elsewhere to be in motion (a reference says so, a sensor saturated).
  RestState motion() noexcept;

  [[nodiscard]] RestState state() const noexcept { return state_; }
  // Whether motion of this axis would be noticed: its level and noise are known.
  [[nodiscard]] bool knows(core::Axis axis) const noexcept {
    return has_levels_ && axes_[core::index(axis)].known;
  }
  // Standard deviation of a block mean at rest, rad/s.
  [[nodiscard]] double block_sigma(core::Axis axis) const noexcept;
  // The same; 0 where it isn't known.
  [[nodiscard]] double known_sigma(core::Axis axis) const noexcept {
    return knows(axis) ? block_sigma(axis) : 0.0;
  }
  // Variance of single samples about their block mean at rest, (rad/s)².
  [[nodiscard]] double sample_variance(core::Axis axis) const noexcept {
    return axes_[core::index(axis)].spread;
  }
  [[nodiscard]] double level(core::Axis axis) const noexcept {
    return axes_[core::index(axis)].level;
  }

  // How often a gyro stayed where it began, outside of what was expected: it is another one, its
  // bias doesn't repeat, or it rotates all the time.
  [[nodiscard]] std::uint64_t unforeseen_starts() const noexcept { return unforeseen_starts_; }

  void restart() noexcept;
  // Time went on by `by` at once, without samples: a clock was set forward, or the gyro wasn't
  // received. The drift is given no time to move in: until it is believed elsewhere, the level is
  // motion for as long as at any other time.
  void skip(core::SensorTime by) noexcept;

  // Its state (core/state_archive.h).
  void carry(core::StateArchive& archive) {
    archive(state_, has_levels_, axes_, level_time_, still_since_, initial_, initial_count_, watch_,
            unforeseen_levels_, unforeseen_starts_);
    archive.require(state_ <= RestState::kRest && initial_count_ <= options_.initial_blocks);
    archive.require(level_time_ != core::kNever);
    archive.require(has_levels_ || state_ == RestState::kInitial ||
                    state_ == RestState::kLevelImplausible);
    archive.require(state_ != RestState::kSettling || still_since_ != core::kNever);
  }

 private:
  struct AxisState {
    bool known = false;
    double level = 0.0;
    double noise = 0.0;    // variance of a block mean
    double spread = 0.0;   // variance of samples within a block
    double rate_hz = 0.0;  // of the samples of that spread
    double previous = 0.0;
    std::size_t blocks = 0;

    void carry(core::StateArchive& archive) {
      archive(known, level, noise, spread, rate_hz, previous);
      archive.counts(blocks);
    }
  };
  static constexpr std::size_t kMaxInitialBlocks = 32;

  RestState collect_initial(const DriftBlock& block, const ExpectedLevels& expected) noexcept;
  [[nodiscard]] bool leaves(const ExpectedLevels& expected) noexcept;
  [[nodiscard]] double nearest_expected(
      const AxisState& axis, const std::optional<ExpectedLevel>& expected) const noexcept;
  [[nodiscard]] bool initial_blocks_agree() const noexcept;
  void adopt_initial() noexcept;
  [[nodiscard]] double threshold(const AxisState& axis, double elapsed_s) const noexcept;
  [[nodiscard]] bool departs(const DriftBlock& block) const noexcept;
  [[nodiscard]] bool level_implausible(const DriftBlock& block,
                                       const core::PerAxis<bool>& is_reversed) const noexcept;
  [[nodiscard]] double slew(const AxisState& axis, double times_noise) const noexcept;
  [[nodiscard]] bool watch(const DriftBlock& block) noexcept;
  [[nodiscard]] bool is_doubtful(const DriftBlock& block) const noexcept;
  [[nodiscard]] bool stayed_where_it_began() const noexcept;
  void follow_levels() noexcept;
  [[nodiscard]] bool track(const DriftBlock& block, const ExpectedLevels& expected) noexcept;
  static void track_spread(const DriftBlock& block, std::size_t axis, double gain,
                           AxisState& state) noexcept;

  RestGateOptions options_;
  RestState state_ = RestState::kInitial;
  bool has_levels_ = false;  // the first ones are believed
  core::PerAxis<AxisState> axes_{};
  core::SensorTime level_time_{0};  // when the level was last confirmed
  core::SensorTime still_since_{core::kNever};
  std::array<DriftBlock, kMaxInitialBlocks> initial_{};
  std::size_t initial_count_ = 0;
  StillWatch watch_{};
  std::optional<core::PerAxis<double>> unforeseen_levels_{};  // first ones, until rest
  std::uint64_t unforeseen_starts_ = 0;
};

}  // namespace zerodrift::compensation
