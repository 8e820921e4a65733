// SPDX-License-Identifier: Apache-2.0
// Which sample leaves when the window is full. Exact forgetting allows any choice, so a window
// need not be the last W samples.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/regression/kernel.h"
#include "common/regression/vector_operations.h"

namespace zerodrift::regression {

enum class WindowPolicy : std::uint8_t {
  kFifo = 0,  // the last W samples
  // The last `recent_capacity` samples, and older ones kept for their spread over the feature
  // space: of the two older samples that lie closest together the earlier one leaves. Remembers
  // temperatures that a FIFO window forgets.
  kTwoTier = 1,
};

enum class WindowTier : std::uint8_t { kNone = 0, kRecent = 1, kOld = 2 };

class SampleWindow {
 public:
  static constexpr std::size_t kNoSlot = static_cast<std::size_t>(-1);

  SampleWindow(WindowPolicy policy, std::size_t slot_count, std::size_t recent_capacity);

  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  [[nodiscard]] WindowTier tier(std::size_t slot) const noexcept { return tier_[slot]; }
  // Number of the sample in the order of insertion.
  [[nodiscard]] std::uint64_t arrival(std::size_t slot) const noexcept { return arrival_[slot]; }

  // The slot to vacate next; kNoSlot if the window is empty. O(1) for kFifo, O(slots) for kTwoTier.
  [[nodiscard]] std::size_t victim() const noexcept;

  // The slot's sample is the newest. Columns hold the features of all slots. O(slots).
  void insert(std::size_t slot, std::uint64_t arrival, const SampleColumns& columns) noexcept;

  // The columns must still hold the slot's features. O(slots) for each old sample that loses its
  // nearest neighbour.
  void remove(std::size_t slot, const SampleColumns& columns) noexcept;

  void clear() noexcept;

  // Puts a saved sample back; samples must come in order of arrival.
  void put_back(std::size_t slot, std::uint64_t arrival, WindowTier tier,
                const SampleColumns& columns) noexcept;

 private:
  void append_recent(std::size_t slot) noexcept;
  void unlink_recent(std::size_t slot) noexcept;
  void join_old(std::size_t slot, const SampleColumns& columns) noexcept;
  void leave_old(std::size_t slot, const SampleColumns& columns) noexcept;
  void squared_distances_from(std::size_t slot, const SampleColumns& columns,
                              double* distance) const noexcept;
  double measure_from(std::size_t slot, const SampleColumns& columns,
                      double* distance) const noexcept;

  WindowPolicy policy_;
  std::size_t recent_capacity_;
  std::size_t size_ = 0;
  std::size_t recent_size_ = 0;
  std::size_t oldest_recent_ = kNoSlot;
  std::size_t newest_recent_ = kNoSlot;
  std::vector<std::size_t> next_, previous_;  // the recent samples in order of arrival
  std::vector<std::uint64_t> arrival_;
  std::vector<WindowTier> tier_;
  // Squared distance of an old sample to the nearest other old sample; infinity for all other
  // slots.
  Column nearest_;
  Column exclusion_;  // 0 for old samples, infinity for all other slots
  Column distance_, distance_of_orphan_;
};

}  // namespace zerodrift::regression
