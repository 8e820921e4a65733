// SPDX-License-Identifier: Apache-2.0
#include "common/regression/kernel_rows.h"

#include <algorithm>

namespace zerodrift::regression {
namespace {

constexpr std::size_t kNone = static_cast<std::size_t>(-1);
constexpr std::size_t kSpareRow = 0;
// Half of the rows that events need are among the last so many that were parked.
constexpr std::size_t kRowsParked = 32;
// Rows that are committed in the constructor.
constexpr std::size_t kRowsCommitted = 64;

}  // namespace

KernelRows::KernelRows(const Kernel& kernel, std::size_t dimension, std::size_t slot_count)
    : kernel_(kernel),
      dimension_(dimension),
      features_(dimension * padded(slot_count)),
      self_(padded(slot_count)),
      rows_(new (kCacheLine) double[(slot_count + 1) * padded(slot_count)]),
      row_of_(slot_count, kNone) {
  free_.reserve(slot_count);
  holders_.reserve(slot_count);
  parked_.reserve(kRowsParked);
  clear();
  std::fill_n(rows_.get(), std::min(kRowsCommitted, slot_count + 1) * stride(), 0.0);
}

std::array<double, kMaxDimension> KernelRows::sample(std::size_t slot) const noexcept {
  std::array<double, kMaxDimension> x;
  for (std::size_t d = 0; d < dimension_; ++d) x[d] = feature(slot, d);
  return x;
}

void KernelRows::write(std::size_t slot, std::span<const double> x) noexcept {
  for (std::size_t d = 0; d < dimension_; ++d) features_[d * stride() + slot] = x[d];
  self_[slot] = self_value(kernel_, x.data(), dimension_);
}

const double* KernelRows::insert(std::size_t slot, std::span<const double> x) noexcept {
  write(slot, x);
  const double* own = take(slot);
  for (const std::size_t other : holders_) place(row_of_[other])[slot] = own[other];
  return own;
}

const double* KernelRows::take(std::size_t slot) noexcept {
  if (row_of_[slot] != kNone) {
    std::erase(parked_, slot);
    return row(slot);
  }
  row_of_[slot] = free_.back();
  free_.pop_back();
  holders_.push_back(slot);
  return evaluate_into(row_of_[slot], slot);
}

void KernelRows::park(std::size_t slot) noexcept {
  if (parked_.size() == kRowsParked) drop(parked_.front());
  parked_.push_back(slot);
}

void KernelRows::drop(std::size_t slot) noexcept {
  const auto found = std::find(parked_.begin(), parked_.end(), slot);
  if (found == parked_.end()) return;
  parked_.erase(found);
  std::erase(holders_, slot);
  free_.push_back(row_of_[slot]);
  row_of_[slot] = kNone;
}

void KernelRows::clear() noexcept {
  parked_.clear();
  holders_.clear();
  free_.clear();
  std::fill(row_of_.begin(), row_of_.end(), kNone);
  for (std::size_t i = slot_count(); i > kSpareRow; --i) free_.push_back(i);
}

const double* KernelRows::evaluate(std::size_t slot) noexcept {
  return evaluate_into(kSpareRow, slot);
}

const double* KernelRows::evaluate_into(std::size_t index, std::size_t slot) noexcept {
  const auto x = sample(slot);
  evaluate_row(kernel_, columns(), x.data(), place(index));
  return place(index);
}

}  // namespace zerodrift::regression
