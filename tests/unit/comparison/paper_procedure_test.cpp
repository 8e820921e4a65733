// SPDX-License-Identifier: Apache-2.0
#include "common/comparison/paper_procedure.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "common/comparison/compared_scheme.h"
#include "common/core/units.h"
#include "tests/unit/comparison/test_points.h"

namespace zerodrift::comparison {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kIntervalS = 1.2;

std::vector<double> ramp(std::size_t count, double from, double step) {
  std::vector<double> values;
  for (std::size_t i = 0; i < count; ++i) values.push_back(from + step * static_cast<double>(i));
  return values;
}

// Features: T / 10 °C; (T - T before) / interval in °C/min; the rate before in deg/h.
TEST(PaperPointsLaws, FeaturesAreTemperatureItsRateAndThePointBefore) {
  const double deg_h = core::kRadPerSecPerDegPerHour;
  const auto points = paper_points(std::vector<double>{3.0 * deg_h, 5.0 * deg_h, 4.0 * deg_h},
                                   std::vector<double>{20.0, 20.6, 20.3}, kIntervalS, 2.5e-19);
  ASSERT_EQ(points.size(), 2U);  // the first point has none before it
  EXPECT_DOUBLE_EQ(points[0].features[0], 2.06);
  EXPECT_NEAR(points[0].features[1], 30.0, 1e-12);  // 0.6 °C in 1.2 s; 20.6 is no double
  EXPECT_NEAR(points[0].features[2], 3.0, 1e-15 * 10);
  EXPECT_NEAR(points[1].features[1], -15.0, 1e-12);
  EXPECT_NEAR(points[1].features[2], 5.0, 1e-15 * 10);
  EXPECT_EQ(points[1].drift_radps, 4.0 * deg_h);
  EXPECT_EQ(points[1].variance, 2.5e-19);
  EXPECT_EQ(points[0].begin, core::from_seconds(1.2));
  EXPECT_EQ(points[0].end, core::from_seconds(2.4));
  EXPECT_EQ(points[1].begin, points[0].end);
}

TEST(PaperPointsAbuse, TheSeriesEndsAtTheFirstValueThatIsNoNumber) {
  auto rate = ramp(100, 0.0, 1e-8);
  auto temperature = ramp(100, 20.0, 0.01);
  rate[40] = kNaN;
  EXPECT_EQ(paper_points(rate, temperature, kIntervalS, 1.0).size(), 39U);
  temperature[30] = kNaN;
  EXPECT_EQ(paper_points(rate, temperature, kIntervalS, 1.0).size(), 29U);
  temperature[0] = kNaN;
  EXPECT_TRUE(paper_points(rate, temperature, kIntervalS, 1.0).empty());
  EXPECT_TRUE(paper_points({}, {}, kIntervalS, 1.0).empty());
}

// Rule: an online scheme has learned all points before the one it predicts, and no other.
TEST(PaperResidualsLaws, AnOnlineSchemePredictsEveryPointBeforeItLearnsIt) {
  const auto points = paper_points(ramp(120, 0.0, 1e-8), ramp(120, 20.0, 0.01), kIntervalS, 1.0);
  SpyScheme spy;
  const auto residuals = paper_residuals("online-svr", points, spy);
  EXPECT_EQ(residuals.size(), points.size() - kPaperInitialPoints);
  ASSERT_EQ(spy.asked().size(), points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    ASSERT_EQ(spy.asked()[i].learned_s.size(), i);
    if (i == 0) continue;
    ASSERT_EQ(spy.asked()[i].learned_s.back(), core::seconds(points[i - 1].end));
  }
}

// Rule: rbf and svr learn every 25th point, all of them before the first prediction, no more after.
TEST(PaperResidualsLaws, ABatchSchemeIsTrainedOnTheStrideAndThenLeftAlone) {
  const auto points = paper_points(ramp(121, 0.0, 1e-8), ramp(121, 20.0, 0.01), kIntervalS, 1.0);
  ASSERT_EQ(points.size(), 120U);
  for (const auto* name : {"rbf", "svr"}) {
    SpyScheme spy;
    static_cast<void>(paper_residuals(name, points, spy));
    std::vector<double> stride;
    for (const std::size_t i : {0U, 25U, 50U, 75U, 100U})
      stride.push_back(core::seconds(points[i].end));
    for (const auto& asked : spy.asked()) ASSERT_EQ(asked.learned_s, stride) << name;
    EXPECT_EQ(spy.learned(), stride);
  }
}

TEST(PaperResidualsLaws, ResidualIsPointLessPrediction) {
  const auto points = paper_points(ramp(80, 0.0, 1.0), ramp(80, 20.0, 0.01), kIntervalS, 1.0);
  SpyScheme spy(10.0);
  const auto residuals = paper_residuals("online-svr", points, spy);
  ASSERT_EQ(residuals.size(), 29U);
  EXPECT_DOUBLE_EQ(residuals.front(), 51.0 - 10.0);
  EXPECT_DOUBLE_EQ(residuals.back(), 79.0 - 10.0);
}

TEST(PaperResidualsLaws, JustRbfAndSvrAreTrainedInABatch) {
  for (const auto name : kSchemeNames)
    EXPECT_EQ(is_batch_trained(name), name == "rbf" || name == "svr") << name;
}

// The paper's own ratios, as its tables print them: 51.6, 8.7 and 2.9.
TEST(PaperFiguresGolden, TheTablesGiveThePapersRatios) {
  const auto printed = paper_figures();
  const auto& before = printed.front();
  const auto& after = printed.back();
  ASSERT_EQ(before.scheme, "none");
  ASSERT_EQ(after.scheme, "online-svr");
  EXPECT_NEAR(before.standard_deviation_deg_h / after.standard_deviation_deg_h, 51.6, 0.05);
  EXPECT_NEAR(before.bias_instability_deg_h / after.bias_instability_deg_h, 8.7, 0.05);
  EXPECT_NEAR(before.rate_random_walk_deg_h_rth / after.rate_random_walk_deg_h_rth, 2.9, 0.05);
  for (const auto& figures : printed) {
    EXPECT_NE(std::find(kSchemeNames.begin(), kSchemeNames.end(), figures.scheme),
              kSchemeNames.end());
    EXPECT_EQ(std::isnan(figures.seconds_a_point), figures.scheme == "none");
  }
}

}  // namespace
}  // namespace zerodrift::comparison
