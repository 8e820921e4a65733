// SPDX-License-Identifier: Apache-2.0
#include "common/service/hop_latency.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <limits>
#include <map>
#include <string>

namespace zerodrift::service {
namespace {

constexpr std::int64_t kMinuteNs = 60'000'000'000;
constexpr std::int64_t kLeast = std::numeric_limits<std::int64_t>::min();
constexpr std::int64_t kGreatest = std::numeric_limits<std::int64_t>::max();

std::map<std::string, double> by_name(const std::vector<Metric>& metrics) {
  std::map<std::string, double> result;
  for (const Metric& metric : metrics) {
    EXPECT_TRUE(result.emplace(metric.name, metric.value).second) << metric.name;
  }
  return result;
}

TEST(HopLatencyLaws, TheBucketsCountWhatTookAtMostTheirBound) {
  HopLatency hop("arrival");
  // Below each bound by an eighth, which is more than the 1/16 to which a bucket is known.
  for (const std::int64_t us : {1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 1'000'000})
    hop.record_between(0, us * 875);
  const std::array<const HopLatency*, 1> hops{&hop};
  const StatusPart part = latency_part(hops);
  EXPECT_EQ(part.name, "latency");
  const auto metrics = by_name(part.metrics);
  EXPECT_EQ(metrics.at("arrival_le_1us"), 1.0);
  EXPECT_EQ(metrics.at("arrival_le_20us"), 5.0);
  EXPECT_EQ(metrics.at("arrival_le_500us"), 9.0);
  EXPECT_EQ(metrics.at("arrival_le_1ms"), 10.0);
  EXPECT_EQ(metrics.at("arrival_le_500ms"), 10.0);
  EXPECT_EQ(metrics.at("arrival_le_1s"), 11.0);
  EXPECT_EQ(metrics.at("arrival_count"), 11.0);
  EXPECT_EQ(metrics.at("arrival_sum"), 0.875 * (888 + 1000 + 1'000'000));  // us, to the nanosecond
  EXPECT_EQ(metrics.at("arrival_incomparable"), 0.0);
}

TEST(HopLatencyLaws, BucketsGrowWithTheirBoundsAndEndWithAllThatIsNotLonger) {
  HopLatency hop("compute");
  for (std::int64_t ns = 1; ns < kMinuteNs; ns += ns / 7 + 1) hop.record(ns);
  const std::array<const HopLatency*, 1> hops{&hop};
  double before = 0.0;
  for (const Metric& metric : latency_part(hops).metrics) {
    if (metric.name.find("_le_") == std::string::npos) continue;
    EXPECT_GT(metric.value, before) << metric.name;
    before = metric.value;
  }
  EXPECT_LT(before, static_cast<double>(hop.histogram().count()));
}

TEST(HopLatencyLaws, PercentilesAndTheLargestAreInMicroseconds) {
  HopLatency hop("delivery");
  for (int k = 0; k < 1000; ++k) hop.record(k < 990 ? 10'000 : 1'000'000);
  const std::array<const HopLatency*, 1> hops{&hop};
  const auto metrics = by_name(latency_metrics(hops));
  ASSERT_EQ(metrics.size(), 4U);
  // Given at most 1/16 too large.
  EXPECT_NEAR(metrics.at("delivery_p50"), 10.0, 10.0 / 16.0);
  EXPECT_NEAR(metrics.at("delivery_p99"), 10.0, 10.0 / 16.0);
  EXPECT_EQ(metrics.at("delivery_p999"), 1000.0);
  EXPECT_EQ(metrics.at("delivery_max"), 1000.0);
}

TEST(HopLatencyLaws, SevenHopsFitIntoAStatus) {
  const HopLatency hop("x");
  const std::array<const HopLatency*, 1> hops{&hop};
  EXPECT_LE(7 * latency_part(hops).metrics.size(), 160U);
}

TEST(HopLatencyAbuse, StampsOfClocksThatCannotBeComparedAreCountedApart) {
  HopLatency hop("arrival");
  hop.record_between(10, 9);
  hop.record_between(0, kMinuteNs + 1);
  hop.record_between(kLeast, kGreatest);
  hop.record_between(kGreatest, kLeast);
  EXPECT_EQ(hop.histogram().count(), 0U);
  EXPECT_EQ(hop.incomparable(), 4U);
  hop.record_between(10, 10);
  hop.record_between(0, kMinuteNs);
  hop.record_between(kLeast, kLeast + 5);
  EXPECT_EQ(hop.histogram().count(), 3U);
  EXPECT_EQ(hop.incomparable(), 4U);
}

TEST(HopLatencyLaws, AMonotonicStampIsAsOldInUnixTime) {
  const ArrivalClocks now{.unix_ns = 1'700'000'000'000'000'000, .monotonic_ns = 5'000'000'000};
  EXPECT_EQ(unix_time_of(5'000'000'000, now), now.unix_ns);
  EXPECT_EQ(unix_time_of(4'999'000'000, now), now.unix_ns - 1'000'000);
  EXPECT_EQ(unix_time_of(5'000'000'001, now), now.unix_ns + 1);
}

TEST(HopLatencyAbuse, AnyMonotonicStampGivesATime) {
  const ArrivalClocks now{.unix_ns = 1'700'000'000'000'000'000, .monotonic_ns = 5'000'000'000};
  EXPECT_EQ(unix_time_of(kLeast, now), kLeast);
  unix_time_of(kGreatest, now);
}

}  // namespace
}  // namespace zerodrift::service
