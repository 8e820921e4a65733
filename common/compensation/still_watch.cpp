// SPDX-License-Identifier: Apache-2.0
#include "common/compensation/still_watch.h"

#include <algorithm>
#include <cmath>

namespace zerodrift::compensation {

using core::index;
using core::kAxes;

namespace {

constexpr double kMemoryBlocks = 10.0;  // the level follows with such a memory,
constexpr double kLevelGain = 1.0 / kMemoryBlocks;
constexpr double kLongBlockS = 5.0;      // or of 10 s where they come more rarely than this
constexpr std::size_t kFirstFitted = 6;  // blocks that a parabola is looked at from on
constexpr std::size_t kLastFitted = 40;
constexpr double kPause = 1.5;        // blocks so far apart, in blocks, aren't equidistant
constexpr int kStayRatio = 2;         // of having stayed to having come
constexpr double kKnownMotion = 1e9;  // rad/s: more than any change

}  // namespace

bool StillWatch::add(core::SensorTime begin, core::SensorTime end,
                     const core::PerAxis<Block>& blocks, bool is_believed) noexcept {
  if (since_ == core::kNever) this->begin(begin, begin);
  is_believed_ = is_believed_ || is_believed;
  const double block_s = core::seconds(end - begin);
  const double elapsed_s = core::seconds(end - end_);
  core::PerAxis<double> moves{};
  double jump = 0.0;
  for (const auto axis : kAxes) {
    const Block& block = blocks[index(axis)];
    const AxisState& state = axes_[index(axis)];
    if (!block.is_measured || state.blocks == 0) continue;
    moves[index(axis)] = leaves(block, elapsed_s, state);
    jump = std::max(jump, std::abs(block.mean_radps - state.newest));
  }
  const bool goes_on = moves == core::PerAxis<double>{};
  if (!goes_on) {
    end_stretch(begin, moves);
    jolt_ = std::max(jump, jolt_);
  }
  end_ = end;
  for (const auto axis : kAxes) {
    if (blocks[index(axis)].is_measured)
      follow(blocks[index(axis)], block_s, elapsed_s, axes_[index(axis)]);
  }
  return goes_on;
}

double StillWatch::leaves(const Block& block, double elapsed_s, const AxisState& state) noexcept {
  const auto n = static_cast<double>(state.blocks);
  const double margin = std::max(block.margin_radps, state.grain);
  // Drift has moved the level for as long as it remembers.
  const double widest = margin * std::sqrt(1.0 + 1.0 / n) +
                        block.slew_radps2 * elapsed_s * std::min(n, kMemoryBlocks);
  const double distance = block.mean_radps - state.level;
  if (std::abs(distance) > widest) return distance;
  return state.parabola.turn(margin, block.resting_slew_radps2 * elapsed_s);
}

void StillWatch::end_stretch(core::SensorTime begin, const core::PerAxis<double>& moves) noexcept {
  const bool was_level =
      is_believed_ &&
      std::all_of(kAxes.begin(), kAxes.end(), [&](core::Axis axis) { return has_stayed(axis); });
  for (const auto axis : kAxes) {
    AxisState& state = axes_[index(axis)];
    const double move = moves[index(axis)];
    const bool turns = move != 0.0 && state.is_rising != (move > 0.0);
    if (was_level || turns) {
      state.leg_level = state.level;
      state.leg_since = was_level ? begin : since_;
    }
    if (turns) state.is_rising = !state.is_rising;
    state.owed = was_level ? core::SensorTime{0} : state.due;
    state.blocks = 0;
  }
  jolt_ = was_level ? 0.0 : 0.5 * jolt_;
  since_ = begin;
  is_believed_ = false;
}

void StillWatch::follow(const Block& block, double block_s, double elapsed_s,
                        AxisState& state) noexcept {
  const double x = block.mean_radps;
  const double change = std::abs(x - state.newest);
  if (state.grain == 0.0 || (change > 0.0 && change < state.grain)) state.grain = change;
  state.newest = x;
  if (state.blocks == 0 || elapsed_s > kPause * block_s) state.parabola.restart();
  state.parabola.add(x);
  ++state.blocks;
  const double n = static_cast<double>(state.blocks);
  if (state.blocks == 1) state.level = x;
  const double distance = x - state.level;
  const double gain = elapsed_s > kLongBlockS ? std::min(1.0, kLevelGain * elapsed_s) : kLevelGain;
  // No further behind than drift makes it, and no faster than drift is followed.
  const double least = std::min(std::abs(distance), block.drift_slew_radps2 * elapsed_s);
  const double most =
      n > kMemoryBlocks ? block.resting_slew_radps2 * elapsed_s : std::abs(distance);
  const double step =
      std::clamp(std::max(gain, 1.0 / n) * std::abs(distance), least, std::max(least, most));
  state.level += std::copysign(step, distance);

  const double margin = std::max({block.margin_radps, state.grain, jolt_});
  const bool is_fast = std::abs(state.level - state.leg_level) >
                       margin + block.slew_radps2 * core::seconds(end_ - state.leg_since);
  state.due = std::max(state.owed, is_fast ? since_ - state.leg_since : core::SensorTime{0});
}

bool StillWatch::has_stayed(core::Axis axis) const noexcept {
  return (end_ - since_) / kStayRatio >= axes_[index(axis)].due;
}

void StillWatch::adopt(core::Axis axis, double level_radps, std::size_t blocks) noexcept {
  AxisState& state = axes_[index(axis)];
  state = {};
  state.blocks = blocks;
  state.level = state.newest = state.leg_level = level_radps;
  state.leg_since = since_;
}

void StillWatch::begin(core::SensorTime since, core::SensorTime end) noexcept {
  since_ = since;
  end_ = end;
  is_believed_ = false;
  for (AxisState& state : axes_) state.leg_since = since;
}

void StillWatch::jerk() noexcept {
  since_ = end_ = core::kNever;
  axes_ = {};
  jolt_ = kKnownMotion;
}

void StillWatch::skip(core::SensorTime by) noexcept {
  if (since_ == core::kNever) return;
  since_ += by;
  end_ += by;
  for (AxisState& state : axes_) state.leg_since += by;
}

void StillWatch::Parabola::add(double value) noexcept {
  if (count_ == kLastFitted) count_ = 0;
  if (count_ == 0) {
    first_ = value;
    sum_ = sum_k_ = sum_kk_ = 0.0;
  }
  const auto k = static_cast<double>(count_++);
  sum_ += value - first_;
  sum_k_ += k * (value - first_);
  sum_kk_ += k * k * (value - first_);
}

// The least-squares parabola through n equidistant blocks, of a trend b = sum u x / sum u² with
// u(k) = k - (n-1)/2, sum u² = n (n²-1) / 12, and a curvature c = sum p x / sum p² with
// p = u² - (n²-1)/12, sum p² = n (n²-1) (n²-4) / 180. Drift that turns from its fastest one way to
// its fastest the other way in these blocks is slew n / 4 deep.
double StillWatch::Parabola::turn(double margin, double slew) const noexcept {
  if (count_ < kFirstFitted) return 0.0;
  const auto n = static_cast<double>(count_);
  const double middle = (n - 1.0) / 2.0;
  const double squares = n * (n * n - 1.0) / 12.0;
  const double trend = (sum_k_ - middle * sum_) / squares;
  if (std::abs(trend) > slew + margin / std::sqrt(squares)) return trend;
  const double fourth_powers = squares * (n * n - 4.0) / 15.0;
  const double curvature =
      (sum_kk_ - 2.0 * middle * sum_k_ + (middle * middle - (n * n - 1.0) / 12.0) * sum_) /
      fourth_powers;
  const double deepest = slew * n / 4.0 / (n * n / 4.0);
  return std::abs(curvature) > deepest + margin / std::sqrt(fourth_powers) ? curvature : 0.0;
}

}  // namespace zerodrift::compensation
