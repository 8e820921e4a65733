// SPDX-License-Identifier: Apache-2.0
#include "common/compensation/still_watch.h"

#include <algorithm>
#include <cmath>

namespace zerodrift::compensation {

namespace {

constexpr double kBlockSigmas = 6.0;      // a block this far from the level ends the stretch
constexpr double kLevelGain = 0.1;        // the level follows with a memory of 10 blocks
constexpr std::size_t kAnchorBlocks = 5;  // whose mean the anchor begins with
constexpr double kAnchorSigmas = 4.0;  // the level's distance from it: a mean of 5 and one of about
                                       // 20 blocks scatter by half a sigma, flicker noise by more
constexpr double kAnchorSlews = 5.0;   // and these many blocks of drift: a coarse quantisation
constexpr std::size_t kFirstFitted = 5;  // blocks whose trend and curvature are looked at
constexpr std::size_t kLastFitted = 40;
constexpr double kFitSigmas = 4.5;
constexpr double kPauseBlocks = 2.0;  // blocks further apart aren't equidistant

}  // namespace

void StillWatch::restart() noexcept {
  since_ = end_ = core::kNever;
  axes_ = {};
}

StillWatch::Finding StillWatch::add(core::SensorTime begin, core::SensorTime end,
                                    const core::PerAxis<Block>& blocks) noexcept {
  const double block_s = core::seconds(end - begin);
  double elapsed_s = block_s;
  if (since_ == core::kNever) {
    since_ = begin;
  } else {
    elapsed_s = core::seconds(end - end_);
  }
  end_ = end;
  Finding finding = Finding::kStays;
  for (const auto axis : core::kAxes) {
    const Block& block = blocks[core::index(axis)];
    if (block.is_measured) {
      AxisState& state = axes_[core::index(axis)];
      state.is_even = state.is_even && elapsed_s < kPauseBlocks * block_s;
      finding = std::max(finding, follow(block, elapsed_s, state));
    }
  }
  return finding;
}

StillWatch::Finding StillWatch::follow(const Block& block, double elapsed_s,
                                       AxisState& state) noexcept {
  const double x = block.mean_radps;
  if (state.blocks == 0) {
    state = {.blocks = 1, .first = x, .level = x, .anchor = x};
    return Finding::kStays;
  }
  const auto n = static_cast<double>(state.blocks);
  const double slew_radps = block.slew_radps2 * elapsed_s;
  const double widest = kBlockSigmas * block.sigma_radps * std::sqrt(1.0 + 1.0 / n) + slew_radps;
  if (!(std::abs(x - state.level) <= widest)) return Finding::kJumps;  // also when not a number
  ++state.blocks;
  state.level += std::max(kLevelGain, 1.0 / (n + 1.0)) * (x - state.level);
  if (state.blocks <= kAnchorBlocks) {
    state.anchor = state.level;
  } else {
    state.anchor += std::clamp(state.level - state.anchor, -slew_radps, slew_radps);
  }
  if (state.blocks <= kLastFitted) {
    state.sum += x - state.first;
    state.sum_k += n * (x - state.first);
    state.sum_kk += n * n * (x - state.first);
  }
  const bool is_drawn = std::abs(state.level - state.anchor) >
                        kAnchorSigmas * block.sigma_radps + kAnchorSlews * slew_radps;
  return is_drawn || turns(block, slew_radps, state) ? Finding::kMoves : Finding::kStays;
}

// The least-squares parabola through n equidistant blocks, of a trend b = sum u x / sum u² with
// u(k) = k - (n-1)/2, sum u² = n (n²-1) / 12, and a curvature c = sum p x / sum p² with
// p = u² - (n²-1)/12, sum p² = n (n²-1) (n²-4) / 180. Drift that turns from its fastest one way to
// its fastest the other way in these blocks is slew n / 4 deep.
bool StillWatch::turns(const Block& block, double slew_radps, const AxisState& state) noexcept {
  if (!state.is_even || state.blocks < kFirstFitted || state.blocks > kLastFitted) return false;
  const auto n = static_cast<double>(state.blocks);
  const double middle = (n - 1.0) / 2.0;
  const double squares = n * (n * n - 1.0) / 12.0;
  const double trend = (state.sum_k - middle * state.sum) / squares;
  if (std::abs(trend) > slew_radps + kFitSigmas * block.sigma_radps / std::sqrt(squares))
    return true;
  const double fourth_powers = squares * (n * n - 4.0) / 15.0;
  const double curvature = (state.sum_kk - 2.0 * middle * state.sum_k +
                            (middle * middle - (n * n - 1.0) / 12.0) * state.sum) /
                           fourth_powers;
  const double half = n / 2.0;
  return std::abs(curvature) * half * half > slew_radps * n / 4.0 + kFitSigmas * block.sigma_radps *
                                                                        half * half /
                                                                        std::sqrt(fourth_powers);
}

}  // namespace zerodrift::compensation
