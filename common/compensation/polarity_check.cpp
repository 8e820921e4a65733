// SPDX-License-Identifier: Apache-2.0
#include "common/compensation/polarity_check.h"

#include <algorithm>
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
constexpr double kMoves = 0.5;    // of a change: a level is another one
// Blocks at the edges of two levels, of which each may be half of both.
constexpr double kEdgesS = 2.0;
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
    axis.past = {};
    return;
  }
  const double mean = level.known / static_cast<double>(level.blocks);
  const double tolerance = kSteadyRadps + kSteadyShare * std::abs(mean);
  if (level.blocks > 0 && !(std::abs(known - mean) <= tolerance)) {
    if (level.blocks >= kSteadyBlocks) {
      axis.before = level;
      std::shift_right(axis.past.begin(), axis.past.end(), 1);
      axis.past.front() = level;
    }
    level = {};
  }
  if (level.blocks > 0) {
    level.squares += (rate - level.newest) * (rate - level.newest);
    level.largest = std::max(level.largest, level.newest_step);
    level.newest_step = std::abs(rate - level.newest);
  } else {
    level.begin = now;
  }
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
  if (std::max(before.largest, axis.level.largest) > kMoves * std::abs(known)) return;
  if (std::abs(rate + known) <= kAgrees * std::abs(known)) {
    const bool decides = axis.votes + 1 >= kVotes && !axis.reversed;
    if (!decides || !may_be_late(axis, std::abs(known))) vote(axis, kVotes);
    return;
  }
  axis.votes = 0;
  if (std::abs(rate - known) <= kAgrees * std::abs(known)) axis.reversed = false;
}

// By as much as any two of the levels began after each other.
bool PolarityCheck::may_be_late(const Axis& axis, double change) noexcept {
  double smallest = change;
  for (std::size_t i = 0; i < axis.past.size() && axis.past[i].blocks > 0; ++i) {
    const Level& next = i == 0 ? axis.level : axis.past[i - 1];
    smallest = std::min(smallest, std::abs(next.mean_known() - axis.past[i].mean_known()));
  }
  const double moves = kMoves * std::max(smallest, kLeastChangeRadps);
  for (std::size_t from = 0; from < axis.past.size() && axis.past[from].blocks > 0; ++from) {
    for (std::size_t to = 0; to <= from; ++to) {
      const Level& later = to == 0 ? axis.level : axis.past[to - 1];
      if (is_explained(axis, core::seconds(later.begin) - core::seconds(axis.past[from].begin),
                       change, moves))
        return true;
    }
  }
  return false;
}

// Each level of the rate is that of the true rate so much later, and at least one change is among
// what is compared.
bool PolarityCheck::is_explained(const Axis& axis, double late_s, double change,
                                 double moves) noexcept {
  bool has_any = false;
  bool has_change = false;
  double first_known = 0.0;
  for (std::size_t of_rate = 0; of_rate < axis.past.size(); ++of_rate) {
    const Level& early = axis.past[of_rate];
    if (early.blocks == 0) break;
    if (early.largest > moves) continue;  // more than one level, or noise
    for (std::size_t of_known = 0; of_known <= axis.past.size(); ++of_known) {
      const Level& known = of_known == 0 ? axis.level : axis.past[of_known - 1];
      if (known.blocks == 0) break;
      const double begin_s =
          std::max(core::seconds(early.begin) + late_s, core::seconds(known.begin));
      const double end_s = std::min(core::seconds(early.end) + late_s, core::seconds(known.end));
      if (!(end_s - begin_s > kEdgesS)) continue;
      if (std::abs(early.mean_rate() - known.mean_known()) > kAgrees * change) return false;
      if (!has_any) first_known = known.mean_known();
      has_any = true;
      has_change = has_change || std::abs(known.mean_known() - first_known) > kMoves * change;
    }
  }
  return has_change;
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
