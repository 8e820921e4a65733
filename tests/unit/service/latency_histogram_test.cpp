// SPDX-License-Identifier: Apache-2.0
#include "common/service/latency_histogram.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <thread>
#include <vector>

namespace zerodrift::service {
namespace {

constexpr std::uint64_t kSeed = 20240601;
constexpr std::int64_t kLongest = std::numeric_limits<std::int64_t>::max();
constexpr double kShares[] = {0.0, 1e-6, 0.001, 0.1, 0.5, 0.9, 0.99, 0.999, 0.9999, 1.0};

// The nearest-rank percentile: the smallest value with at least this share at or below it.
std::int64_t exact_percentile(const std::vector<std::int64_t>& sorted, double share) {
  const auto rank = static_cast<std::size_t>(std::ceil(share * static_cast<double>(sorted.size())));
  return sorted[std::max<std::size_t>(rank, 1) - 1];
}

// 16 buckets of equal width an octave: the widest is 1/16 of its lower edge, and its upper edge is
// what a percentile gives, so never below and at most 1/16 above.
void expect_within_a_bucket(const LatencyHistogram& histogram, std::vector<std::int64_t> values) {
  std::sort(values.begin(), values.end());
  for (const double share : kShares) {
    const std::int64_t exact = exact_percentile(values, share);
    const std::int64_t found = histogram.percentile_ns(share);
    EXPECT_GE(found, exact) << "share " << share << ", seed " << kSeed;
    EXPECT_LE(found, exact + exact / 16) << "share " << share << ", seed " << kSeed;
  }
}

TEST(LatencyHistogramLaws, APercentileLiesWithinABucketAboveTheExactOne) {
  std::mt19937_64 random(kSeed);
  for (const double spread : {0.1, 1.0, 4.0}) {
    // From nanoseconds to hours.
    std::lognormal_distribution<double> latency(std::log(1e5), spread);
    LatencyHistogram histogram;
    std::vector<std::int64_t> values(20000);
    for (std::int64_t& value : values) {
      value = static_cast<std::int64_t>(latency(random));
      histogram.record(value);
    }
    EXPECT_EQ(histogram.count(), values.size());
    EXPECT_EQ(histogram.max_ns(), *std::max_element(values.begin(), values.end()));
    expect_within_a_bucket(histogram, values);
  }
}

TEST(LatencyHistogramLaws, EveryEdgeOfABucketStaysWithinIt) {
  for (int bit = 0; bit < 63; ++bit) {
    const std::int64_t power = std::int64_t{1} << bit;
    for (const std::int64_t value :
         {power - 1, power, power + 1, power + power / 16, power / 2 * 3}) {
      LatencyHistogram histogram;
      histogram.record(value);
      histogram.record(kLongest);  // so that the largest value does not cap the answer
      EXPECT_GE(histogram.percentile_ns(0.5), value);
      EXPECT_LE(histogram.percentile_ns(0.5) - value, value / 16);
    }
  }
}

TEST(LatencyHistogramLaws, PercentilesGrowWithTheirShare) {
  std::mt19937_64 random(kSeed);
  LatencyHistogram histogram;
  for (int i = 0; i < 1000; ++i) histogram.record(static_cast<std::int64_t>(random() >> 20U));
  std::int64_t previous = 0;
  for (int i = 0; i <= 1000; ++i) {
    const std::int64_t now = histogram.percentile_ns(i / 1000.0);
    EXPECT_GE(now, previous);
    previous = now;
  }
  EXPECT_EQ(previous, histogram.max_ns());
}

TEST(LatencyHistogramLaws, ValuesBelowSixteenAreExact) {
  for (std::int64_t value = 0; value < 16; ++value) {
    LatencyHistogram histogram;
    histogram.record(value);
    histogram.record(kLongest);
    EXPECT_EQ(histogram.percentile_ns(0.5), value);
  }
}

TEST(LatencyHistogramAbuse, AnEmptyOneGivesZero) {
  const LatencyHistogram histogram;
  EXPECT_EQ(histogram.count(), 0U);
  EXPECT_EQ(histogram.max_ns(), 0);
  for (const double share : kShares) EXPECT_EQ(histogram.percentile_ns(share), 0);
}

TEST(LatencyHistogramAbuse, ExtremesAreCountedAndNegativeOnesAreZero) {
  LatencyHistogram histogram;
  histogram.record(-1);
  histogram.record(std::numeric_limits<std::int64_t>::min());
  EXPECT_EQ(histogram.percentile_ns(1.0), 0);
  EXPECT_EQ(histogram.max_ns(), 0);
  histogram.record(kLongest);
  EXPECT_EQ(histogram.count(), 3U);
  EXPECT_EQ(histogram.percentile_ns(0.5), 0);
  EXPECT_EQ(histogram.percentile_ns(1.0), kLongest);
  EXPECT_EQ(histogram.max_ns(), kLongest);
}

TEST(LatencyHistogramAbuse, SharesOutsideZeroToOneAreThoseOfTheirEnd) {
  LatencyHistogram histogram;
  for (std::int64_t value = 1; value <= 10; ++value) histogram.record(value);
  EXPECT_EQ(histogram.percentile_ns(-1.0), 1);
  EXPECT_EQ(histogram.percentile_ns(2.0), 10);
  EXPECT_EQ(histogram.percentile_ns(std::numeric_limits<double>::quiet_NaN()), 0);
}

// A stamp of another process may be anything; the span from the least to the greatest doesn't fit.
TEST(LatencyHistogramAbuse, ALatencyBetweenAnyTwoStampsIsDefined) {
  constexpr std::int64_t kLeast = std::numeric_limits<std::int64_t>::min();
  constexpr std::int64_t kGreatest = std::numeric_limits<std::int64_t>::max();
  LatencyHistogram histogram;
  histogram.record_between(kGreatest, kLeast);
  EXPECT_EQ(histogram.max_ns(), 0);
  histogram.record_between(100, 130);
  EXPECT_EQ(histogram.max_ns(), 30);
  histogram.record_between(-1, kGreatest - 2);
  EXPECT_EQ(histogram.max_ns(), kGreatest - 1);
  histogram.record_between(kLeast, kGreatest);
  EXPECT_EQ(histogram.max_ns(), kGreatest);
  EXPECT_EQ(histogram.count(), 4U);
  EXPECT_EQ(histogram.percentile_ns(1.0), kGreatest);
}

TEST(LatencyHistogramLaws, AnotherThreadMayReadMeanwhile) {
  constexpr std::int64_t kSmallest = 1000;
  constexpr std::int64_t kLargest = 2000;
  constexpr std::uint64_t kRecords = 200000;
  LatencyHistogram histogram;
  histogram.record(kLargest);
  std::atomic<bool> done{false};
  std::thread recorder([&] {
    for (std::uint64_t i = 1; i < kRecords; ++i) {
      histogram.record(kSmallest + static_cast<std::int64_t>(i % (kLargest - kSmallest)));
    }
    done = true;
  });
  std::uint64_t reads = 0;
  std::uint64_t previous_count = 0;
  while (!done || reads == 0) {
    const std::int64_t median = histogram.percentile_ns(0.5);
    EXPECT_GE(median, kSmallest);
    EXPECT_LE(median, kLargest);
    const std::uint64_t count = histogram.count();
    EXPECT_GE(count, previous_count);
    previous_count = count;
    ++reads;
  }
  recorder.join();
  EXPECT_EQ(histogram.count(), kRecords);
}

}  // namespace
}  // namespace zerodrift::service
