// SPDX-License-Identifier: Apache-2.0
#include "common/regression/sample_window.h"

#include <algorithm>
#include <array>
#include <limits>

#include "common/core/require.h"
#include "common/regression/vector_operations.h"

namespace zerodrift::regression {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

}  // namespace

SampleWindow::SampleWindow(WindowPolicy policy, std::size_t slot_count, std::size_t recent_capacity)
    : policy_(policy),
      recent_capacity_(recent_capacity),
      next_(slot_count, kNoSlot),
      previous_(slot_count, kNoSlot),
      arrival_(slot_count, 0),
      tier_(slot_count, WindowTier::kNone),
      nearest_(slot_count, kInfinity),
      exclusion_(slot_count, kInfinity),
      distance_(slot_count),
      distance_of_orphan_(slot_count) {}

std::size_t SampleWindow::victim() const noexcept {
  if (size_ == recent_size_) return oldest_recent_;
  const double closest = minimum_of_nonnegative(nearest_.data(), nearest_.size());
  if (closest == kInfinity) return next_equal(exclusion_.data(), 0.0, 0, exclusion_.size());
  const auto next = [&](std::size_t begin) {
    return next_equal(nearest_.data(), closest, begin, nearest_.size());
  };
  std::size_t earliest = next(0);
  for (std::size_t slot = earliest; slot < nearest_.size(); slot = next(slot + 1)) {
    if (arrival_[slot] < arrival_[earliest]) earliest = slot;
  }
  return earliest;
}

void SampleWindow::insert(std::size_t slot, std::uint64_t arrival,
                          const SampleColumns& columns) noexcept {
  core::require(tier_[slot] == WindowTier::kNone, "a sample joins a window at a vacant slot");
  arrival_[slot] = arrival;
  append_recent(slot);
  ++size_;
  if (policy_ == WindowPolicy::kFifo || recent_size_ <= recent_capacity_) return;
  const std::size_t promoted = oldest_recent_;
  unlink_recent(promoted);
  join_old(promoted, columns);
}

void SampleWindow::remove(std::size_t slot, const SampleColumns& columns) noexcept {
  core::require(tier_[slot] != WindowTier::kNone, "a sample that leaves a window is in it");
  if (tier_[slot] == WindowTier::kRecent) {
    unlink_recent(slot);
  } else {
    leave_old(slot, columns);
  }
  tier_[slot] = WindowTier::kNone;
  --size_;
}

void SampleWindow::clear() noexcept {
  std::fill(tier_.begin(), tier_.end(), WindowTier::kNone);
  std::fill(nearest_.begin(), nearest_.end(), kInfinity);
  std::fill(exclusion_.begin(), exclusion_.end(), kInfinity);
  size_ = recent_size_ = 0;
  oldest_recent_ = newest_recent_ = kNoSlot;
}

void SampleWindow::put_back(std::size_t slot, std::uint64_t arrival, WindowTier tier,
                            const SampleColumns& columns) noexcept {
  arrival_[slot] = arrival;
  if (tier == WindowTier::kRecent) {
    append_recent(slot);
  } else {
    join_old(slot, columns);
  }
  ++size_;
}

void SampleWindow::append_recent(std::size_t slot) noexcept {
  tier_[slot] = WindowTier::kRecent;
  next_[slot] = kNoSlot;
  previous_[slot] = newest_recent_;
  (newest_recent_ == kNoSlot ? oldest_recent_ : next_[newest_recent_]) = slot;
  newest_recent_ = slot;
  ++recent_size_;
}

void SampleWindow::unlink_recent(std::size_t slot) noexcept {
  const std::size_t before = previous_[slot], after = next_[slot];
  (before == kNoSlot ? oldest_recent_ : next_[before]) = after;
  (after == kNoSlot ? newest_recent_ : previous_[after]) = before;
  --recent_size_;
}

void SampleWindow::join_old(std::size_t slot, const SampleColumns& columns) noexcept {
  nearest_[slot] = measure_from(slot, columns, distance_.data());
  for (std::size_t i = 0; i < nearest_.size(); ++i) {
    nearest_[i] = std::min(nearest_[i], distance_[i]);
  }
  tier_[slot] = WindowTier::kOld;
  exclusion_[slot] = 0.0;
}

// Only samples as far from the leaving one as from their nearest neighbour can have lost that
// neighbour.
void SampleWindow::leave_old(std::size_t slot, const SampleColumns& columns) noexcept {
  exclusion_[slot] = kInfinity;
  nearest_[slot] = kInfinity;
  squared_distances_from(slot, columns, distance_.data());
  const auto next_orphan = [&](std::size_t begin) {
    return next_equal_finite(nearest_.data(), distance_.data(), begin, nearest_.size());
  };
  for (std::size_t i = next_orphan(0); i < nearest_.size(); i = next_orphan(i + 1)) {
    exclusion_[i] = kInfinity;
    nearest_[i] = measure_from(i, columns, distance_of_orphan_.data());
    exclusion_[i] = 0.0;
  }
}

void SampleWindow::squared_distances_from(std::size_t slot, const SampleColumns& columns,
                                          double* distance) const noexcept {
  std::array<double, kMaxDimension> features{};
  for (std::size_t d = 0; d < columns.dimension; ++d) {
    features[d] = columns.data[d * columns.stride + slot];
  }
  squared_distance_row({columns.data, columns.stride, columns.dimension, tier_.size()},
                       features.data(), distance);
}

// Squared distances to all old samples that aren't excluded; infinity elsewhere. Returns the
// smallest.
double SampleWindow::measure_from(std::size_t slot, const SampleColumns& columns,
                                  double* distance) const noexcept {
  squared_distances_from(slot, columns, distance);
  return add_and_find_minimum(exclusion_.data(), distance, tier_.size());
}

}  // namespace zerodrift::regression
