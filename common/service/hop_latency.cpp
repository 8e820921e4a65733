// SPDX-License-Identifier: Apache-2.0
#include "common/service/hop_latency.h"

#include <array>

namespace zerodrift::service {
namespace {

constexpr std::int64_t kLongestNs = 60'000'000'000;  // a replay's sample may wait
constexpr double kMicro = 1e-3;                      // of a nanosecond count

struct Bound {
  std::int64_t ns;
  const char* name;
};
constexpr std::array kBounds{
    Bound{1'000, "1us"},         Bound{2'000, "2us"},         Bound{5'000, "5us"},
    Bound{10'000, "10us"},       Bound{20'000, "20us"},       Bound{50'000, "50us"},
    Bound{100'000, "100us"},     Bound{200'000, "200us"},     Bound{500'000, "500us"},
    Bound{1'000'000, "1ms"},     Bound{2'000'000, "2ms"},     Bound{5'000'000, "5ms"},
    Bound{10'000'000, "10ms"},   Bound{20'000'000, "20ms"},   Bound{50'000'000, "50ms"},
    Bound{100'000'000, "100ms"}, Bound{200'000'000, "200ms"}, Bound{500'000'000, "500ms"},
    Bound{1'000'000'000, "1s"}};

}  // namespace

void HopLatency::record_between(std::int64_t earlier_ns, std::int64_t later_ns) noexcept {
  std::int64_t latency_ns = 0;
  const bool overflows = __builtin_sub_overflow(later_ns, earlier_ns, &latency_ns);
  if (overflows || latency_ns < 0 || latency_ns > kLongestNs) {
    incomparable_.store(incomparable_.load(std::memory_order_relaxed) + 1,
                        std::memory_order_relaxed);
    return;
  }
  histogram_.record(latency_ns);
}

std::int64_t unix_time_of(std::int64_t monotonic_stamp_ns, const ArrivalClocks& now) noexcept {
  std::int64_t age_ns = 0;
  std::int64_t unix_ns = 0;
  if (__builtin_sub_overflow(now.monotonic_ns, monotonic_stamp_ns, &age_ns) ||
      __builtin_sub_overflow(now.unix_ns, age_ns, &unix_ns))
    return monotonic_stamp_ns;
  return unix_ns;
}

std::vector<Metric> latency_metrics(std::span<const HopLatency* const> hops) {
  std::vector<Metric> metrics;
  for (const HopLatency* hop : hops) {
    const LatencyHistogram& histogram = hop->histogram();
    const auto add = [&](const char* what, std::int64_t ns) {
      metrics.push_back({std::string(hop->name()) + what, "us", static_cast<double>(ns) * kMicro});
    };
    add("_p50", histogram.percentile_ns(0.5));
    add("_p99", histogram.percentile_ns(0.99));
    add("_p999", histogram.percentile_ns(0.999));
    add("_max", histogram.max_ns());
  }
  return metrics;
}

StatusPart latency_part(std::span<const HopLatency* const> hops) {
  StatusPart part{.name = kLatencyPart};
  for (const HopLatency* hop : hops) {
    const auto add = [&](const std::string& what, std::uint64_t count) {
      part.metrics.push_back({std::string(hop->name()) + what, "1", static_cast<double>(count)});
    };
    for (const Bound& bound : kBounds)
      add(std::string("_le_") + bound.name, hop->histogram().count_up_to(bound.ns));
    add("_count", hop->histogram().count());
    part.metrics.push_back({std::string(hop->name()) + "_sum", "us",
                            static_cast<double>(hop->histogram().sum_ns()) * kMicro});
    add("_incomparable", hop->incomparable());
  }
  return part;
}

}  // namespace zerodrift::service
