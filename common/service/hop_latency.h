// SPDX-License-Identifier: Apache-2.0
// How long samples take from one stamp of their way to the next, and how a status says it. Hops:
//
//   sensor    sensor time -> publisher's write; where the gyro's clock is the host's Unix clock
//   arrival   publisher's write -> ingress at the compensation
//   compute   ingress -> egress, both there; a replay's samples also wait there for what they need
//   delivery  egress -> arrival at a subscriber
//   chain     publisher's write -> arrival at that subscriber
//
// Stamps of two processes can be compared where both run on one host, whose monotonic clock they
// are of. What can't be a latency is counted apart.
#pragma once

#include <atomic>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/service/host.h"
#include "common/service/latency_histogram.h"

namespace zerodrift::service {

class HopLatency {
 public:
  // `name` lives longer.
  explicit HopLatency(std::string_view name) : name_(name) {}

  // One thread. No lock, no memory. Of two stamps, either of which another process may have given:
  // negative or longer than a minute, and they are of clocks that can't be compared.
  void record_between(std::int64_t earlier_ns, std::int64_t later_ns) noexcept;
  // Of two stamps of one's own clock.
  void record(std::int64_t latency_ns) noexcept { histogram_.record(latency_ns); }

  // Any thread.
  [[nodiscard]] std::string_view name() const noexcept { return name_; }
  [[nodiscard]] const LatencyHistogram& histogram() const noexcept { return histogram_; }
  [[nodiscard]] std::uint64_t incomparable() const noexcept {
    return incomparable_.load(std::memory_order_relaxed);
  }

 private:
  std::string_view name_;
  LatencyHistogram histogram_;
  std::atomic<std::uint64_t> incomparable_{0};
};

// Both clocks of this host, read at the same time, ns.
struct ArrivalClocks {
  std::int64_t unix_ns = 0;
  std::int64_t monotonic_ns = 0;
};
// The Unix time of a stamp of the monotonic clock; its own time where it is out of range.
std::int64_t unix_time_of(std::int64_t monotonic_stamp_ns, const ArrivalClocks& now) noexcept;

// `<hop>_p50`, `_p99`, `_p999` and `_max`, us.
std::vector<Metric> latency_metrics(std::span<const HopLatency* const> hops);

inline constexpr const char* kLatencyPart = "latency";
// The buckets, as a part kLatencyPart: `<hop>_le_<bound>` counts the samples that took at most the
// bound (1, 2, 5, ... from 1us to 1s; to 1/16 of the bound), `<hop>_count` all, `<hop>_sum` adds up
// how long they took, us, and `<hop>_incomparable` counts those whose stamps weren't of one clock.
// 22 metrics a hop: seven hops fit.
StatusPart latency_part(std::span<const HopLatency* const> hops);

}  // namespace zerodrift::service
