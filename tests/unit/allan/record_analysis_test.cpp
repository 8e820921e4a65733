// SPDX-License-Identifier: Apache-2.0
#include "common/allan/record_analysis.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "common/allan/sample_clock.h"
#include "common/allan/series_check.h"
#include "common/core/require.h"
#include "tests/unit/allan/noise_sources.h"

namespace zerodrift::allan {
namespace {

constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();
constexpr double kInterval = 0.01;

std::vector<double> white(std::size_t samples, std::uint64_t seed, double n = 1e-6) {
  test::WhiteNoise source(n, kInterval, seed);
  std::vector<double> rate(samples);
  for (double& y : rate) y = source.next();
  return rate;
}

SeriesReport analysed(const std::vector<double>& rate, SeriesOptions options = {}) {
  options.nominal_interval_s = kInterval;
  SeriesAnalysis analysis(options);
  for (const double y : rate) analysis.add(y);
  return analysis.report(kInterval);
}

const StatisticCurve& curve_of(const SeriesReport& report, Statistic statistic) {
  return *std::find_if(report.curves.begin(), report.curves.end(),
                       [&](const StatisticCurve& c) { return c.statistic == statistic; });
}

// -------------------------------------------------------------------------------- sample clock

TEST(SampleClockLaws, JitterIsNoGapAndThePeriodIsTheMean) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> jitter(-0.1, 0.1);  // of a period, each stamp
  SampleClock clock(0.00502);                                // a nominal period 0.4 % off
  double stamp = 0.0;
  for (int i = 1; i <= 20000; ++i) {
    const double next = 0.005 * (i + jitter(random));
    EXPECT_EQ(clock.add(next - stamp), 0U);
    stamp = next;
  }
  clock.finish();
  EXPECT_EQ(clock.gaps(), 0U);
  EXPECT_FALSE(clock.period_change());
  // The steps add up to the last stamp: its jitter over 20 000 periods.
  EXPECT_NEAR(clock.period_s(), 0.005, 0.005 * 0.1 / 20000);
}

TEST(SampleClockLaws, AStepOfMoreThanOneAndAHalfPeriodsIsAGap) {
  SampleClock clock(0.01);
  EXPECT_EQ(clock.add(0.0149), 0U);
  EXPECT_EQ(clock.add(0.0151), 1U);
  EXPECT_EQ(clock.add(600.01), 60000U);
  EXPECT_EQ(clock.gaps(), 2U);
  EXPECT_EQ(clock.missing(), 60001U);
  EXPECT_DOUBLE_EQ(clock.longest_gap_s(), 600.01);
}

TEST(SampleClockScenario, ASecondRateIsFoundAtItsFirstSample) {
  for (const double after_s : {0.005, 0.02, 0.008}) {
    for (const std::uint64_t change : {40U, 255U, 256U, 257U, 1000U}) {
      SampleClock clock(0.01);
      for (std::uint64_t i = 1; i < 1200; ++i) clock.add(i < change ? 0.01 : after_s);
      clock.finish();
      ASSERT_TRUE(clock.period_change()) << after_s << ' ' << change;
      EXPECT_EQ(clock.period_change()->sample, change) << after_s;
      EXPECT_DOUBLE_EQ(clock.period_change()->before_s, 0.01);
      EXPECT_DOUBLE_EQ(clock.period_change()->after_s, after_s);
    }
  }
}

TEST(SampleClockScenario, AShortTailAtAnotherRateIsFoundAtTheEnd) {
  SampleClock clock(0.01);
  for (int i = 0; i < 500; ++i) clock.add(i < 480 ? 0.01 : 0.02);
  EXPECT_FALSE(clock.period_change());
  clock.finish();
  ASSERT_TRUE(clock.period_change());
  EXPECT_EQ(clock.period_change()->sample, 481U);
}

TEST(SampleClockAbuse, APeriodThatIsNoneIsRefusedInEveryBuild) {
  EXPECT_THROW(SampleClock{0.0}, core::BrokenPromise);
  EXPECT_THROW(SampleClock{kMissing}, core::BrokenPromise);
}

TEST(SampleClockScenario, DropsOfAThirdOfTheSamplesAreNoSecondRate) {
  std::mt19937_64 random(2);
  std::bernoulli_distribution dropped(1.0 / 3.0);
  SampleClock clock(0.01);
  double step = 0.01;
  for (int i = 0; i < 30000; ++i, step += 0.01) {
    if (dropped(random)) continue;
    clock.add(step);
    step = 0.0;
  }
  clock.finish();
  EXPECT_FALSE(clock.period_change());
  EXPECT_NEAR(clock.period_s(), 0.01, 1e-9);
}

// -------------------------------------------------------------------------------- series check

TEST(SeriesCheckScenario, SpikesAreCountedAndPlacedAndNoiseIsNot) {
  auto rate = white(50000, 3);
  SeriesCheck clean;
  for (std::size_t i = 0; i < rate.size(); ++i) clean.add(rate[i], i);
  EXPECT_EQ(clean.findings().outliers, 0U);
  rate[12345] = 1e9 * 1e-5;  // 1e9 sigma
  rate[40000] = -1e-3;       // 100 sigma
  SeriesCheck spiky;
  for (std::size_t i = 0; i < rate.size(); ++i) spiky.add(rate[i], i);
  EXPECT_EQ(spiky.findings().outliers, 2U);
  EXPECT_EQ(spiky.findings().first_outlier, 12345U);
  // The scale is that of a median of 4096 deviations: within 5 %.
  EXPECT_NEAR(spiky.findings().largest_outlier_sigmas, 1e9, 5e7);
}

TEST(SeriesCheckScenario, StuckIsWhatNoiseAsCoarseDoesNotDo) {
  std::mt19937_64 random(4);
  std::normal_distribution<double> normal;
  const auto findings = [&](double step, std::size_t stuck) {
    SeriesCheck check;
    double value = 0.0;
    for (std::size_t i = 0; i < 100000; ++i) {
      if (i < 50000 || i >= 50000 + stuck) value = normal(random);
      check.add(step > 0.0 ? step * std::round(value / step) : value, i);
    }
    return check.findings();
  };
  EXPECT_FALSE(findings(0.0, 0).is_stuck);
  EXPECT_FALSE(findings(2.0, 0).is_stuck);  // two of three samples are 0
  for (const double step : {0.0, 0.5, 2.0}) {
    const SeriesFindings found = findings(step, 400);
    EXPECT_TRUE(found.is_stuck) << step;
    EXPECT_GE(found.longest_run, 400U) << step;
    // The run may begin before with equal counts; 100 of them would be stuck themselves.
    EXPECT_NEAR(static_cast<double>(found.longest_run_begin), 50000.0, 100.0) << step;
    EXPECT_FALSE(found.is_constant);
  }
}

TEST(SeriesCheckAbuse, AConstantIsCalledOneAndCountsWithOneOddSampleAreNot) {
  SeriesCheck check;
  for (std::uint64_t i = 0; i < 5000; ++i) check.add(3.0, i);
  EXPECT_TRUE(check.findings().is_constant);
  EXPECT_TRUE(check.findings().is_stuck);
  EXPECT_EQ(check.findings().outliers, 0U);
  check.add(4.0, 5000);
  EXPECT_FALSE(check.findings().is_constant);
}

// ---------------------------------------------------------------------------------------- gaps

TEST(GappedAllanLaws, WithoutMissingSamplesItIsTheOverlappingDeviationToTheBit) {
  const auto rate = white(5000, 5);
  const auto gapped = overlapping_allan_with_gaps(rate, kInterval, TauGrid::kQuarterOctave);
  const auto plain =
      overlapping_allan(angle_from_rate(rate, kInterval), kInterval, TauGrid::kQuarterOctave);
  ASSERT_EQ(gapped.size(), plain.size());
  for (std::size_t i = 0; i < plain.size(); ++i) {
    EXPECT_EQ(gapped[i].point.deviation_radps, plain[i].deviation_radps);
    EXPECT_EQ(gapped[i].point.pairs, plain[i].pairs);
    EXPECT_EQ(gapped[i].rule, GapRule::kComplete);
  }
}

// Written out: every difference of the clusters that the rule admits.
TEST(GappedAllanGolden, EqualsTheDefinitionOnASmallSeries) {
  auto rate = white(400, 6);
  for (const std::size_t i : {3U, 77U, 78U, 150U, 151U, 152U, 300U}) rate[i] = kMissing;
  for (const auto& [point, rule] :
       overlapping_allan_with_gaps(rate, kInterval, TauGrid::kQuarterOctave)) {
    const auto m = static_cast<std::size_t>(std::lround(point.tau_s / kInterval));
    const std::size_t may_lack = rule == GapRule::kComplete ? 0 : m / 10;
    double squares = 0.0;
    std::uint64_t pairs = 0;
    for (std::size_t k = 0; k + 2 * m <= rate.size(); ++k) {
      double mean[2] = {};
      bool counts = true;
      for (std::size_t half = 0; half < 2; ++half) {
        std::size_t there = 0;
        for (std::size_t i = k + half * m; i < k + half * m + m; ++i) {
          if (!std::isfinite(rate[i])) continue;
          mean[half] += rate[i];
          ++there;
        }
        mean[half] /= static_cast<double>(there);
        counts = counts && there + may_lack >= m && there > 0;
      }
      if (!counts) continue;
      squares += (mean[1] - mean[0]) * (mean[1] - mean[0]);
      ++pairs;
    }
    EXPECT_EQ(point.pairs, pairs) << m;
    // Sums of 400 doubles: a few hundred roundings of 1e-16, of means that nearly cancel.
    EXPECT_NEAR(point.deviation_radps / std::sqrt(squares / static_cast<double>(pairs) / 2.0), 1.0,
                1e-10)
        << m;
  }
}

// 1 % dropped at random: no stretch is longer than some seconds, and yet every tau is there, with
// the white noise at most half a percent above plus 5 sigma of the estimate.
TEST(GappedAllanScenario, RandomDropsLeaveTheWhiteNoiseAtEveryTau) {
  constexpr std::uint64_t kSeed = 7;
  auto rate = white(200000, kSeed);
  std::mt19937_64 random(kSeed);
  std::bernoulli_distribution dropped(0.01);
  for (double& y : rate) {
    if (dropped(random)) y = kMissing;
  }
  const auto points = overlapping_allan_with_gaps(rate, kInterval, TauGrid::kOctave);
  EXPECT_GT(points.back().point.tau_s, 500.0);
  EXPECT_EQ(points.front().rule, GapRule::kComplete);
  EXPECT_EQ(points.back().rule, GapRule::kNearlyComplete);
  for (const auto& [p, rule] : points) {
    if (p.degrees_of_freedom < 30) continue;
    EXPECT_NEAR(std::log(p.deviation_radps * std::sqrt(p.tau_s) / 1e-6),
                rule == GapRule::kComplete ? 0.0 : 0.005,
                5.0 / std::sqrt(2.0 * p.degrees_of_freedom))
        << "tau = " << p.tau_s << ", seed " << kSeed;
  }
}

// The step of a bias that changes during the outage is in no difference shorter than it.
TEST(GappedAllanScenario, AnOutageIsNotBridgedByTausShorterThanIt) {
  auto rate = white(120000, 8);
  for (std::size_t i = 50000; i < 60000; ++i) rate[i] = kMissing;
  for (std::size_t i = 60000; i < rate.size(); ++i) rate[i] += 1.0;  // a million sigma
  const auto points = overlapping_allan_with_gaps(rate, kInterval, TauGrid::kOctave);
  const double outage_s = 100.0;
  for (const auto& [p, rule] : points) {
    if (p.tau_s > outage_s) continue;
    EXPECT_LT(p.deviation_radps, 1e-4) << p.tau_s;
  }
}

TEST(SeriesAnalysisLaws, GapsMeanTheSameToTheCascadeAndToTheKeptSeries) {
  auto rate = white(60000, 9);
  for (std::size_t i = 20000; i < 26000; ++i) rate[i] = kMissing;
  SeriesOptions streamed;
  streamed.most_kept_samples = 0;
  const SeriesReport cascade = analysed(rate, streamed);
  const SeriesReport kept = analysed(rate);
  EXPECT_EQ(cascade.method, SeriesMethod::kCascade);
  EXPECT_EQ(kept.method, SeriesMethod::kFullOverlapWithGaps);
  EXPECT_EQ(cascade.missing, 6000U);
  EXPECT_EQ(kept.missing, 6000U);
  EXPECT_EQ(cascade.interruptions, 1U);
  for (std::size_t i = 0; i < 5; ++i) {  // m = 1 to 16: the same differences
    EXPECT_EQ(cascade.allan[i].point.pairs, kept.allan[i].point.pairs);
    // The cascade's angle is off by less than a step of 2^-40 rad, a sample's noise is 1e-7 rad.
    EXPECT_NEAR(cascade.allan[i].point.deviation_radps / kept.allan[i].point.deviation_radps, 1.0,
                2.0 * 0x1.0p-40 / 1e-7);
  }
}

TEST(SeriesAnalysisLaws, CascadeAndFullOverlapAgreeWithinAFractionOfTheirInterval) {
  const auto rate = white(200000, 10);
  SeriesOptions streamed;
  streamed.grid = TauGrid::kQuarterOctave;
  const SeriesReport kept = analysed(rate, streamed);
  streamed.most_kept_samples = 1000;  // it changes over on the way
  const SeriesReport cascade = analysed(rate, streamed);
  ASSERT_EQ(cascade.method, SeriesMethod::kCascade);
  ASSERT_EQ(cascade.allan.size(), kept.allan.size());
  for (std::size_t i = 0; i < kept.allan.size(); ++i) {
    const AllanPoint& a = kept.allan[i].point;
    const AllanPoint& b = cascade.allan[i].point;
    EXPECT_NEAR(b.tau_s, a.tau_s, 1e-9 * a.tau_s);
    // A sixteenth of the differences keeps 99.5 % of the degrees of freedom, so the two differ by
    // sqrt(0.5 %) = 0.07 of a standard deviation; 5 times that, and the angle's steps.
    const double sigma = 1.0 / std::sqrt(2.0 * a.degrees_of_freedom);
    EXPECT_NEAR(std::log(b.deviation_radps / a.deviation_radps), 0.0,
                0.35 * sigma + 2.0 * 0x1.0p-40 / 1e-7)
        << a.tau_s;
  }
}

TEST(SeriesAnalysisScenario, StatisticsThatCannotBridgeAGapTakeTheLongestStretch) {
  auto rate = white(9000, 11);
  rate[1000] = rate[2500] = kMissing;
  SeriesOptions options;
  options.statistics = {Statistic::kOadev, Statistic::kMdev, Statistic::kTotdev};
  const SeriesReport report = analysed(rate, options);
  EXPECT_FALSE(curve_of(report, Statistic::kOadev).stretch);
  const auto& mdev = curve_of(report, Statistic::kMdev);
  ASSERT_TRUE(mdev.stretch);
  EXPECT_EQ(mdev.stretch->begin, 2501U);
  EXPECT_EQ(mdev.stretch->count, 6499U);
  const SeriesReport of_stretch = analysed({rate.begin() + 2501, rate.end()}, options);
  EXPECT_FALSE(curve_of(of_stretch, Statistic::kMdev).stretch);
  ASSERT_EQ(mdev.points.size(), curve_of(of_stretch, Statistic::kMdev).points.size());
  for (std::size_t i = 0; i < mdev.points.size(); ++i)
    EXPECT_EQ(mdev.points[i].deviation, curve_of(of_stretch, Statistic::kMdev).points[i].deviation);
}

TEST(SeriesAnalysisScenario, ALongSeriesLeavesOutWhatNeedsItWhole) {
  SeriesOptions options;
  options.statistics = {Statistic::kOadev, Statistic::kHdev};
  options.most_kept_samples = 100;
  const SeriesReport report = analysed(white(5000, 12), options);
  ASSERT_EQ(report.left_out.size(), 1U);
  EXPECT_EQ(report.left_out.front(), Statistic::kHdev);
  EXPECT_EQ(report.curves.size(), 1U);
}

TEST(SeriesAnalysisAbuse, NothingIsMissingBeforeTheFirstSampleNorAfterTheLast) {
  auto rate = white(500, 13);
  rate.insert(rate.begin(), 50, kMissing);
  rate.insert(rate.end(), 70, kMissing);
  const SeriesReport report = analysed(rate);
  EXPECT_EQ(report.missing, 0U);
  EXPECT_EQ(report.method, SeriesMethod::kFullOverlap);
  EXPECT_EQ(report.findings.samples, 500U);
}

TEST(SeriesAnalysisAbuse, AnEndlessGapTakesNoMemory) {
  SeriesOptions options;
  options.nominal_interval_s = kInterval;
  options.most_kept_samples = 10000;
  SeriesAnalysis analysis(options);
  for (const double y : white(1000, 14)) analysis.add(y);
  analysis.gap(std::uint64_t{1} << 60);
  for (const double y : white(1000, 15)) analysis.add(y);
  const SeriesReport report = analysis.report(kInterval);
  EXPECT_EQ(report.method, SeriesMethod::kCascade);
  EXPECT_EQ(report.missing, std::uint64_t{1} << 60);
  EXPECT_EQ(report.allan.front().point.pairs, 1998U);
}

TEST(SeriesAnalysisAbuse, EmptyShortAndConstantSeriesGiveReportsWithoutFit) {
  EXPECT_TRUE(analysed({}).allan.empty());
  EXPECT_TRUE(analysed({1.0}).allan.empty());
  EXPECT_EQ(analysed({1.0, 2.0}).allan.size(), 1U);
  const SeriesReport constant = analysed(std::vector<double>(1000, 2.0));
  EXPECT_TRUE(constant.findings.is_constant);
  EXPECT_EQ(constant.coefficients.status, FitStatus::kTooFewPoints);
}

// ---------------------------------------------------------------------------- other statistics

// How often the interval holds the truth, by statistic, on white noise: 200 records, so 5 sigma of
// a share of 0.95 is 0.077.
TEST(DeviationCurveScenario, IntervalsHoldTheTruthAsOftenAsStated) {
  for (const Statistic statistic : {Statistic::kAdev, Statistic::kOadev, Statistic::kHdev,
                                    Statistic::kOhdev, Statistic::kTotdev}) {
    int held = 0;
    for (std::uint64_t seed = 100; seed < 300; ++seed) {
      const auto angle = angle_from_rate(white(640, seed), kInterval);
      const auto curve = deviation_curve(statistic, angle, kInterval, TauGrid::kOctave);
      const CurvePoint& p = curve[6];  // m = 64, a tenth of the record
      const double truth = 1e-6 / std::sqrt(p.tau_s);
      if (p.lower <= truth && truth <= p.upper) ++held;
    }
    EXPECT_NEAR(held / 200.0, 0.95, 0.077) << name(statistic);
  }
}

// Of white noise the modified deviation is below the Allan deviation by sqrt((m² + 1) / (2 m²)), SP
// 1065 table 3; the time deviation is it times tau / sqrt(3).
TEST(DeviationCurveScenario, ModifiedAndTimeDeviationHaveIntervalsAroundTheirOwnTruth) {
  int held = 0;
  for (std::uint64_t seed = 300; seed < 500; ++seed) {
    const auto angle = angle_from_rate(white(640, seed), kInterval);
    const CurvePoint m = deviation_curve(Statistic::kMdev, angle, kInterval, TauGrid::kOctave)[5];
    const CurvePoint t = deviation_curve(Statistic::kTdev, angle, kInterval, TauGrid::kOctave)[5];
    const double truth = 1e-6 / std::sqrt(m.tau_s) * std::sqrt(0.5 + 0.5 / (32.0 * 32.0));
    if (m.lower <= truth && truth <= m.upper) ++held;
    EXPECT_DOUBLE_EQ(t.deviation, m.deviation * m.tau_s / std::sqrt(3.0));
    EXPECT_NEAR(t.upper / t.deviation, m.upper / m.deviation, 1e-12);
  }
  EXPECT_NEAR(held / 200.0, 0.95, 0.077);
}

}  // namespace
}  // namespace zerodrift::allan
