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

TEST(SampleStream, CountsHowOftenLatencyLeftTheUsual) {
  const auto late_times = [](std::int64_t often_ms, std::int64_t twice_ms) {
    SampleStream stream;
    for (std::uint64_t n = 1; n <= 1000; ++n) {
      const std::int64_t sensor = static_cast<std::int64_t>(n) * 5 * kMs;
      const bool is_one_of_two = n / 2 == 100 || n / 2 == 300;  // two samples each
      stream.note(n, sensor,
                  sensor + (is_one_of_two ? twice_ms
                            : n % 50 == 0 ? often_ms
                                          : 2) *
                               kMs);
    }
    return stream.judge(1, 1000).late_times;
  };
  EXPECT_EQ(late_times(2, 7), 0U);
  EXPECT_EQ(late_times(2, 8), 2U);
  EXPECT_EQ(late_times(12, 22), 0U);
  EXPECT_EQ(late_times(12, 23), 2U);
}

TEST(SampleStream, WhereNothingCameAllIsMissing) {
  const StreamVerdict verdict = SampleStream().judge(1, 10);
  EXPECT_EQ(verdict.missing, 10U);
  EXPECT_EQ(verdict.longest_gap, 10U);
}

}  // namespace
}  // namespace zerodrift::hosts_test
