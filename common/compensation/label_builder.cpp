// SPDX-License-Identifier: Apache-2.0
#include "common/compensation/label_builder.h"

#include <algorithm>

#include "common/compensation/options.h"

namespace zerodrift::compensation {

using core::index;
using core::kAxes;

namespace {

// An interval_s beyond it, or none at all, counts as 0.
constexpr double kLongestIntervalS = kSlowestSpacingS;

}  // namespace

std::optional<DriftBlock> BlockAverager::advance(core::SensorTime time,
                                                 double interval_s) noexcept {
  std::optional<DriftBlock> closed;
  const bool usable = interval_s >= 0.0 && interval_s <= kLongestIntervalS;
  const core::SensorTime start = time - core::from_seconds(usable ? interval_s : 0.0);
  const bool gap = newest_ != core::kNever && start - newest_ > block_;
  if (begin_ != core::kNever && (gap || start - begin_ >= block_))
    closed = close(gap ? newest_ : start);
  if (begin_ == core::kNever) begin_ = start;
  newest_ = time;
  return closed;
}

void BlockAverager::add(core::Axis axis, double drift_radps, double reference_variance) noexcept {
  Sums& sums = sums_[index(axis)];
  if (sums.count == 0) sums.shift = drift_radps;
  const double value = drift_radps - sums.shift;
  ++sums.count;
  sums.sum += value;
  sums.square += value * value;
  sums.reference_variance = std::max(sums.reference_variance, reference_variance);
}

DriftBlock BlockAverager::close(core::SensorTime end) noexcept {
  DriftBlock block;
  block.begin = begin_;
  block.end = end;
  block.has_reference = referenced_;
  for (const auto axis : kAxes) {
    const Sums& sums = sums_[index(axis)];
    block.count[index(axis)] = sums.count;
    if (sums.count == 0) continue;
    const auto n = static_cast<double>(sums.count);
    block.mean_radps[index(axis)] = sums.shift + sums.sum / n;
    block.reference_variance[index(axis)] = sums.reference_variance;
    if (sums.count > 1) {
      block.variance_radps2[index(axis)] =
          std::max(0.0, (sums.square - sums.sum * sums.sum / n) / (n - 1.0));
    }
  }
  last_turning_ = turning_;
  sums_ = {};
  begin_ = core::kNever;
  referenced_ = turning_ = false;
  return block;
}

void BlockAverager::restart() noexcept {
  sums_ = {};
  begin_ = newest_ = core::kNever;
  referenced_ = turning_ = last_turning_ = false;
}

LabelBuilder::LabelBuilder(double label_s, double confirm_s)
    : label_(core::from_seconds(label_s)), confirm_(core::from_seconds(confirm_s)) {}

std::optional<Label> LabelBuilder::add(
    const DriftBlock& block, const core::PerAxis<AxisContext>& context,
    const experts::ThermalState& thermal,
    const core::PerAxis<double>& block_variance_radps2) noexcept {
  // A pause longer than a label parts two labels: what was collected before it stands for itself.
  if (begin_ != core::kNever && block.begin - end_ > label_) finish();
  accumulate(block, context, thermal, block_variance_radps2);
  if (end_ - begin_ >= label_) finish();

  if (pending_.empty() || block.end < pending_.front().end + confirm_) return std::nullopt;
  const Label confirmed = pending_.front();
  pending_.pop();
  has_given_ = true;
  fruitless_ = 0;
  return confirmed;
}

void LabelBuilder::accumulate(const DriftBlock& block, const core::PerAxis<AxisContext>& context,
                              const experts::ThermalState& thermal,
                              const core::PerAxis<double>& block_variance_radps2) noexcept {
  if (begin_ == core::kNever) begin_ = block.begin;
  end_ = block.end;
  ++blocks_;
  thermal_.add(thermal);
  for (const auto axis : kAxes) {
    const std::size_t i = index(axis);
    if (block.count[i] == 0) continue;
    AxisSums& sums = sums_[i];
    sums.drift.add(block.mean_radps[i]);
    sums.prior.add(context[i].prior_radps);
    sums.variance += block_variance_radps2[i];
    sums.reference_variance += block.reference_variance[i];
    if (context[i].applied_radps) sums.applied.add(*context[i].applied_radps);
    if (context[i].held_radps) sums.held.add(*context[i].held_radps);
    if (!context[i].features_ready) continue;
    ++sums.ready;
    for (std::size_t f = 0; f < sums.features.size(); ++f)
      sums.features[f] += context[i].features[f];
  }
}

void LabelBuilder::finish() noexcept {
  Label label;
  label.begin = begin_;
  label.end = end_;
  label.thermal = thermal_.over(static_cast<double>(blocks_));
  for (const auto axis : kAxes) {
    const std::size_t i = index(axis);
    const AxisSums& sums = sums_[i];
    const std::size_t n = sums.drift.count;
    if (n == 0) continue;
    label.valid[i] = true;
    label.drift_radps[i] = sums.drift.value();
    label.prior_radps[i] = sums.prior.value();
    label.variance_radps2[i] = sums.variance / static_cast<double>(n * n) +
                               sums.reference_variance / static_cast<double>(n);
    // A prediction is judged only where it held for the whole label.
    if (sums.applied.count == n) label.applied_radps[i] = sums.applied.value();
    if (sums.held.count == n) label.held_radps[i] = sums.held.value();
    label.features_ready[i] = sums.ready == n;
    for (std::size_t f = 0; f < sums.features.size(); ++f) {
      label.features[i][f] = sums.features[f] / static_cast<double>(n);
    }
  }
  pending_.push(label);  // full: this one is lost, those nearer their confirmation stay
  reopen();
}

void LabelBuilder::reopen() noexcept {
  begin_ = end_ = core::kNever;
  sums_ = {};
  thermal_ = {};
  blocks_ = 0;
}

void LabelBuilder::discard() noexcept {
  const bool was_still = blocks_ > 0 || !pending_.empty();
  if (was_still && !has_given_) ++fruitless_;
  has_given_ = false;
  reopen();
  pending_.clear();
}

}  // namespace zerodrift::compensation
