// SPDX-License-Identifier: Apache-2.0
// Cholesky factor of the margin set's Gram matrix with the bias eliminated.
//
// One margin sample, at position 0, is the reference. The factor L (lower, L L' = A) belongs to
// the others:
//   A_jk = K_jk - K_0k - K_j0 + K_00,   j, k = 1 .. n-1,
// the Gram matrix of phi_j - phi_0. It is positive definite where the bordered matrix [0 1'; 1 K]
// of Ma, Theiler & Perkins (2003) is not definite, and it is updated by orthogonal rotations only:
// no inverse is stored, so errors don't grow with the number of updates.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "common/core/state_archive.h"

namespace zerodrift::regression {

class MarginFactor {
 public:
  // Room for `capacity` rows. Memory is reserved now, but the system commits it only as the factor
  // grows.
  explicit MarginFactor(std::size_t capacity);

  [[nodiscard]] std::size_t rows() const noexcept { return rows_; }
  void clear() noexcept { rows_ = 0; }

  // x = L^-1 x over the first rows() entries. O(rows²).
  void solve_lower(double* x) const noexcept;

  // x = A^-1 x. O(rows²).
  void solve(double* x) const noexcept;

  // Adds the row [lower, sqrt(pivot)], lower = L^-1 [A_j,new]. O(rows).
  void append(const double* lower, double pivot) noexcept;

  // Takes out row `row`. O(rows²).
  void remove_row(std::size_t row) noexcept;

  // The reference leaves and row 0 becomes the reference. phi_j - phi_1 = (phi_j - phi_0) - (phi_1
  // - phi_0), and phi_1 - phi_0 has only the coordinate L_00, so this is: take L_00 off column 0,
  // then take out row 0. O(rows²).
  void remove_reference() noexcept;

  // Its state (core/state_archive.h): L_00, L_10, L_11, ... of as many rows as are said.
  void carry(core::StateArchive& archive, std::size_t rows);

 private:
  [[nodiscard]] double* row(std::size_t i) const noexcept {
    return packed_.get() + i * (i + 1) / 2;
  }

  std::size_t rows_ = 0;
  std::unique_ptr<double[]> packed_;
  std::vector<double> cosines_, sines_;  // the rotations of one removal
};

}  // namespace zerodrift::regression
