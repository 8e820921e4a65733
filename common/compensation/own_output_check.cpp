// SPDX-License-Identifier: Apache-2.0
#include "common/compensation/own_output_check.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace zerodrift::compensation {
namespace {

constexpr std::size_t kOnTheWay = 2;    // blocks after a step's own in which the answer may come
constexpr std::size_t kSide = 3;        // blocks of a mean
constexpr double kLeastInSigmas = 8.0;  // of a block: an answer is known to a tenth of it
constexpr double kSteady = 0.1;         // of a step, within either side
constexpr double kAnswers = 0.25;       // of a step
constexpr std::uint64_t kVotes = 3;
constexpr double kExactly = kAnswers * kAnswers * kAnswers;  // as rare by chance as kVotes answers
constexpr double kMovesOn = 1.0 / 3.0;  // of a change, within its sides; of a ramp two thirds are

template <typename Blocks>
double mean_of(const Blocks& blocks, std::size_t first) {
  double sum = 0.0;
  for (std::size_t i = first; i < first + kSide; ++i) sum += blocks[i];
  return sum / static_cast<double>(kSide);
}

template <typename Blocks>
double span_of(const Blocks& blocks, std::size_t first, std::size_t count) {
  const auto begin = blocks.begin() + static_cast<std::ptrdiff_t>(first);
  const auto [low, high] = std::minmax_element(begin, begin + static_cast<std::ptrdiff_t>(count));
  return *high - *low;
}

template <typename Blocks>
double change_within_sides(const Blocks& blocks) {
  return blocks[kSide - 1] - blocks.front() + blocks.back() - blocks[blocks.size() - kSide];
}

}  // namespace

void OwnOutputCheck::add(core::Axis axis, double rate_radps, double applied_radps) noexcept {
  Axis& own = axes_[core::index(axis)];
  ++own.samples;
  own.rate += rate_radps;
  own.applied += applied_radps;
}

void OwnOutputCheck::close(const core::PerAxis<double>& block_sigma_radps) noexcept {
  for (std::size_t i = 0; i < axes_.size(); ++i) {
    Axis& axis = axes_[i];
    const auto n = static_cast<double>(std::exchange(axis.samples, 0));
    const double rate = std::exchange(axis.rate, 0.0) / n;
    const double applied = std::exchange(axis.applied, 0.0) / n;
    if (!std::isfinite(rate) || !std::isfinite(applied)) {  // nor any sample
      axis.blocks = 0;
      continue;
    }
    std::move(axis.rates.begin() + 1, axis.rates.end(), axis.rates.begin());
    std::move(axis.taken.begin() + 1, axis.taken.end(), axis.taken.begin());
    axis.rates.back() = rate;
    axis.taken.back() = applied;
    axis.blocks = std::min<std::uint64_t>(axis.blocks + 1, kBlocks);
    if (axis.blocks == kBlocks) judge(axis, block_sigma_radps[i]);
  }
}

void OwnOutputCheck::judge(Axis& axis, double block_sigma_radps) noexcept {
  constexpr std::size_t kAfter = kBlocks - kSide;
  if (!(block_sigma_radps > 0.0)) return;
  const double step = mean_of(axis.taken, kAfter) - mean_of(axis.taken, 0);
  const double size = std::abs(step);
  const double answer = mean_of(axis.rates, kAfter) - mean_of(axis.rates, 0);
  const bool moves_on = std::abs(change_within_sides(axis.rates)) > kMovesOn * std::abs(answer);
  const double before = span_of(axis.taken, 0, kSide);
  const double after = span_of(axis.taken, kAfter - kOnTheWay, kSide + kOnTheWay);
  if (size < kLeastInSigmas * block_sigma_radps) {
    const double taken = mean_of(axis.taken, kAfter);
    const double within = kExactly * std::abs(taken);
    const double own = std::abs(std::abs(answer) - axis.asked);
    if (moves_on || span_of(axis.taken, 0, kBlocks) > kSteady * axis.asked) return;
    if (within >= block_sigma_radps && std::abs(answer + taken) <= within) {
      axis.votes = std::max(axis.votes, kVotes - 1);
    } else if (own <= kAnswers * axis.asked) {
      axis.votes = 0;
    }
    return;
  }
  if (std::max(before, after) > kSteady * size) return;
  axis.blocks = 0;  // each step asks once
  axis.asked = size;
  if (std::abs(answer) <= kAnswers * size) {
    axis.votes = 0;
    axis.own = false;
    return;
  }
  const double off = std::abs(answer + step);
  if (off > kAnswers * size || moves_on) return;
  const bool is_first = before == 0.0 && axis.taken.front() == 0.0;
  axis.votes += is_first && off <= kExactly * size ? kVotes : 1;
  if (axis.votes < kVotes || axis.own) return;
  axis.own = true;
  ++found_;
}

void OwnOutputCheck::restart() noexcept {
  for (Axis& axis : axes_) {
    axis.samples = axis.blocks = 0;
    axis.rate = axis.applied = 0.0;
  }
}

}  // namespace zerodrift::compensation
