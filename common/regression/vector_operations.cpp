// SPDX-License-Identifier: Apache-2.0
#include "common/regression/vector_operations.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#include "common/regression/vector_clones.h"

namespace zerodrift::regression {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Adds the partial sums pairwise: halves, quarters, ...
ZERODRIFT_IN_CLONE double add_pairwise(double* partial) {
  for (std::size_t width = kAccumulators / 2; width > 0; width /= 2) {
    for (std::size_t i = 0; i < width; ++i) partial[i] += partial[i + width];
  }
  return partial[0];
}

}  // namespace

ZERODRIFT_VECTOR_CLONES
double dot(const double* __restrict a, const double* __restrict b, std::size_t count) noexcept {
  double partial[kAccumulators] = {};
  std::size_t i = 0;
  for (; i + kAccumulators <= count; i += kAccumulators) {
    for (std::size_t k = 0; k < kAccumulators; ++k) partial[k] += a[i + k] * b[i + k];
  }
  for (std::size_t k = 0; i + k < count; ++k) partial[k] += a[i + k] * b[i + k];
  return add_pairwise(partial);
}

ZERODRIFT_VECTOR_CLONES
double sum(const double* __restrict a, std::size_t count) noexcept {
  double partial[kAccumulators] = {};
  std::size_t i = 0;
  for (; i + kAccumulators <= count; i += kAccumulators) {
    for (std::size_t k = 0; k < kAccumulators; ++k) partial[k] += a[i + k];
  }
  for (std::size_t k = 0; i + k < count; ++k) partial[k] += a[i + k];
  return add_pairwise(partial);
}

// Four rows a pass: the output is read and written a quarter as often.
ZERODRIFT_VECTOR_CLONES
void combine_rows(const double* const* rows, const double* rates, std::size_t row_count,
                  double offset, double* __restrict out, std::size_t count) noexcept {
  std::fill(out, out + count, offset);
  std::size_t j = 0;
  for (; j + 4 <= row_count; j += 4) {
    const double *r0 = rows[j], *r1 = rows[j + 1], *r2 = rows[j + 2], *r3 = rows[j + 3];
    const double a0 = rates[j], a1 = rates[j + 1], a2 = rates[j + 2], a3 = rates[j + 3];
    for (std::size_t i = 0; i < count; ++i) {
      out[i] = (((out[i] + a0 * r0[i]) + a1 * r1[i]) + a2 * r2[i]) + a3 * r3[i];
    }
  }
  for (; j < row_count; ++j) {
    const double* r0 = rows[j];
    const double a0 = rates[j];
    for (std::size_t i = 0; i < count; ++i) out[i] += a0 * r0[i];
  }
}

ZERODRIFT_VECTOR_CLONES
void add_scaled(double a, const double* __restrict x, double* __restrict y,
                std::size_t count) noexcept {
  for (std::size_t i = 0; i < count; ++i) y[i] += a * x[i];
}

// Doubles that are not negative sort like their bit patterns, and an integer minimum has no order
// to keep.
ZERODRIFT_VECTOR_CLONES
double minimum_of_nonnegative(const double* __restrict a, std::size_t count) noexcept {
  std::int64_t least = std::bit_cast<std::int64_t>(kInfinity);
  for (std::size_t i = 0; i < count; ++i) {
    const auto bits = std::bit_cast<std::int64_t>(a[i]);
    least = bits < least ? bits : least;
  }
  return std::bit_cast<double>(least);
}

ZERODRIFT_VECTOR_CLONES
std::size_t first_equal(const double* __restrict a, double value, std::size_t count) noexcept {
  auto first = static_cast<std::int64_t>(count);
  for (std::int64_t i = 0; i < static_cast<std::int64_t>(count); ++i) {
    const std::int64_t found = a[i] == value ? i : static_cast<std::int64_t>(count);
    first = found < first ? found : first;
  }
  return static_cast<std::size_t>(first);
}

ZERODRIFT_VECTOR_CLONES
double first_crossing(const Crossings& crossings, double* __restrict steps,
                      std::size_t count) noexcept {
  const double* __restrict value = crossings.value;
  const double* __restrict rate = crossings.rate;
  const double* __restrict upper = crossings.upper;
  const double* __restrict lower = crossings.lower;
  const double threshold = crossings.threshold;
  std::int64_t least = std::bit_cast<std::int64_t>(kInfinity);
  for (std::size_t i = 0; i < count; ++i) {
    const double up = upper[i];
    const double down = lower[i];
    const double bound = rate[i] > 0.0 ? up : down;
    const double ahead = (bound - value[i]) / rate[i];
    const double step = ahead > 0.0 ? ahead : 0.0;
    steps[i] = std::fabs(rate[i]) > threshold ? step : kInfinity;
    const auto bits = std::bit_cast<std::int64_t>(steps[i]);
    least = bits < least ? bits : least;
  }
  return std::bit_cast<double>(least);
}

}  // namespace zerodrift::regression
