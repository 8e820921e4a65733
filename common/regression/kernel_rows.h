// SPDX-License-Identifier: Apache-2.0
// The samples of a window by slot, and rows of their kernel matrix: the row of a slot holds
// k(x_slot, x_i) for every slot i (less 1, kernel.h). A row is computed where its slot takes it,
// and kept for a while after its use: samples that leave the margin often return.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "common/regression/kernel.h"
#include "common/regression/vector_operations.h"

namespace zerodrift::regression {

// Everything is allocated in the constructor; memory of rows is committed only as far as used.
class KernelRows {
 public:
  KernelRows(const Kernel& kernel, std::size_t dimension, std::size_t slot_count);

  [[nodiscard]] std::size_t slot_count() const noexcept { return row_of_.size(); }
  // The padded slot count: the length of a row.
  [[nodiscard]] std::size_t stride() const noexcept { return self_.size(); }

  // Feature d of the sample in a slot, and of all slots, vacant ones included.
  [[nodiscard]] double feature(std::size_t slot, std::size_t d) const noexcept {
    return features_[d * stride() + slot];
  }
  [[nodiscard]] SampleColumns columns() const noexcept {
    return {features_.data(), stride(), dimension_, stride()};
  }
  [[nodiscard]] std::array<double, kMaxDimension> sample(std::size_t slot) const noexcept;
  // Size of the kernel's terms in the slot's row.
  [[nodiscard]] double magnitude(std::size_t slot) const noexcept {
    return kernel_.is_stationary() ? 1.0 : self_[slot];
  }

  // Writes a sample. No row may hold the slot's former one.
  void write(std::size_t slot, std::span<const double> x) noexcept;
  // Writes a sample, takes its row and completes all other rows by it. O(W dimension).
  const double* insert(std::size_t slot, std::span<const double> x) noexcept;

  // Of a slot that has taken it.
  [[nodiscard]] const double* row(std::size_t slot) const noexcept { return place(row_of_[slot]); }
  // The row stays the slot's until it is parked. O(W dimension) where it isn't parked.
  const double* take(std::size_t slot) noexcept;
  // Keeps a row that was taken for when its slot needs it again; the one parked longest makes room.
  void park(std::size_t slot) noexcept;
  // Frees the slot's row if it is parked.
  void drop(std::size_t slot) noexcept;
  // Frees all rows.
  void clear() noexcept;

  // The row for passing use: the next call overwrites it. O(W dimension).
  const double* evaluate(std::size_t slot) noexcept;

 private:
  struct FreeRows {
    void operator()(double* rows) const noexcept { ::operator delete[](rows, kCacheLine); }
  };

  [[nodiscard]] double* place(std::size_t index) const noexcept {
    return rows_.get() + index * stride();
  }
  const double* evaluate_into(std::size_t index, std::size_t slot) noexcept;

  Kernel kernel_;
  std::size_t dimension_;
  Column features_;  // by column
  Column self_;      // k(x, x)
  std::unique_ptr<double[], FreeRows> rows_;
  std::vector<std::size_t> row_of_;   // by slot; kNone: it has none
  std::vector<std::size_t> holders_;  // slots that have one
  std::vector<std::size_t> free_;     // the last is taken next
  std::vector<std::size_t> parked_;   // slots, the last parked at the end
};

}  // namespace zerodrift::regression
