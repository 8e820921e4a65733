// SPDX-License-Identifier: Apache-2.0
#include "tests/hosts/sample_stream.h"

#include <algorithm>
#include <cstddef>

namespace zerodrift::hosts_test {
namespace {

constexpr double kMsPerNs = 1e-6;
constexpr double kStandstillMs = 50.0;

// The smallest that at least the share `p` is not above. `sorted` is not empty.
double quantile(const std::vector<double>& sorted, double p) {
  const auto at = static_cast<std::size_t>(p * static_cast<double>(sorted.size()));
  return sorted[std::min(at, sorted.size() - 1)];
}

// In order of arrival.
void judge_latency(const std::vector<double>& latencies_ms, StreamVerdict& verdict) {
  if (latencies_ms.empty()) return;
  std::vector<double> sorted = latencies_ms;
  std::sort(sorted.begin(), sorted.end());
  verdict.latency_p50_ms = quantile(sorted, 0.5);
  verdict.latency_p99_ms = quantile(sorted, 0.99);
  verdict.latency_max_ms = sorted.back();
  bool was_late = false;
  for (const double latency_ms : latencies_ms) {
    const bool is_late = latency_ms > verdict.latency_p50_ms + kStandstillMs;
    if (is_late && !was_late) ++verdict.standstills;
    was_late = is_late;
  }
}

}  // namespace

void SampleStream::note(std::uint64_t sequence, std::int64_t sensor_ns, std::int64_t arrived_ns) {
  const std::lock_guard lock(mutex_);
  arrivals_.push_back({sequence, sensor_ns, arrived_ns});
  newest_ = std::max(newest_, sequence);
}

StreamVerdict SampleStream::judge(std::uint64_t first, std::uint64_t last) const {
  const std::lock_guard lock(mutex_);
  StreamVerdict verdict{.sent = last - first + 1};
  std::vector<std::uint64_t> times(verdict.sent, 0);
  std::vector<double> latencies_ms;
  const Arrival* before = nullptr;
  for (const Arrival& arrival : arrivals_) {
    if (arrival.sequence < first || arrival.sequence > last) continue;
    ++times[arrival.sequence - first];
    latencies_ms.push_back(static_cast<double>(arrival.arrived_ns - arrival.sensor_ns) * kMsPerNs);
    if (before != nullptr) {
      verdict.longest_silence_ms =
          std::max(verdict.longest_silence_ms,
                   static_cast<double>(arrival.arrived_ns - before->arrived_ns) * kMsPerNs);
      if (arrival.sequence < before->sequence) ++verdict.out_of_order;
    }
    before = &arrival;
  }
  std::uint64_t gap = 0;
  for (const std::uint64_t count : times) {
    verdict.received += count > 0 ? 1 : 0;
    verdict.doubled += count > 1 ? 1 : 0;
    gap = count == 0 ? gap + 1 : 0;
    verdict.longest_gap = std::max(verdict.longest_gap, gap);
  }
  verdict.missing = verdict.sent - verdict.received;
  judge_latency(latencies_ms, verdict);
  return verdict;
}

std::uint64_t SampleStream::newest() const {
  const std::lock_guard lock(mutex_);
  return newest_;
}

std::size_t SampleStream::size() const {
  const std::lock_guard lock(mutex_);
  return arrivals_.size();
}

}  // namespace zerodrift::hosts_test
