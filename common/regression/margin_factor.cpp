// SPDX-License-Identifier: Apache-2.0
#include "common/regression/margin_factor.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "common/core/require.h"
#include "common/regression/vector_operations.h"

namespace zerodrift::regression {

MarginFactor::MarginFactor(std::size_t capacity)
    : packed_(std::make_unique_for_overwrite<double[]>(capacity * (capacity + 1) / 2)),
      cosines_(capacity),
      sines_(capacity) {}

void MarginFactor::solve_lower(double* x) const noexcept {
  for (std::size_t i = 0; i < rows_; ++i) {
    const double* l = row(i);
    x[i] = (x[i] - dot(l, x, i)) / l[i];
  }
}

void MarginFactor::solve(double* x) const noexcept {
  solve_lower(x);
  for (std::size_t i = rows_; i-- > 0;) {
    const double* l = row(i);
    x[i] /= l[i];
    add_scaled(-x[i], l, x, i);
  }
}

void MarginFactor::append(const double* lower, double pivot) noexcept {
  assert(pivot > 0.0);
  core::require(rows_ < cosines_.size(), "a margin factor has room for the row");
  double* l = row(rows_);
  std::copy_n(lower, rows_, l);
  l[rows_] = std::sqrt(pivot);
  ++rows_;
}

// Below the removed row the factor reaches one column too far to the right; rotating columns k and
// k+1 into each other brings each row back below the diagonal. Row by row, so that memory is read
// in order.
void MarginFactor::remove_row(std::size_t removed) noexcept {
  core::require(removed < rows_, "a row that leaves a margin factor is in it");
  for (std::size_t i = removed; i + 1 < rows_; ++i) {
    double* l = row(i + 1);
    for (std::size_t k = removed; k < i; ++k) {
      const double left = l[k], right = l[k + 1];
      l[k] = cosines_[k] * left + sines_[k] * right;
      l[k + 1] = cosines_[k] * right - sines_[k] * left;
    }
    const double length =
        std::max(std::sqrt(l[i] * l[i] + l[i + 1] * l[i + 1]), std::numeric_limits<double>::min());
    cosines_[i] = l[i] / length;
    sines_[i] = l[i + 1] / length;
    l[i] = length;
    std::copy_n(l, i + 1, row(i));
  }
  --rows_;
}

void MarginFactor::remove_reference() noexcept {
  if (rows_ == 0) return;
  const double shift = *row(0);
  for (std::size_t i = 1; i < rows_; ++i) *row(i) -= shift;
  remove_row(0);
}

void MarginFactor::carry(core::StateArchive& archive, std::size_t rows) {
  core::require(rows <= cosines_.size(), "a margin factor has room for the rows of its state");
  rows_ = rows;
  archive.numbers(packed_.get(), rows * (rows + 1) / 2, core::StateArchive::kLargestSum);
  for (std::size_t i = 0; i < rows; ++i) archive.require(row(i)[i] > 0.0);
}

}  // namespace zerodrift::regression
