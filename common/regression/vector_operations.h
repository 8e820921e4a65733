// SPDX-License-Identifier: Apache-2.0
// Loops over structure-of-arrays columns: vectorised, and bit-identical on every processor. Sums
// run in kAccumulators interleaved partial sums that are then added pairwise, so their order
// doesn't depend on the vector width.
#pragma once

#include <cstddef>
#include <new>
#include <vector>

namespace zerodrift::regression {

// Columns are padded to a multiple of this, one cache line of doubles.
inline constexpr std::size_t kLane = 8;
inline constexpr std::size_t kAccumulators = 32;

constexpr std::size_t padded(std::size_t count) {
  return (count + kLane - 1) / kLane * kLane;
}

// Columns begin on a cache line, so that no vector load spans two.
inline constexpr std::align_val_t kCacheLine{kLane * sizeof(double)};

template <typename T>
struct CacheLineAllocator {
  using value_type = T;

  CacheLineAllocator() = default;
  template <typename U>
  CacheLineAllocator(const CacheLineAllocator<U>& /*other*/) noexcept {}

  [[nodiscard]] T* allocate(std::size_t count) {
    return static_cast<T*>(::operator new(count * sizeof(T), kCacheLine));
  }
  void deallocate(T* memory, std::size_t /*count*/) noexcept {
    ::operator delete(memory, kCacheLine);
  }
  friend bool operator==(const CacheLineAllocator&, const CacheLineAllocator&) = default;
};

using Column = std::vector<double, CacheLineAllocator<double>>;

// sum a_i b_i.
[[nodiscard]] double dot(const double* a, const double* b, std::size_t count) noexcept;

// sum a_i.
[[nodiscard]] double sum(const double* a, std::size_t count) noexcept;

// out_i = offset + sum_j rates[j] rows[j][i].
void combine_rows(const double* const* rows, const double* rates, std::size_t row_count,
                  double offset, double* out, std::size_t count) noexcept;

// y_i += a x_i.
void add_scaled(double a, const double* x, double* y, std::size_t count) noexcept;

// Smallest a_i, for a_i >= 0 or +infinity; +infinity if count is 0.
[[nodiscard]] double minimum_of_nonnegative(const double* a, std::size_t count) noexcept;

// y_i += x_i; returns the smallest y_i, as above.
double add_and_find_minimum(const double* x, double* y, std::size_t count) noexcept;

// First i >= begin with a_i == value; count if there is none.
[[nodiscard]] std::size_t next_equal(const double* a, double value, std::size_t begin,
                                     std::size_t count) noexcept;

// First i >= begin with a_i == b_i, both finite; count if there is none.
[[nodiscard]] std::size_t next_equal_finite(const double* a, const double* b, std::size_t begin,
                                            std::size_t count) noexcept;

// The step at which each value, moving at rate_i, meets its bound: upper_i if it rises, lower_i if
// it falls; 0 if it is already past it, infinity if |rate_i| <= threshold.
struct Crossings {
  const double* value;
  const double* rate;
  const double* upper;
  const double* lower;
  double threshold;
};

struct Crossing {
  double step;
  std::size_t index;  // of the first with this step
};

// The smallest step below `limit`; {limit, count} if there is none.
[[nodiscard]] Crossing first_crossing(const Crossings& crossings, double limit,
                                      std::size_t count) noexcept;

}  // namespace zerodrift::regression
