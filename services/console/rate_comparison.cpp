// SPDX-License-Identifier: Apache-2.0
#include "services/console/rate_comparison.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <optional>
#include <vector>

#include "common/allan/block_statistics.h"
#include "common/core/mode.h"

namespace zerodrift::services {

using core::Mode;
using Result = telemetry::RateComparison;

namespace {

constexpr std::size_t kFewestBlocks = 3;
// A block in which the raw rate moves so much more than in the quietest one holds motion, no drift.
constexpr double kMotionRatio = 5.0;
constexpr double kMotionDegH = 5.0;

double deviation(const std::vector<double>& values) {
  double mean = 0.0;
  for (const double value : values) mean += value / static_cast<double>(values.size());
  double squares = 0.0;
  for (const double value : values) squares += (value - mean) * (value - mean);
  return std::sqrt(squares / static_cast<double>(values.size() - 1));
}

Result obstacle(Result::Obstacle why) {
  Result result;
  result.set_obstacle(why);
  return result;
}

}  // namespace

bool says_motion(core::Reason reason) {
  return reason == core::Reason::kMotion || reason == core::Reason::kSettling ||
         reason == core::Reason::kLevelImplausible;
}

bool says_rest(core::Mode mode, core::Reason reason) {
  return mode == Mode::kLearning || reason == core::Reason::kEarthRateUnknown;
}

bool RateComparison::Block::is_filled() const {
  return rows >= allan::kShareOfBlock * static_cast<double>(kBlockS);
}

double RateComparison::Block::within() const {
  return std::sqrt(raw_squares / static_cast<double>(rows - 1));
}

bool RateComparison::take_step(std::uint8_t mode) {
  const auto now = static_cast<Mode>(mode);
  if (now == Mode::kPassthrough) {
    stage_ = Stage::kPassthrough;
    at_rest_.clear();
    against_reference_.clear();
    return false;
  }
  if (stage_ == Stage::kComparable) return true;
  // The step itself is within the first row of a model.
  stage_ = now == Mode::kFallback || now == Mode::kHolding ? Stage::kHeld : Stage::kComparable;
  return false;
}

void RateComparison::add(const RateSecond& row) {
  if (!take_step(row.mode)) return;
  const bool is_known = std::isfinite(row.reference_deg_h);
  Blocks& blocks = is_known ? against_reference_ : at_rest_;
  const std::int64_t index = row.second / kBlockS - (row.second % kBlockS < 0 ? 1 : 0);
  if (blocks.empty() || blocks.back().index != index) {
    if (!blocks.empty() && !blocks.back().is_filled()) blocks.pop_back();
    blocks.push_back({.index = index});
  }
  Block& block = blocks.back();
  const bool learns = static_cast<Mode>(row.mode) == Mode::kLearning;
  if (is_known || learns || row.rests) block.certain = true;
  if (!is_known && row.moves) block.moves = true;
  if (!std::isfinite(row.raw_deg_h) || !std::isfinite(row.compensated_deg_h)) return;
  const double known = is_known ? row.reference_deg_h : 0.0;
  const double raw = row.raw_deg_h - known;
  const double before = block.raw_mean;
  const double n = ++block.rows;
  block.raw_mean += (raw - before) / n;
  block.raw_squares += (raw - before) * (raw - block.raw_mean);
  block.compensated_mean += (row.compensated_deg_h - known - block.compensated_mean) / n;
}

void RateComparison::forget_before(std::int64_t second) {
  for (Blocks* blocks : {&at_rest_, &against_reference_}) {
    while (!blocks->empty() && (blocks->front().index + 1) * kBlockS <= second) blocks->pop_front();
  }
}

RateComparison::Counted RateComparison::counted(const Blocks& blocks) {
  const auto filled = blocks.end() - (!blocks.empty() && !blocks.back().is_filled() ? 1 : 0);
  const auto certain = std::find_if(
      blocks.begin(), filled, [](const Block& block) { return block.certain && !block.moves; });
  const bool some_certain = certain != filled;
  double quiet = std::numeric_limits<double>::infinity();
  std::for_each(blocks.begin(), filled, [&](const Block& block) {
    if (!block.moves && (block.certain || !some_certain)) quiet = std::min(quiet, block.within());
  });
  const double most_at_rest = std::max(kMotionRatio * quiet, kMotionDegH);
  Counted all;
  // Another reason, as that the temperature is outside what was learned, says nothing of motion: a
  // step that no drift takes is a turn until it is known to be at rest, or back at that level.
  const auto count = [&](auto from, auto to, std::optional<double> level) {
    std::for_each(from, to, [&](const Block& block) {
      const bool is_off = level && std::abs(block.raw_mean - *level) > most_at_rest;
      if (block.moves || block.within() > most_at_rest || (is_off && !block.certain)) {
        all.has_motion = true;
        return;
      }
      level = block.raw_mean;
      all.raw.push_back(block.raw_mean);
      all.compensated.push_back(block.compensated_mean);
      all.is_certain = all.is_certain || block.certain;
    });
  };
  // What came before the first minute known to be at rest is told from it, backwards.
  const auto first = some_certain ? certain : blocks.begin();
  count(first, filled, {});
  if (some_certain) count(std::reverse_iterator(first), blocks.rend(), first->raw_mean);
  return all;
}

Result RateComparison::result(bool moves) const {
  if (stage_ == Stage::kPassthrough) return obstacle(Result::NOTHING_TAKEN_OFF);
  if (stage_ == Stage::kHeld) return obstacle(Result::MEAN_HELD);
  const Counted at_rest = counted(at_rest_);
  const Counted known = counted(against_reference_);
  const bool is_against_reference = known.raw.size() >= at_rest.raw.size();
  const Counted& most = is_against_reference ? known : at_rest;
  if (most.raw.size() < kFewestBlocks) {
    const bool has_motion = at_rest.has_motion || known.has_motion;
    return obstacle(has_motion ? Result::MOTION : Result::TOO_SHORT);
  }
  if (moves && !most.is_certain) return obstacle(Result::MOTION);
  Result result;
  result.set_raw_deg_h(deviation(most.raw));
  result.set_compensated_deg_h(deviation(most.compensated));
  if (!(result.compensated_deg_h() > 0.0)) return obstacle(Result::TOO_SHORT);
  result.set_blocks(static_cast<std::uint32_t>(most.raw.size()));
  result.set_against_reference(is_against_reference);
  return result;
}

}  // namespace zerodrift::services
