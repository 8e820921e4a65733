// SPDX-License-Identifier: Apache-2.0
// Latencies in 16 buckets of equal width to the octave, as in HdrHistogram: a percentile is given
// at most 1/16 too large, whatever the range, in fixed memory. One thread records, others may read
// meanwhile.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

namespace zerodrift::service {

class LatencyHistogram {
 public:
  // No lock, no allocation. Negative latencies (clocks that disagree) count as 0.
  void record(std::int64_t latency_ns) noexcept;
  // Of two stamps, of which another process may have given one: defined for any.
  void record_between(std::int64_t earlier_ns, std::int64_t later_ns) noexcept;

  [[nodiscard]] std::uint64_t count() const noexcept;
  // Of all records, to the nanosecond; negative ones add nothing.
  [[nodiscard]] std::uint64_t sum_ns() const noexcept {
    return sum_.load(std::memory_order_relaxed);
  }
  // Upper edge of the bucket that holds the given share of the records; 0 when empty. O(buckets).
  [[nodiscard]] std::int64_t percentile_ns(double share) const noexcept;
  // Records in the buckets up to and with that of this latency: those that took at most so long, to
  // 1/16 of it; 0 for a negative one. O(buckets).
  [[nodiscard]] std::uint64_t count_up_to(std::int64_t latency_ns) const noexcept;
  [[nodiscard]] std::int64_t max_ns() const noexcept {
    return max_.load(std::memory_order_relaxed);
  }

 private:
  static constexpr std::size_t kSubBits = 4;
  static constexpr std::size_t kBuckets = (64 - kSubBits) << kSubBits;
  static std::size_t bucket(std::uint64_t value) noexcept;
  static std::uint64_t upper_edge(std::size_t bucket) noexcept;

  std::array<std::atomic<std::uint64_t>, kBuckets> counts_{};
  std::atomic<std::uint64_t> sum_{0};
  std::atomic<std::int64_t> max_{0};
};

}  // namespace zerodrift::service
