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

// kLane doubles. The compiler splits it into what the clone's registers hold; spelt out because it
// doesn't keep the arrays of these loops in registers by itself.
using Lane [[gnu::vector_size(kLane * sizeof(double))]] = double;

// A lane that begins at any double. Packed, because Clang forgets an alignment that only the
// vector's own type states.
struct [[gnu::packed, gnu::may_alias]] UnalignedLane {
  Lane lane;
};

ZERODRIFT_IN_CLONE const UnalignedLane& lane_at(const double* a) {
  return *reinterpret_cast<const UnalignedLane*>(a);
}

constexpr std::size_t kLanes = kAccumulators / kLane;

// Adds the partial sums pairwise: halves, quarters, ...
ZERODRIFT_IN_CLONE double add_pairwise(Lane* partial) {
  for (std::size_t width = kLanes / 2; width > 0; width /= 2) {
    for (std::size_t i = 0; i < width; ++i) partial[i] += partial[i + width];
  }
  double last[kLane];
  for (std::size_t i = 0; i < kLane; ++i) last[i] = partial[0][i];
  for (std::size_t width = kLane / 2; width > 0; width /= 2) {
    for (std::size_t i = 0; i < width; ++i) last[i] += last[i + width];
  }
  return last[0];
}

// sum a_i b_i, or sum a_i.
enum class Terms { kProducts, kSingle };

template <Terms kTerms>
ZERODRIFT_IN_CLONE double accumulate(const double* a, const double* b, std::size_t count) {
  Lane partial[kLanes] = {};
  std::size_t i = 0;
  const auto add_lane = [&](Lane & to) __attribute__((always_inline)) {
    if constexpr (kTerms == Terms::kProducts) {
      to += lane_at(a + i).lane * lane_at(b + i).lane;
    } else {
      to += lane_at(a + i).lane;
    }
    i += kLane;
  };
  while (i + kAccumulators <= count) {
    for (Lane& to : partial) add_lane(to);
  }
  std::size_t lane = 0;
  while (i + kLane <= count) add_lane(partial[lane++]);
  for (std::size_t k = 0; i + k < count; ++k) {
    partial[lane][k] += kTerms == Terms::kProducts ? a[i + k] * b[i + k] : a[i + k];
  }
  return add_pairwise(partial);
}

// The sums of one block of columns stay in registers over all rows.
template <std::size_t kBlockLanes>
ZERODRIFT_IN_CLONE void combine_block(const double* const* rows, const double* rates,
                                      std::size_t row_count, double offset, double* __restrict out,
                                      std::size_t begin) {
  Lane sums[kBlockLanes];
  for (Lane& sum : sums) sum = Lane{} + offset;
  for (std::size_t j = 0; j < row_count; ++j) {
    const double* row = rows[j] + begin;
    const double rate = rates[j];
    for (std::size_t k = 0; k < kBlockLanes; ++k) sums[k] += rate * lane_at(row + k * kLane).lane;
  }
  for (std::size_t k = 0; k < kBlockLanes; ++k) {
    reinterpret_cast<UnalignedLane*>(out + begin + k * kLane)->lane = sums[k];
  }
}

// First i >= begin with difference(i) == 0; count if there is none. Differences of doubles are zero
// only for equal ones, and never for infinities.
template <typename Difference>
ZERODRIFT_IN_CLONE std::size_t next_zero(Difference difference, std::size_t begin,
                                         std::size_t count) {
  constexpr std::size_t kBlock = 64;
  for (; begin < count; begin += kBlock) {
    const std::size_t end = std::min(begin + kBlock, count);
    std::int64_t found = 0;
    for (std::size_t i = begin; i < end; ++i) found |= difference(i) == 0.0 ? 1 : 0;
    if (found == 0) continue;
    while (difference(begin) != 0.0) ++begin;
    return begin;
  }
  return count;
}

// Few crossings come before the earliest of those seen so far, so a division is spent only on
// blocks in which one may. The comparison by multiplication errs on the side of a division.
constexpr std::size_t kCrossingBlock = 32;

ZERODRIFT_IN_CLONE bool may_cross_before(double step, const Crossings& crossings, std::size_t begin,
                                         std::size_t width) {
  constexpr double kRoom = 1.0 + 0x1p-50;
  const double* __restrict value = crossings.value + begin;
  const double* __restrict rate = crossings.rate + begin;
  const double* __restrict upper = crossings.upper + begin;
  const double* __restrict lower = crossings.lower + begin;
  const double limit = step * kRoom;
  const double threshold = crossings.threshold;
  std::int64_t found = 0;
  for (std::size_t i = 0; i < width; ++i) {
    const double up = upper[i] - value[i];
    const double down = value[i] - lower[i];
    const double distance = rate[i] > 0.0 ? up : down;
    const double speed = std::fabs(rate[i]);
    const std::int64_t early = distance < limit * speed ? 1 : 0;
    found |= speed > threshold ? early : 0;
  }
  return found != 0;
}

ZERODRIFT_IN_CLONE void find_earlier_crossing(Crossing& first, const Crossings& crossings,
                                              std::size_t begin, std::size_t width) {
  double steps[kCrossingBlock];
  for (std::size_t i = 0; i < width; ++i) {
    const double rate = crossings.rate[begin + i];
    const double up = crossings.upper[begin + i];
    const double down = crossings.lower[begin + i];
    const double bound = rate > 0.0 ? up : down;
    const double ahead = (bound - crossings.value[begin + i]) / rate;
    const double step = ahead > 0.0 ? ahead : 0.0;
    steps[i] = std::fabs(rate) > crossings.threshold ? step : kInfinity;
  }
  for (std::size_t i = 0; i < width; ++i) {
    if (steps[i] < first.step) first = {steps[i], begin + i};
  }
}

}  // namespace

ZERODRIFT_VECTOR_CLONES
double dot(const double* __restrict a, const double* __restrict b, std::size_t count) noexcept {
  return accumulate<Terms::kProducts>(a, b, count);
}

ZERODRIFT_VECTOR_CLONES
double sum(const double* __restrict a, std::size_t count) noexcept {
  return accumulate<Terms::kSingle>(a, nullptr, count);
}

ZERODRIFT_VECTOR_CLONES
void combine_rows(const double* const* rows, const double* rates, std::size_t row_count,
                  double offset, double* __restrict out, std::size_t count) noexcept {
  constexpr std::size_t kBlockLanes = 4;
  std::size_t i = 0;
  for (; i + kBlockLanes * kLane <= count; i += kBlockLanes * kLane) {
    combine_block<kBlockLanes>(rows, rates, row_count, offset, out, i);
  }
  for (; i < count; i += kLane) combine_block<1>(rows, rates, row_count, offset, out, i);
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
double add_and_find_minimum(const double* __restrict x, double* __restrict y,
                            std::size_t count) noexcept {
  std::int64_t least = std::bit_cast<std::int64_t>(kInfinity);
  for (std::size_t i = 0; i < count; ++i) {
    y[i] += x[i];
    const auto bits = std::bit_cast<std::int64_t>(y[i]);
    least = bits < least ? bits : least;
  }
  return std::bit_cast<double>(least);
}

ZERODRIFT_VECTOR_CLONES
std::size_t next_equal(const double* __restrict a, double value, std::size_t begin,
                       std::size_t count) noexcept {
  return next_zero(
      [=](std::size_t i) __attribute__((always_inline)) { return a[i] - value; }, begin, count);
}

ZERODRIFT_VECTOR_CLONES
std::size_t next_equal_finite(const double* __restrict a, const double* __restrict b,
                              std::size_t begin, std::size_t count) noexcept {
  return next_zero(
      [=](std::size_t i) __attribute__((always_inline)) { return a[i] - b[i]; }, begin, count);
}

ZERODRIFT_VECTOR_CLONES
Crossing first_crossing(const Crossings& crossings, double limit, std::size_t count) noexcept {
  Crossing first{limit, count};
  for (std::size_t begin = 0; begin < count; begin += kCrossingBlock) {
    const std::size_t width = std::min(kCrossingBlock, count - begin);
    if (may_cross_before(first.step, crossings, begin, width)) {
      find_earlier_crossing(first, crossings, begin, width);
    }
  }
  return first;
}

}  // namespace zerodrift::regression
