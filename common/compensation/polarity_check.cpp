// SPDX-License-Identifier: Apache-2.0
#include "common/compensation/polarity_check.h"

#include <cmath>
#include <utility>

#include "common/core/units.h"

namespace zerodrift::compensation {
namespace {

constexpr double kLeastChangeRadps = 0.5 * core::kRadPerDeg;  // 1800 deg/h: far above any drift's
constexpr double kSteadyRadps = 0.02 * core::kRadPerDeg;
constexpr double kSteadyShare = 0.2;
constexpr std::uint64_t kSteadyBlocks = 4;
// Drift has moved by less than a tenth of the least change until then.
constexpr core::SensorTime kLongestBetween{60'000'000'000};
constexpr double kAgrees = 0.25;  // of a change, with either sign
constexpr double kScatter = 0.1;  // of a change, from block to block
constexpr std::uint64_t kVotes = 3;
constexpr std::uint64_t kEarthBlocks = 60;
constexpr std::uint64_t kEarthVotes = 5;
constexpr double kSurely = 5.0;  // standard errors

// Of a block about its level, from the squares of differences of successive ones.
double scatter(double squares, double blocks) {
  return std::sqrt(0.5 * squares / (blocks - 1.0));
}

}  // namespace

void PolarityCheck::add(core::Axis axis, double rate_radps, double known_radps,
                        Source source) noexcept {
  Axis& own = axes_[core::index(axis)];
  ++own.samples;
  own.rate += rate_radps;
  own.known += known_radps;
  own.of_earth = source == Source::kEarth;
}

void PolarityCheck::close(core::SensorTime now) noexcept {
  for (Axis& axis : axes_) close(axis, now);
}

void PolarityCheck::close(Axis& axis, core::SensorTime now) noexcept {
  const auto n = static_cast<double>(std::exchange(axis.samples, 0));
  const double rate = std::exchange(axis.rate, 0.0) / n;
  const double known = std::exchange(axis.known, 0.0) / n;
  Level& level = axis.level;
  if (!(n > 0.0) || !std::isfinite(rate) || !std::isfinite(known)) {
    level = axis.before = {};
    return;
  }
  const double mean = level.known / static_cast<double>(level.blocks);
  const double tolerance = kSteadyRadps + kSteadyShare * std::abs(mean);
  if (level.blocks > 0 && !(std::abs(known - mean) <= tolerance)) {
    if (level.blocks >= kSteadyBlocks) axis.before = level;
    level = {};
  }
  if (level.blocks > 0) level.squares += (rate - level.newest) * (rate - level.newest);
  ++level.blocks;
  level.rate += rate;
  level.known += known;
  level.newest = rate;
  level.end = now;
  if (axis.of_earth && level.blocks == kEarthBlocks) return judge_earth(axis);
  if (!axis.of_earth && level.blocks == kSteadyBlocks) judge_change(axis);
}

void PolarityCheck::judge_change(Axis& axis) noexcept {
  const Level& before = axis.before;
  if (before.blocks == 0 || axis.level.end - before.end > kLongestBetween) return;
  const auto n = static_cast<double>(axis.level.blocks);
  const auto m = static_cast<double>(before.blocks);
  const double known = axis.level.known / n - before.known / m;
  const double rate = axis.level.rate / n - before.rate / m;
  if (!(std::abs(known) >= kLeastChangeRadps)) return;
  if (scatter(axis.level.squares, n) + scatter(before.squares, m) > kScatter * std::abs(known))
    return;  // what moves by itself may happen to answer
  if (std::abs(rate + known) <= kAgrees * std::abs(known)) return vote(axis, kVotes);
  axis.votes = 0;
  if (std::abs(rate - known) <= kAgrees * std::abs(known)) axis.reversed = false;
}

// The right way round the mean is |Earth's rate| within the largest drift, the other way round
// -|Earth's rate|.
void PolarityCheck::judge_earth(Axis& axis) noexcept {
  const auto n = static_cast<double>(axis.level.blocks);
  const double earth = axis.level.known / n;
  const double measured = std::copysign(1.0, earth) * axis.level.rate / n;
  const double error = kSurely * scatter(axis.level.squares, n) / std::sqrt(n);
  axis.level = {};
  const double right = measured - std::abs(earth);
  const double reversed = measured + std::abs(earth);
  const bool may_be_right = !(std::abs(right) > largest_drift_ + error);
  const bool may_be_reversed = !(std::abs(reversed) > largest_drift_ - error);
  if (may_be_reversed && !may_be_right) return vote(axis, kEarthVotes);
  axis.votes = 0;
  if (may_be_right && !may_be_reversed) axis.reversed = false;
}

void PolarityCheck::vote(Axis& axis, std::uint64_t needed) noexcept {
  if (++axis.votes < needed || axis.reversed) return;
  axis.reversed = true;
  ++found_;
}

void PolarityCheck::restart() noexcept {
  for (Axis& axis : axes_) {
    const bool reversed = axis.reversed;
    axis = {};
    axis.reversed = reversed;
  }
}

}  // namespace zerodrift::compensation
