// SPDX-License-Identifier: Apache-2.0
#include "common/allan/stream_statistics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

#include "tests/support/allocation_count.h"
#include "tests/unit/allan/noise_sources.h"

namespace zerodrift::allan {
namespace {

constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();
constexpr double kN = 3e-7;

StreamStatisticsOptions small() {
  StreamStatisticsOptions options;
  options.sample_interval_s = 0.01;
  options.window_s = 100.0;
  options.longest_tau_s = 50.0;
  options.block_s = 10.0;
  return options;
}

void feed(StreamStatistics& statistics, test::WhiteNoise& noise, int samples) {
  for (int k = 0; k < samples; ++k) statistics.add(noise.next());
}

TEST(StreamStatistics, ReportWhatTheirPartsSay) {
  const StreamStatisticsOptions options = small();
  StreamStatistics statistics(options);
  statistics.begin_blocks();
  RollingAllanOptions parts;
  parts.sample_interval_s = options.sample_interval_s;
  parts.window_s = options.window_s;
  parts.longest_tau_s = options.longest_tau_s;
  RollingAllan deviations(parts);
  test::WhiteNoise noise(kN, 0.01, 5);
  for (int k = 0; k < 30000; ++k) {
    const double rate = 1e-5 + noise.next();
    statistics.add(rate);
    deviations.add(rate);
  }
  const StreamReport report = statistics.report();
  const auto expected = deviations.points(Span::kRolling);
  ASSERT_EQ(report.rolling.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i)
    EXPECT_EQ(report.rolling[i].deviation_radps, expected[i].deviation_radps);
  EXPECT_EQ(report.since_start.size(), deviations.points(Span::kSinceStart).size());
  EXPECT_EQ(report.samples, 30000U);
  EXPECT_EQ(report.observed_s(), 300.0);
  EXPECT_EQ(report.since_start_blocks.blocks, 30U);
  EXPECT_EQ(report.rolling_blocks.blocks, 10U);
  // 5 sigma of a mean over 300 s: N / sqrt(T)
  EXPECT_NEAR(report.since_start_blocks.mean, 1e-5, 5.0 * kN / std::sqrt(300.0));
  // N is known to about 1/sqrt(2 edf) of the shortest taus, 0.5 %; 5 sigma.
  const Coefficient& n = report.coefficients[NoiseTerm::kAngleRandomWalk];
  EXPECT_EQ(n.identification, Identification::kInterval);
  EXPECT_NEAR(n.value / kN, 1.0, 0.025);
  EXPECT_EQ(report.output, StuckDetector::Output::kAlive);
}

// What they were begun with is a first guess. Before: N was off by the root of its error.
TEST(StreamStatistics, GoByTheIntervalThatIsReported) {
  for (const double guessed_s : {0.0096, 0.0104}) {
    StreamStatisticsOptions options = small();
    options.sample_interval_s = guessed_s;
    StreamStatistics statistics(options);
    statistics.begin_blocks();
    test::WhiteNoise noise(kN, 0.01, 5);
    feed(statistics, noise, 30000);
    statistics.gap(100);
    const StreamReport report = statistics.report(0.01);
    EXPECT_EQ(report.sample_interval_s, 0.01);
    EXPECT_EQ(report.observed_s(), 300.0);
    EXPECT_EQ(report.longest_gap_s, 1.0);
    EXPECT_NEAR(report.since_start[0].tau_s, 0.01, 1e-15);
    EXPECT_NEAR(report.rolling[1].tau_s, 0.02, 1e-15);
    EXPECT_NEAR(report.block_s, 0.01 * std::round(10.0 / guessed_s), 1e-12);
    // 5 sigma, as above.
    EXPECT_NEAR(report.coefficients[NoiseTerm::kAngleRandomWalk].value / kN, 1.0, 0.025);
    const auto guess = statistics.report().since_start[0];
    EXPECT_EQ(report.since_start[0].deviation_radps, guess.deviation_radps);
  }
}

TEST(StreamStatistics, TakeNoBlocksBeforeTheyAreAskedFor) {
  StreamStatistics statistics(small());
  test::WhiteNoise noise(kN, 0.01, 6);
  feed(statistics, noise, 5000);
  EXPECT_EQ(statistics.report().since_start_blocks.blocks, 0U);
  statistics.begin_blocks();
  feed(statistics, noise, 5000);
  EXPECT_EQ(statistics.report().since_start_blocks.blocks, 5U);
}

TEST(StreamStatistics, CountGapsTheirSamplesAndTheLongest) {
  StreamStatistics statistics(small());
  test::WhiteNoise noise(kN, 0.01, 7);
  feed(statistics, noise, 1000);
  statistics.gap(60000);
  feed(statistics, noise, 1000);
  for (int k = 0; k < 3; ++k) statistics.add(kNoNumber);
  statistics.gap(2);  // the same interruption
  feed(statistics, noise, 1000);
  const StreamReport report = statistics.report();
  EXPECT_EQ(report.samples, 3000U);
  EXPECT_EQ(report.gaps, 2U);
  EXPECT_EQ(report.missing, 60005U);
  EXPECT_EQ(report.longest_gap_s, 600.0);
}

TEST(StreamStatisticsAbuse, NothingThatIsNoRatePoisonsAFigure) {
  StreamStatistics statistics(small());
  statistics.begin_blocks();
  test::WhiteNoise noise(kN, 0.01, 8);
  const double bad[] = {kNoNumber, std::numeric_limits<double>::infinity(), -1e300, 1e300};
  for (int k = 0; k < 20000; ++k) {
    if (k % 1000 == 999) statistics.add(bad[k / 1000 % 4]);
    statistics.add(noise.next());
  }
  const StreamReport report = statistics.report();
  EXPECT_EQ(report.missing, 20U);
  for (const auto& points : {report.since_start, report.rolling}) {
    ASSERT_FALSE(points.empty());
    for (const AllanPoint& p : points) {
      EXPECT_TRUE(std::isfinite(p.deviation_radps) && std::isfinite(p.upper_radps)) << p.tau_s;
      // 5 sigma of an estimate with these degrees of freedom, on the log scale.
      if (p.degrees_of_freedom > 50.0) {
        EXPECT_NEAR(std::log(p.deviation_radps * std::sqrt(p.tau_s) / kN), 0.0,
                    5.0 / std::sqrt(2.0 * p.degrees_of_freedom));
      }
    }
  }
}

// Raw is put together again from compensated and drift, to a rounding.
TEST(StreamStatistics, AFrozenOutputIsFrozenAlsoWhenARoundingMovesIt) {
  StreamStatistics statistics(small());
  test::WhiteNoise noise(kN, 0.01, 9);
  feed(statistics, noise, 1000);
  EXPECT_EQ(statistics.report().output, StuckDetector::Output::kAlive);
  const double frozen = 1.2345e-6;
  for (int k = 0; k < 300; ++k) {
    const double drift = 1e-6 + 1e-10 * k;
    statistics.add((frozen - drift) + drift);
  }
  EXPECT_EQ(statistics.report().output, StuckDetector::Output::kStuck);
  feed(statistics, noise, 1);
  EXPECT_EQ(statistics.report().output, StuckDetector::Output::kAlive);
}

// What the reporting thread relies on: a copy under the lock takes no memory.
TEST(StreamStatistics, AreCopiedIntoAKeptCopyWithoutTakingMemory) {
  StreamStatistics statistics(small());
  StreamStatistics copy(small());
  test::WhiteNoise noise(kN, 0.01, 10);
  feed(statistics, noise, 3000);
  const std::size_t before = allocation_count();
  copy = statistics;
  statistics.add(noise.next());
  statistics.gap(5);
  EXPECT_EQ(allocation_count(), before);
  EXPECT_EQ(copy.samples(), 3000U);
  EXPECT_EQ(copy.report().rolling.size(), statistics.report().rolling.size());
}

// Every interval that StreamTiming lets pass, with the monitor's defaults and with odd ones.
TEST(StreamStatisticsAbuse, AnyAcceptedIntervalWorks) {
  for (const double interval_s : {1e-4, 5e-3, 1.0, 100.0}) {
    for (const double window_s : {1e-3, 60.0, 3600.0, 86400.0}) {
      StreamStatisticsOptions options;
      options.sample_interval_s = interval_s;
      options.window_s = window_s;
      EXPECT_EQ(options.validate(), std::nullopt) << interval_s << ' ' << window_s;
      StreamStatistics statistics(options);
      statistics.add(1e-6);
      EXPECT_EQ(statistics.report().samples, 1U);
      EXPECT_LT(statistics.memory_bytes(), 200000U);
    }
  }
}

TEST(StreamStatisticsAbuse, AWrongOptionIsNamed) {
  StreamStatisticsOptions options;
  options.window_s = kNoNumber;
  EXPECT_EQ(options.validate().value_or("").rfind("window_s", 0), 0U);
  EXPECT_THROW(StreamStatistics{options}, std::invalid_argument);
  options = {};
  options.stuck_surely_s = 0.5;
  EXPECT_EQ(options.validate().value_or("").rfind("stuck_surely_s", 0), 0U);
}

}  // namespace
}  // namespace zerodrift::allan
