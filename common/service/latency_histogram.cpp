// SPDX-License-Identifier: Apache-2.0
#include "common/service/latency_histogram.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace zerodrift::service {

// Values below 16 have a bucket each; above, the bits after the leading one choose among 16 in each
// octave.
std::size_t LatencyHistogram::bucket(std::uint64_t value) noexcept {
  if (value < (1U << kSubBits)) return static_cast<std::size_t>(value);
  const auto octave = static_cast<std::size_t>(std::bit_width(value)) - 1 - kSubBits;
  const auto sub = static_cast<std::size_t>(value >> octave) - (1U << kSubBits);
  return std::min(kBuckets - 1, ((octave + 1) << kSubBits) + sub);
}

std::uint64_t LatencyHistogram::upper_edge(std::size_t bucket) noexcept {
  const std::size_t octave = bucket >> kSubBits;
  const std::uint64_t sub = bucket & ((1U << kSubBits) - 1);
  if (octave == 0) return sub;
  return ((sub + (1U << kSubBits) + 1) << (octave - 1)) - 1;
}

void LatencyHistogram::record(std::int64_t latency_ns) noexcept {
  const auto value = static_cast<std::uint64_t>(std::max<std::int64_t>(latency_ns, 0));
  auto& count = counts_[bucket(value)];
  count.store(count.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  sum_.store(sum_.load(std::memory_order_relaxed) + value, std::memory_order_relaxed);
  if (latency_ns > max_.load(std::memory_order_relaxed))
    max_.store(latency_ns, std::memory_order_relaxed);
}

void LatencyHistogram::record_between(std::int64_t earlier_ns, std::int64_t later_ns) noexcept {
  constexpr std::int64_t kLongest = std::numeric_limits<std::int64_t>::max();
  if (later_ns <= earlier_ns) return record(0);
  const bool fits = earlier_ns >= 0 || later_ns <= kLongest + earlier_ns;
  record(fits ? later_ns - earlier_ns : kLongest);
}

std::uint64_t LatencyHistogram::count() const noexcept {
  std::uint64_t sum = 0;
  for (const auto& count : counts_) sum += count.load(std::memory_order_relaxed);
  return sum;
}

std::uint64_t LatencyHistogram::count_up_to(std::int64_t latency_ns) const noexcept {
  if (latency_ns < 0) return 0;
  const std::size_t last = bucket(static_cast<std::uint64_t>(latency_ns));
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i <= last; ++i) sum += counts_[i].load(std::memory_order_relaxed);
  return sum;
}

std::int64_t LatencyHistogram::percentile_ns(double share) const noexcept {
  const auto total = static_cast<double>(count());
  const double wanted = std::ceil(std::clamp(share, 0.0, 1.0) * total);
  double sum = 0.0;
  for (std::size_t i = 0; i < kBuckets; ++i) {
    sum += static_cast<double>(counts_[i].load(std::memory_order_relaxed));
    if (sum >= wanted && sum > 0.0)
      return std::min(static_cast<std::int64_t>(upper_edge(i)), max_ns());
  }
  return 0;
}

}  // namespace zerodrift::service
