// SPDX-License-Identifier: Apache-2.0
#include "services/console/rate_comparison.h"

#include <algorithm>
#include <cmath>
#include <limits>
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
    blocks_.clear();
    return false;
  }
  if (stage_ == Stage::kComparable) return true;
  // The step itself is within the first row of a model.
  stage_ = now == Mode::kFallback || now == Mode::kHolding ? Stage::kHeld : Stage::kComparable;
  return false;
}

void RateComparison::add(const RateSecond& row) {
  knows_reference_ = std::isfinite(row.reference_deg_h);
  if (!take_step(row.mode)) return;
  const std::int64_t index = row.second / kBlockS - (row.second % kBlockS < 0 ? 1 : 0);
  if (blocks_.empty() || blocks_.back().index != index) {
    if (!blocks_.empty() && !blocks_.back().is_filled()) blocks_.pop_back();
    blocks_.push_back({.index = index});
  }
  Block& block = blocks_.back();
  if (knows_reference_ || static_cast<Mode>(row.mode) == Mode::kLearning) block.certain = true;
  if (!std::isfinite(row.raw_deg_h) || !std::isfinite(row.compensated_deg_h)) return;
  const double known = knows_reference_ ? row.reference_deg_h : 0.0;
  const double raw = row.raw_deg_h - known;
  const double before = block.raw_mean;
  const double n = ++block.rows;
  block.raw_mean += (raw - before) / n;
  block.raw_squares += (raw - before) * (raw - block.raw_mean);
  block.compensated_mean += (row.compensated_deg_h - known - block.compensated_mean) / n;
}

void RateComparison::forget_before(std::int64_t second) {
  while (!blocks_.empty() && (blocks_.front().index + 1) * kBlockS <= second) blocks_.pop_front();
}

Result RateComparison::result(bool moves) const {
  if (stage_ == Stage::kPassthrough) return obstacle(Result::NOTHING_TAKEN_OFF);
  if (stage_ == Stage::kHeld) return obstacle(Result::MEAN_HELD);
  const std::size_t filled =
      blocks_.size() - (!blocks_.empty() && !blocks_.back().is_filled() ? 1 : 0);
  const bool some_certain =
      std::any_of(blocks_.begin(), blocks_.begin() + static_cast<std::ptrdiff_t>(filled),
                  [](const Block& block) { return block.certain; });
  double quiet = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < filled; ++i)
    if (blocks_[i].certain || !some_certain) quiet = std::min(quiet, blocks_[i].within());
  std::vector<double> raw;
  std::vector<double> compensated;
  bool is_certain = false;
  for (std::size_t i = 0; i < filled; ++i) {
    if (blocks_[i].within() > std::max(kMotionRatio * quiet, kMotionDegH)) continue;
    raw.push_back(blocks_[i].raw_mean);
    compensated.push_back(blocks_[i].compensated_mean);
    is_certain = is_certain || blocks_[i].certain;
  }
  if (raw.size() < kFewestBlocks)
    return obstacle(filled > raw.size() ? Result::MOTION : Result::TOO_SHORT);
  if (moves && !is_certain) return obstacle(Result::MOTION);
  Result result;
  result.set_raw_deg_h(deviation(raw));
  result.set_compensated_deg_h(deviation(compensated));
  if (!(result.compensated_deg_h() > 0.0)) return obstacle(Result::TOO_SHORT);
  result.set_blocks(static_cast<std::uint32_t>(raw.size()));
  result.set_against_reference(knows_reference_);
  return result;
}

}  // namespace zerodrift::services
