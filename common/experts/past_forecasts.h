// SPDX-License-Identifier: Apache-2.0
// Forecasts kept back until labels come that they can be judged by: each label is foretold by the
// newest forecast that was made at least a horizon before it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/core/require.h"
#include "common/core/state_archive.h"

namespace zerodrift::experts {

// One thread. All memory is taken in the constructor, as copies of a T that has all room it needs;
// every call is O(1) but for dropping what is too old.
template <typename T>
class PastForecasts {
 public:
  // `most` of them are kept over a horizon, so that one that judges is up to 1 / most older than
  // it. Of a horizon of 0 the newest one alone is kept.
  PastForecasts(double horizon_s, std::size_t most, const T& empty)
      : horizon_s_(horizon_s),
        spacing_s_(horizon_s / static_cast<double>(most)),
        entries_(horizon_s > 0.0 ? most + 2 : 2, Entry{0.0, empty}) {
    core::require(most > 0, "of past forecasts at least one is kept");
  }

  // What foretells a label that ends at `time_s`, which is not before that of the call before; null
  // where none is old enough. What is older still is of no use any more and dropped.
  [[nodiscard]] const T* due(double time_s) noexcept {
    while (size_ > 1 && time_s - at(1).time_s >= horizon_s_) drop();
    if (size_ == 0 || time_s - at(0).time_s < horizon_s_) return nullptr;
    return &at(0).forecast;
  }
  // Whether the forecast after a label that ended at `time_s` is to be kept.
  [[nodiscard]] bool wants(double time_s) const noexcept {
    return size_ == 0 || time_s - at(size_ - 1).time_s >= spacing_s_;
  }
  // Where to write it.
  [[nodiscard]] T& keep(double time_s) noexcept {
    if (size_ == entries_.size()) drop();
    ++size_;
    at(size_ - 1).time_s = time_s;
    return at(size_ - 1).forecast;
  }
  void clear() noexcept { first_ = size_ = 0; }

  // Its state (core/state_archive.h).
  void carry(core::StateArchive& archive) {
    std::uint64_t size = size_;
    archive(size);
    archive.require(size <= entries_.size());
    if (!archive.ok()) return;
    if (archive.reads()) {
      first_ = 0;
      size_ = size;
    }
    for (std::size_t i = 0; i < size_; ++i) {
      archive(at(i).time_s, at(i).forecast);
      archive.require(i == 0 || at(i).time_s > at(i - 1).time_s);
    }
  }

 private:
  struct Entry {
    double time_s;
    T forecast;
  };
  [[nodiscard]] std::size_t place(std::size_t i) const noexcept {
    const std::size_t slot = first_ + i;
    return slot < entries_.size() ? slot : slot - entries_.size();
  }
  [[nodiscard]] Entry& at(std::size_t i) noexcept { return entries_[place(i)]; }
  [[nodiscard]] const Entry& at(std::size_t i) const noexcept { return entries_[place(i)]; }
  void drop() noexcept {
    first_ = place(1);
    --size_;
  }

  double horizon_s_;
  double spacing_s_;
  std::vector<Entry> entries_;
  std::size_t first_ = 0;
  std::size_t size_ = 0;
};

}  // namespace zerodrift::experts
