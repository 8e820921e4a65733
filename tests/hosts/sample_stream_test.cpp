// SPDX-License-Identifier: Apache-2.0
#include "tests/hosts/sample_stream.h"

#include <gtest/gtest.h>

namespace zerodrift::hosts_test {
namespace {

constexpr std::int64_t kMs = 1'000'000;

TEST(SampleStream, CountsWhatIsMissingDoubledAndOutOfOrder) {
  SampleStream stream;
  std::int64_t now = 0;
  for (const std::uint64_t sequence : {9U, 10U, 11U, 15U, 14U, 15U, 19U, 21U}) {
    now += 5 * kMs;
    stream.note(sequence, now, now);
  }
  const StreamVerdict verdict = stream.judge(10, 20);
  EXPECT_EQ(verdict.sent, 11U);
  EXPECT_EQ(verdict.received, 5U);
  EXPECT_EQ(verdict.missing, 6U);
  EXPECT_EQ(verdict.doubled, 1U);
  EXPECT_EQ(verdict.out_of_order, 1U);
  EXPECT_EQ(verdict.longest_gap, 3U);
  EXPECT_EQ(stream.newest(), 21U);
}

TEST(SampleStream, MeasuresFromStampToArrivalAndFromArrivalToArrival) {
  SampleStream stream;
  for (std::uint64_t n = 1; n <= 100; ++n) {
    const std::int64_t sensor = static_cast<std::int64_t>(n) * 5 * kMs;
    stream.note(n, sensor, sensor + (n == 50 ? 42 : 2) * kMs);
  }
  const StreamVerdict verdict = stream.judge(1, 100);
  EXPECT_DOUBLE_EQ(verdict.latency_p50_ms, 2.0);
  EXPECT_DOUBLE_EQ(verdict.latency_p99_ms, 42.0);
  EXPECT_DOUBLE_EQ(verdict.longest_silence_ms, 45.0);
}

TEST(SampleStream, CountsHowOftenEverythingStoodStill) {
  SampleStream stream;
  for (std::uint64_t n = 1; n <= 100; ++n) {
    const std::int64_t sensor = static_cast<std::int64_t>(n) * 5 * kMs;
    const bool is_late = n == 20 || n == 21 || n == 60;
    stream.note(n, sensor, sensor + (is_late ? 53 : n == 80 ? 52 : 2) * kMs);
  }
  EXPECT_EQ(stream.judge(1, 100).standstills, 2U);
}

TEST(SampleStream, WhereNothingCameAllIsMissing) {
  const StreamVerdict verdict = SampleStream().judge(1, 10);
  EXPECT_EQ(verdict.missing, 10U);
  EXPECT_EQ(verdict.longest_gap, 10U);
}

}  // namespace
}  // namespace zerodrift::hosts_test
