// SPDX-License-Identifier: Apache-2.0
#include "common/allan/block_statistics.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "common/core/not_known.h"

namespace zerodrift::allan {
namespace {

constexpr double kMaxBlocks = 1e6;
constexpr double kMaxBlockSamples = 1e12;

const BlockStatisticsOptions& checked(const BlockStatisticsOptions& options) {
  if (const auto error = options.validate()) throw std::invalid_argument(*error);
  return options;
}

double standard_deviation(double squares, std::uint64_t count) {
  return count < 2 ? 0.0 : std::sqrt(squares / static_cast<double>(count - 1));
}

}  // namespace

std::optional<std::string> BlockStatisticsOptions::validate() const {
  const auto found = [](const char* key, double value, const char* right) {
    return std::string(key) + " is " + std::to_string(value) + ", must be " + right;
  };
  if (!(std::isfinite(sample_interval_s) && sample_interval_s > 0.0)) {
    return found("sample_interval_s", sample_interval_s, "> 0 s");
  }
  const double samples = block_s / sample_interval_s;
  if (!(samples >= 1.0 && samples <= kMaxBlockSamples))
    return found("block_s", block_s, "1 to 1e12 sample intervals");
  const double blocks = window_s / block_s;
  if (!(blocks >= 1.0 && blocks <= kMaxBlocks))
    return found("window_s", window_s, "1 to 1e6 blocks");
  return std::nullopt;
}

BlockStatistics::BlockStatistics(const BlockStatisticsOptions& options)
    : sample_interval_s_(checked(options).sample_interval_s),
      block_samples_(
          static_cast<std::uint64_t>(std::llround(options.block_s / options.sample_interval_s))),
      means_(
          static_cast<std::size_t>(std::ceil(options.window_s / options.block_s * (1.0 - 1e-12))),
          core::kNaN),
      last_mean_(core::kNaN) {}

void BlockStatistics::add(double value) noexcept {
  if (!std::isfinite(value)) {
    gap(1);
    return;
  }
  sum_ += value;
  ++valid_;
  if (++position_ == block_samples_) close_block();
}

void BlockStatistics::gap(std::uint64_t missing_samples) noexcept {
  std::uint64_t blocks = missing_samples / block_samples_;
  position_ += missing_samples % block_samples_;
  const bool wraps = position_ >= block_samples_;
  const std::uint64_t left_over = wraps ? position_ - block_samples_ : position_;
  if (wraps) ++blocks;
  if (blocks == 0) return;
  // One more than the window holds empties it; the open block closes first.
  for (std::uint64_t i = std::min<std::uint64_t>(blocks, means_.size() + 1); i > 0; --i)
    close_block();
  position_ = left_over;
}

void BlockStatistics::close_block() noexcept {
  const bool counts =
      static_cast<double>(valid_) >= kShareOfBlock * static_cast<double>(block_samples_);
  const double mean = counts ? sum_ / static_cast<double>(valid_) : core::kNaN;
  means_[next_] = mean;
  next_ = next_ + 1 == means_.size() ? 0 : next_ + 1;
  if (counts) {
    ++blocks_;
    const double before = mean - mean_;
    mean_ += before / static_cast<double>(blocks_);
    squares_ += before * (mean - mean_);
  }
  if (counts && !std::isnan(last_mean_)) {
    ++steps_;
    step_squares_ += (mean - last_mean_) * (mean - last_mean_);
  }
  last_mean_ = mean;
  sum_ = 0.0;
  valid_ = position_ = 0;
}

BlockMoments BlockStatistics::moments(Span span) const noexcept {
  if (span == Span::kRolling) return rolling_moments();
  const double step_rms =
      steps_ == 0 ? 0.0 : std::sqrt(step_squares_ / static_cast<double>(steps_));
  return {blocks_, mean_, standard_deviation(squares_, blocks_), step_rms, steps_};
}

BlockMoments BlockStatistics::rolling_moments() const noexcept {
  BlockMoments result;
  double sum = 0.0;
  for (const double mean : means_) {
    if (std::isnan(mean)) continue;
    sum += mean;
    ++result.blocks;
  }
  if (result.blocks == 0) return result;
  result.mean = sum / static_cast<double>(result.blocks);
  double squares = 0.0;
  for (const double mean : means_) {
    if (!std::isnan(mean)) squares += (mean - result.mean) * (mean - result.mean);
  }
  result.standard_deviation = standard_deviation(squares, result.blocks);
  return result;
}

double BlockStatistics::block_s() const noexcept {
  return static_cast<double>(block_samples_) * sample_interval_s_;
}

}  // namespace zerodrift::allan
