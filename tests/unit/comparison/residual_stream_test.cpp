// SPDX-License-Identifier: Apache-2.0
#include "common/comparison/residual_stream.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/allan/deviations.h"
#include "common/twin/random.h"
#include "tests/unit/comparison/test_points.h"

namespace zerodrift::comparison {
namespace {

constexpr double kIntervalS = 0.5;
constexpr std::size_t kSamplesALabel = 10;

std::vector<double> noise(std::size_t count) {
  const twin::NoiseStream stream(7, "rate");
  std::vector<double> samples;
  for (std::size_t i = 0; i < count; ++i) samples.push_back(1e-6 * stream.gaussian(i));
  return samples;
}

std::vector<std::optional<PredictedPoint>> all_predicted(std::size_t count, double drift) {
  return std::vector<std::optional<PredictedPoint>>(count, PredictedPoint{drift, -1.0});
}

StreamReport report_of(const std::vector<double>& samples,
                       const std::vector<std::optional<PredictedPoint>>& predicted) {
  ResidualStream stream(kIntervalS, predicted);
  for (std::size_t i = 0; i < samples.size(); ++i) stream.add(i / kSamplesALabel, samples[i], 0);
  return stream.report();
}

// The rolling statistic rounds angles to 2^-40 rad; a second difference of four such, over tau.
constexpr double kAngleRounding = 4.0 * 0x1p-40;

// Rule: nothing taken off leaves the stream's own overlapping Allan deviation: to the bit that of
// the rolling statistic fed with the samples themselves, and up to 16 samples, where that skips no
// term, that of the batch formula.
TEST(ResidualStreamLaws, APredictionOfZeroLeavesTheRawAllanDeviation) {
  const auto samples = noise(4000);
  const auto report = report_of(samples, all_predicted(400, 0.0));
  allan::RollingAllan raw(
      {.sample_interval_s = kIntervalS, .grid = allan::TauGrid::kQuarterOctave, .panes = 1});
  for (const double sample : samples) raw.add(sample);
  const auto expected = raw.points(allan::Span::kSinceStart);
  const auto angle = allan::angle_from_rate(samples, kIntervalS);
  ASSERT_EQ(report.allan.size(), expected.size());
  ASSERT_GT(report.allan.size(), 20U);
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const auto& point = report.allan[i];
    EXPECT_EQ(point.tau_s, expected[i].tau_s);
    EXPECT_EQ(point.deviation_radps, expected[i].deviation_radps);
    const auto cluster = static_cast<std::size_t>(std::llround(point.tau_s / kIntervalS));
    if (cluster > 16) continue;
    const auto batch = allan::deviation(allan::Statistic::kOadev, angle, kIntervalS, cluster);
    EXPECT_NEAR(point.deviation_radps, batch.value().deviation, kAngleRounding / point.tau_s);
  }
}

// Rule: what was predicted exactly leaves nothing.
TEST(ResidualStreamLaws, APerfectPredictionLeavesNothing) {
  std::vector<double> samples;
  std::vector<std::optional<PredictedPoint>> predicted;
  for (std::size_t label = 0; label < 400; ++label) {
    const double drift = 1e-6 * std::sin(0.1 * static_cast<double>(label));
    predicted.push_back(PredictedPoint{drift, -1.0});
    samples.insert(samples.end(), kSamplesALabel, drift);
  }
  const auto report = report_of(samples, predicted);
  EXPECT_EQ(report.minute_means.blocks, 33U);  // 2000 s in minutes
  EXPECT_EQ(report.minute_means.standard_deviation, 0.0);
  for (const auto& point : report.allan) EXPECT_EQ(point.deviation_radps, 0.0) << point.tau_s;
}

// Rule: samples outside the judged labels are a gap: as if they had never been measured, but the
// time passes.
TEST(ResidualStreamLaws, WhatIsNotJudgedIsAGap) {
  const auto samples = noise(4000);
  auto predicted = all_predicted(400, 0.0);
  for (std::size_t label = 100; label < 150; ++label) predicted[label].reset();
  const auto unjudged = report_of(samples, predicted);

  ResidualStream gone(kIntervalS, all_predicted(400, 0.0));
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (i >= 1000 && i < 1500) continue;
    gone.add(i / kSamplesALabel, samples[i], i == 1500 ? 500 : 0);
  }
  const auto missing = gone.report();
  ASSERT_EQ(unjudged.allan.size(), missing.allan.size());
  for (std::size_t i = 0; i < missing.allan.size(); ++i)
    EXPECT_EQ(unjudged.allan[i].deviation_radps, missing.allan[i].deviation_radps);
  EXPECT_EQ(unjudged.minute_means.blocks, missing.minute_means.blocks);
  // 33 whole minutes less those that the gap from 500 s to 750 s touches: the 9th to the 13th.
  EXPECT_EQ(unjudged.minute_means.blocks, 33U - 5U);
}

// Rule: no second difference reaches across a gap. A step within the gap shows nowhere.
TEST(ResidualStreamLaws, AStepWithinAGapIsNotSeenByTheAllanDeviation) {
  std::vector<double> samples(2000, 1e-6);
  samples.resize(4000, 5e-6);
  auto predicted = all_predicted(400, 0.0);
  for (std::size_t label = 195; label < 205; ++label) predicted[label].reset();
  for (const auto& point : report_of(samples, predicted).allan)
    EXPECT_LE(point.deviation_radps, kAngleRounding / point.tau_s) << point.tau_s;
}

// Bursts shorter than a minute: short clusters only, and no minute at all.
TEST(ResidualStreamScenario, BurstsGiveShortClustersAndNoMinutes) {
  const auto samples = noise(400);
  ResidualStream stream(kIntervalS, all_predicted(40, 0.0));
  for (std::size_t i = 0; i < samples.size(); ++i)
    stream.add(i / kSamplesALabel, samples[i], i % kSamplesALabel == 0 ? 600 : 0);
  const auto report = stream.report();
  EXPECT_EQ(report.minute_means.blocks, 0U);
  ASSERT_FALSE(report.allan.empty());
  EXPECT_LE(report.allan.back().tau_s, 0.5 * kIntervalS * kSamplesALabel);
}

TEST(ResidualStreamAbuse, NothingJudgedGivesNoCurveAndNoCoefficients) {
  const auto report = report_of(noise(400), std::vector<std::optional<PredictedPoint>>(40));
  EXPECT_TRUE(report.allan.empty());
  EXPECT_EQ(report.minute_means.blocks, 0U);
  EXPECT_EQ(report.coefficients[allan::NoiseTerm::kAngleRandomWalk].identification,
            allan::Identification::kNotFitted);
}

TEST(ResidualStreamAbuse, ARecordSlowerThanAMinuteHasMinutesOfOneSample) {
  ResidualStream stream(120.0, all_predicted(50, 0.0));
  for (std::size_t i = 0; i < 50; ++i) stream.add(i, i % 2 == 0 ? 1.0 : -1.0, 0);
  EXPECT_EQ(stream.report().minute_means.blocks, 50U);
}

// ---------------------------------------------------------------------------------- point finder

core::SensorTime at(double seconds) {
  return core::from_seconds(seconds);
}

TEST(PointFinderLaws, BeginIsOutsideAndEndIsInside) {
  const auto points = numbered_points(3, {1});  // 0 to 5 s and 10 to 15 s
  PointFinder finder(points);
  EXPECT_EQ(finder.find(at(0.0)), std::nullopt);
  EXPECT_EQ(finder.find(at(1e-9)), 0U);
  EXPECT_EQ(finder.find(at(5.0)), 0U);
  EXPECT_EQ(finder.find(at(5.0) + core::SensorTime{1}), std::nullopt);
  EXPECT_EQ(finder.find(at(10.0)), std::nullopt);
  EXPECT_EQ(finder.find(at(10.0) + core::SensorTime{1}), 1U);
  EXPECT_EQ(finder.find(at(15.0)), 1U);
  EXPECT_EQ(finder.find(at(15.0) + core::SensorTime{1}), std::nullopt);
  EXPECT_EQ(finder.find(at(1e6)), std::nullopt);
}

TEST(PointFinderLaws, OfTwoLabelsThatTouchTheBorderBelongsToTheFirst) {
  const auto points = numbered_points(2);
  PointFinder finder(points);
  EXPECT_EQ(finder.find(at(5.0)), 0U);
  EXPECT_EQ(finder.find(at(5.0) + core::SensorTime{1}), 1U);
}

TEST(PointFinderAbuse, WithoutLabelsNothingIsFound) {
  PointFinder finder({});
  EXPECT_EQ(finder.find(at(1.0)), std::nullopt);
}

}  // namespace
}  // namespace zerodrift::comparison
