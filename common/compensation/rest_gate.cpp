// SPDX-License-Identifier: Apache-2.0
#include "common/compensation/rest_gate.h"

#include <algorithm>
#include <cmath>

#include "common/core/median.h"

namespace zerodrift::compensation {

using core::index;
using core::kAxes;

namespace {

constexpr double kNoiseGain = 0.01;   // the noise has a memory of 100 blocks
constexpr double kRestingSlew = 4.0;  // drift is followed at rest so many times as fast as it may
                                      // have moved unseen, where noise decides
constexpr double kJerk = 4.0;         // times what the level has changed: how a vehicle moves
constexpr std::size_t kSamplesForSpread = 8;
constexpr double kSmallestSigma = 1e-13;  // rad/s; keeps a noise-free input from a zero threshold
constexpr double kOtherRate = 1.5;        // samples that come so much faster or slower spread anew

double rate_hz(const DriftBlock& block, std::size_t axis) noexcept {
  const double duration_s = core::seconds(block.end - block.begin);
  return duration_s > 0.0 ? static_cast<double>(block.count[axis]) / duration_s : 0.0;
}

// How many times faster than those of the spread the samples come; 1 where either isn't known.
double times_faster(double now_hz, double then_hz) noexcept {
  return now_hz > 0.0 && then_hz > 0.0 ? now_hz / then_hz : 1.0;
}

}  // namespace

core::Reason reason_of(RestState state) noexcept {
  switch (state) {
    case RestState::kInitial: return core::Reason::kNoEstimateYet;
    case RestState::kMotion: return core::Reason::kMotion;
    case RestState::kLevelImplausible: return core::Reason::kLevelImplausible;
    case RestState::kSettling: return core::Reason::kSettling;
    case RestState::kRest: break;
  }
  return core::Reason::kNone;
}

RestGate::RestGate(const RestGateOptions& options) : options_(options) {
  options_.initial_blocks = std::clamp<std::size_t>(options_.initial_blocks, 3, kMaxInitialBlocks);
}

void RestGate::restart() noexcept {
  state_ = RestState::kInitial;
  has_levels_ = false;
  axes_ = {};
  initial_count_ = 0;
  still_since_ = core::kNever;
  watch_ = {};
  unforeseen_levels_.reset();
}

void RestGate::skip(core::SensorTime by) noexcept {
  initial_count_ = 0;
  if (state_ == RestState::kSettling) static_cast<void>(motion());
  if (!has_levels_) return;
  level_time_ += by;
  watch_.skip(by);
}

double RestGate::block_sigma(core::Axis axis) const noexcept {
  return std::max(std::sqrt(axes_[index(axis)].noise), kSmallestSigma);
}

RestState RestGate::add(const DriftBlock& block, const ExpectedLevels& expected,
                        const core::PerAxis<bool>& is_reversed) noexcept {
  if (block.count == core::PerAxis<std::size_t>{}) return state_;
  const bool implausible = level_implausible(block, is_reversed);
  if (!has_levels_ && implausible) {
    initial_count_ = 0;
    return state_ = RestState::kLevelImplausible;
  }
  if (!has_levels_) return state_ = collect_initial(block, expected);
  const bool departing = departs(block);
  // What a reference leaves is no rotation, however it comes and goes.
  const bool goes_on = watch(block) || block.has_reference;
  const bool rested = state_ == RestState::kRest;
  if (implausible || departing || (rested && !goes_on)) {
    still_since_ = core::kNever;
    return state_ = implausible ? RestState::kLevelImplausible : RestState::kMotion;
  }
  if (!rested) {
    if (state_ != RestState::kSettling || !goes_on) still_since_ = block.begin;
    state_ = RestState::kSettling;
    if (core::seconds(block.end - still_since_) < options_.dwell_s || is_doubtful(block))
      return state_;
    state_ = RestState::kRest;
    if (stayed_where_it_began()) ++unforeseen_starts_;
    unforeseen_levels_.reset();
  }
  // The drift went on while the gyro moved: the level begins anew where it stays.
  follow_levels();
  if (track(block, expected)) return motion();
  return state_;
}

RestState RestGate::motion() noexcept {
  if (!has_levels_) {
    state_ = RestState::kInitial;
    initial_count_ = 0;
  } else {
    state_ = RestState::kMotion;
    still_since_ = core::kNever;
    watch_.jerk();
  }
  return state_;
}

// Whether the block goes on with what was still, wherever its level is.
bool RestGate::watch(const DriftBlock& block) noexcept {
  core::PerAxis<StillWatch::Block> blocks;
  for (const auto axis : kAxes) {
    const AxisState& state = axes_[index(axis)];
    const double mean = block.mean_radps[index(axis)];
    if (!state.known || block.count[index(axis)] == 0 || !std::isfinite(mean)) continue;
    blocks[index(axis)] = {.is_measured = true,
                           .mean_radps = mean,
                           .margin_radps = options_.departure_sigmas * block_sigma(axis),
                           .drift_slew_radps2 = options_.max_slew_radps2,
                           .slew_radps2 = slew(state, 1.0),
                           .resting_slew_radps2 = slew(state, kRestingSlew)};
  }
  return watch_.add(block.begin, block.end, blocks, state_ == RestState::kRest);
}

// Whether an axis came to where it is as a sway comes to its turning point: smoothly, faster than
// drift, and not long ago. A vehicle stops by a jerk, which is far larger than what the drift has
// done meanwhile.
bool RestGate::is_doubtful(const DriftBlock& block) const noexcept {
  if (block.has_reference) return false;
  return std::any_of(kAxes.begin(), kAxes.end(), [&](core::Axis axis) {
    const AxisState& state = axes_[index(axis)];
    return state.known && watch_.follows(axis) && !watch_.has_stayed(axis) &&
           kJerk * std::abs(watch_.level(axis) - state.level) > watch_.jolt();
  });
}

// Nearer than to where it was expected.
bool RestGate::stayed_where_it_began() const noexcept {
  return unforeseen_levels_ && std::any_of(kAxes.begin(), kAxes.end(), [&](core::Axis axis) {
           const AxisState& state = axes_[index(axis)];  // its level is what was expected
           if (!state.known || !watch_.follows(axis)) return false;
           const double level = watch_.level(axis);
           return std::abs(level - (*unforeseen_levels_)[index(axis)]) <
                  std::abs(level - state.level);
         });
}

void RestGate::follow_levels() noexcept {
  for (const auto axis : kAxes) {
    AxisState& state = axes_[index(axis)];
    if (state.known && watch_.follows(axis)) state.level = watch_.level(axis);
  }
}

RestState RestGate::collect_initial(const DriftBlock& block,
                                    const ExpectedLevels& expected) noexcept {
  if (initial_count_ == options_.initial_blocks) {
    const auto end = initial_.begin() + static_cast<std::ptrdiff_t>(initial_count_);
    std::move(initial_.begin() + 1, end, initial_.begin());
    --initial_count_;
  }
  initial_[initial_count_++] = block;
  if (initial_count_ < options_.initial_blocks) return RestState::kInitial;
  adopt_initial();
  if (!initial_blocks_agree()) return RestState::kInitial;
  has_levels_ = true;
  return leaves(expected) ? RestState::kMotion : RestState::kRest;
}

// The first level of an axis is outside of what is expected; what is expected is the level then.
bool RestGate::leaves(const ExpectedLevels& expected) noexcept {
  const auto end = initial_.begin() + static_cast<std::ptrdiff_t>(initial_count_);
  if (std::all_of(initial_.begin(), end, [](const auto& block) { return block.has_reference; }))
    return false;
  core::PerAxis<double> nearest{};
  bool any_leaves = false;
  for (const auto axis : kAxes) {
    const std::size_t i = index(axis);
    nearest[i] = nearest_expected(axes_[i], expected[i]);
    any_leaves = any_leaves || nearest[i] != axes_[i].level;  // also: not a number
  }
  if (!any_leaves) return false;
  unforeseen_levels_.emplace();
  for (std::size_t i = 0; i < axes_.size(); ++i) {
    (*unforeseen_levels_)[i] = axes_[i].level;
    axes_[i].level = nearest[i];
  }
  return true;
}

// The level itself where it is expected, within its noise, or nothing is.
double RestGate::nearest_expected(const AxisState& axis,
                                  const std::optional<ExpectedLevel>& expected) const noexcept {
  if (!axis.known || !expected) return axis.level;
  const double margin = options_.departure_sigmas * expected->sigma_radps;
  const double nearest =
      std::clamp(axis.level, expected->lowest_radps - margin, expected->highest_radps + margin);
  return std::abs(axis.level - nearest) <= threshold(axis, 0.0) ? axis.level : nearest;
}

// sigma from the median absolute successive difference d: sigma = median|d| / (0.6745 sqrt 2).
// Robust to a start-up outlier, which is then left out of level and spread by taking their medians.
void RestGate::adopt_initial() noexcept {
  for (const auto axis : kAxes) {
    AxisState& state = axes_[index(axis)];
    double values[kMaxInitialBlocks];
    double differences[kMaxInitialBlocks];
    double spreads[kMaxInitialBlocks];
    double rates[kMaxInitialBlocks];
    std::size_t n = 0;
    for (std::size_t i = 0; i < initial_count_; ++i) {
      if (initial_[i].count[index(axis)] == 0) continue;
      spreads[n] = initial_[i].variance_radps2[index(axis)];
      rates[n] = rate_hz(initial_[i], index(axis));
      values[n++] = initial_[i].mean_radps[index(axis)];
    }
    state = {};
    if (n < 3) continue;
    state.previous = values[n - 1];
    for (std::size_t i = 0; i + 1 < n; ++i) differences[i] = std::abs(values[i + 1] - values[i]);
    std::nth_element(differences, differences + (n - 1) / 2, differences + n - 1);
    const double sigma = differences[(n - 1) / 2] / (core::kMedianOfNormal * std::sqrt(2.0));
    std::nth_element(values, values + n / 2, values + n);
    state.level = values[n / 2];
    state.noise = sigma * sigma;
    std::nth_element(spreads, spreads + n / 2, spreads + n);
    state.spread = spreads[n / 2];
    std::nth_element(rates, rates + n / 2, rates + n);
    state.rate_hz = rates[n / 2];
    state.known = true;
    state.blocks = n;
  }
  level_time_ = initial_[initial_count_ - 1].end;
  watch_ = {};
  watch_.begin(initial_[0].begin, level_time_);
  for (const auto axis : kAxes) {
    const AxisState& state = axes_[index(axis)];
    if (state.known) watch_.adopt(axis, state.level, state.blocks);
  }
}

// All but one of the blocks lie within the gate of the median level, and that gate is one of noise:
// a level that moves more from block to block than samples scatter within a block, and faster than
// drift, is rotation.
bool RestGate::initial_blocks_agree() const noexcept {
  for (const auto axis : kAxes) {
    const AxisState& state = axes_[index(axis)];
    if (!state.known) continue;
    const bool scatter_known = initial_[initial_count_ - 1].count[index(axis)] >= kSamplesForSpread;
    const double slew =
        options_.max_slew_radps2 * core::seconds(initial_[0].end - initial_[0].begin);
    if (scatter_known && state.noise > state.spread && state.noise > slew * slew) return false;
    std::size_t outliers = 0;
    for (std::size_t i = 0; i < initial_count_; ++i) {
      const double span_s = core::seconds(level_time_ - initial_[i].begin);
      if (initial_[i].count[index(axis)] > 0 &&
          std::abs(initial_[i].mean_radps[index(axis)] - state.level) > threshold(state, span_s)) {
        ++outliers;
      }
    }
    if (outliers > 1) return false;
  }
  return true;
}

double RestGate::threshold(const AxisState& axis, double elapsed_s) const noexcept {
  const double sigma = std::max(std::sqrt(axis.noise), kSmallestSigma);
  return options_.departure_sigmas * sigma + slew(axis, 1.0) * std::max(0.0, elapsed_s);
}

double RestGate::slew(const AxisState& axis, double times_noise) const noexcept {
  const double sigma = std::max(std::sqrt(axis.noise), kSmallestSigma);
  return std::max(options_.max_slew_radps2, times_noise * options_.noise_slew_per_s * sigma);
}

bool RestGate::level_implausible(const DriftBlock& block,
                                 const core::PerAxis<bool>& is_reversed) const noexcept {
  if (block.has_reference) return false;
  return std::any_of(kAxes.begin(), kAxes.end(), [&](core::Axis axis) {
    return block.count[index(axis)] > 0 && !is_reversed[index(axis)] &&
           std::abs(block.mean_radps[index(axis)]) > options_.max_level_radps;
  });
}

bool RestGate::departs(const DriftBlock& block) const noexcept {
  const double elapsed_s = core::seconds(block.end - level_time_);
  for (const auto axis : kAxes) {
    const AxisState& state = axes_[index(axis)];
    if (!state.known || block.count[index(axis)] == 0) continue;
    const double departure = std::abs(block.mean_radps[index(axis)] - state.level);
    if (!(departure <= threshold(state, elapsed_s))) return true;  // also when not a number
    // White noise of a density spreads the wider, the shorter the samples are.
    const double faster = times_faster(rate_hz(block, index(axis)), state.rate_hz);
    const double widest =
        options_.spread_ratio * options_.spread_ratio * state.spread * std::max(1.0, faster);
    if (block.count[index(axis)] >= kSamplesForSpread && state.spread > 0.0 &&
        block.variance_radps2[index(axis)] > widest)
      return true;
  }
  return false;
}

// Whether an axis that appeared later is outside of what is expected; that is its level then.
bool RestGate::track(const DriftBlock& block, const ExpectedLevels& expected) noexcept {
  bool any_leaves = false;
  for (const auto axis : kAxes) {
    AxisState& state = axes_[index(axis)];
    if (block.count[index(axis)] == 0) continue;
    const double mean = block.mean_radps[index(axis)];
    if (state.blocks == 0) {  // an axis that appears later starts from its own first block at rest
      state = {.known = false,
               .level = mean,
               .noise = 0.0,
               .spread = block.variance_radps2[index(axis)],
               .rate_hz = rate_hz(block, index(axis)),
               .previous = mean,
               .blocks = 1};
      continue;
    }
    const double difference = mean - state.previous;
    // Clipped at 3 sigma of a difference, so that a step of the drift does not pass for noise.
    const double cap =
        state.blocks > 10 && state.noise > 0.0 ? 18.0 * state.noise : difference * difference;
    const double half_square = 0.5 * std::min(difference * difference, cap);
    // Until the memory is filled the gain is 1/n, so that the median of the first blocks is soon
    // refined.
    const double gain = std::max(kNoiseGain, 1.0 / static_cast<double>(state.blocks + 1));
    // What may be a sway yet says nothing of the noise.
    if (!state.known || watch_.has_stayed(axis)) state.noise += gain * (half_square - state.noise);
    track_spread(block, index(axis), gain, state);
    if (!state.known) state.level += (mean - state.level) / static_cast<double>(state.blocks + 1);
    state.previous = mean;
    ++state.blocks;
    if (state.known || state.blocks < options_.initial_blocks) continue;
    state.known = true;
    watch_.adopt(axis, state.level, state.blocks);
    if (block.has_reference) continue;
    const double nearest = nearest_expected(state, expected[index(axis)]);
    any_leaves = any_leaves || nearest != state.level;
    state.level = nearest;
  }
  level_time_ = block.end;
  return any_leaves;
}

// Of samples at another rate the spread begins anew; what is known of the level stays.
void RestGate::track_spread(const DriftBlock& block, std::size_t axis, double gain,
                            AxisState& state) noexcept {
  const double now_hz = rate_hz(block, axis);
  const double faster = times_faster(now_hz, state.rate_hz);
  if (faster > kOtherRate || faster < 1.0 / kOtherRate) {
    if (block.count[axis] < kSamplesForSpread) return;
    state.spread = block.variance_radps2[axis];
    state.rate_hz = now_hz;
    return;
  }
  state.spread += gain * (block.variance_radps2[axis] - state.spread);
  state.rate_hz += gain * (now_hz - state.rate_hz);
}

}  // namespace zerodrift::compensation
