// SPDX-License-Identifier: Apache-2.0
#include "common/comparison/test_then_train.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "common/regression/interval_calibrator.h"
#include "tests/unit/comparison/test_points.h"

namespace zerodrift::comparison {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

Protocol delayed(double delay_s) {
  return {.name = "delayed", .delay_s = delay_s};
}

Protocol frozen_at(double time_s) {
  const core::SensorTime frozen = core::from_seconds(time_s);
  return {.name = "frozen", .frozen_from = frozen, .judged_from = frozen};
}

std::vector<std::optional<PredictedPoint>> predicted(std::initializer_list<double> drifts,
                                                     double variance = -1.0) {
  std::vector<std::optional<PredictedPoint>> all;
  for (const double drift : drifts) all.push_back(PredictedPoint{drift, variance});
  return all;
}

// ------------------------------------------------------------------------- the age of labels

// Rule: of the points and the protocol alone, the median age is that of the newest label that the
// scheme was told before each judged one.
TEST(TestThenTrainLaws, TheMedianAgeIsThatOfWhatTheSchemeWasTold) {
  for (const double delay_s : {0.0, 5.0, 12.0, 60.0}) {
    for (const auto& missing : {std::vector<std::size_t>{}, {3, 4, 5, 6, 7, 8, 9}, {1, 9, 17}}) {
      const auto points = numbered_points(30, missing);
      SpyScheme spy;
      Protocol protocol = delayed(delay_s);
      protocol.judged_from = core::from_seconds(40.0);
      static_cast<void>(predict_all(protocol, points, 1, spy));
      std::vector<double> ages_s;
      for (const auto& asked : spy.asked()) {
        if (!asked.learned_s.empty() && asked.time_s > 40.0)
          ages_s.push_back(asked.time_s - 5.0 - asked.learned_s.back());
      }
      std::sort(ages_s.begin(), ages_s.end());
      ASSERT_FALSE(ages_s.empty());
      EXPECT_DOUBLE_EQ(median_age_s(protocol, points), ages_s[ages_s.size() / 2]) << delay_s;
    }
  }
  EXPECT_TRUE(std::isnan(median_age_s(delayed(1e6), numbered_points(5))));
}

// ------------------------------------------------------------------------------------- a prior

// Rule: as the service, a scheme on a prior learns what that leaves, and the prior's part at the
// label's own time is added to what it foretells.
TEST(TestThenTrainLaws, OnAPriorTheRestIsLearnedAndThePriorAdded) {
  auto points = numbered_points(4);
  for (std::size_t i = 0; i < points.size(); ++i)
    points[i].prior_radps = 10.0 * static_cast<double>(i);
  SpyScheme spy(0.5);
  const auto made = predict_on_prior(delayed(0.0), points, 1, spy);
  EXPECT_EQ(spy.drifts_learned(), (std::vector<double>{0.0, -9.0, -18.0}));
  EXPECT_FALSE(made[0]);
  for (std::size_t i = 1; i < points.size(); ++i)
    EXPECT_EQ(made[i].value().drift_radps, points[i].prior_radps + 0.5);
}

// ---------------------------------------------------------------------------- nobody sees ahead

// Rule: before a label is predicted, exactly those that ended `delay` before it began, and none
// that ended after the freeze, are learned, in their order. With gaps in the labels as without.
TEST(TestThenTrainLaws, NoSchemeKnowsALabelBeforeItsTime) {
  struct Case {
    Protocol protocol;
    std::vector<std::size_t> missing;
  };
  const std::vector<Case> cases{{delayed(0.0), {}},          {delayed(0.0), {3, 4, 5, 17}},
                                {delayed(12.0), {}},         {delayed(12.0), {3, 4, 5, 17}},
                                {delayed(60.0), {0, 1, 20}}, {delayed(1e4), {}},
                                {frozen_at(100.0), {}},      {frozen_at(102.0), {18, 19, 20}}};
  for (const Case& one : cases) {
    SCOPED_TRACE(one.protocol.name + " " + std::to_string(one.protocol.delay_s));
    const auto points = numbered_points(40, one.missing);
    SpyScheme spy;
    static_cast<void>(predict_all(one.protocol, points, 1, spy));
    ASSERT_EQ(spy.asked().size(), points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
      std::vector<double> allowed;
      for (const auto& point : points) {
        const bool old = core::seconds(points[i].begin - point.end) >= one.protocol.delay_s;
        if (old && point.end <= one.protocol.frozen_from)
          allowed.push_back(core::seconds(point.end));
      }
      EXPECT_EQ(spy.asked()[i].learned_s, allowed) << "label " << i;
      EXPECT_EQ(spy.asked()[i].time_s, core::seconds(points[i].end));
      EXPECT_EQ(spy.asked()[i].feature, points[i].features[0]);
    }
  }
}

TEST(TestThenTrainLaws, OneAheadKnowsTheNeighbourAndDelayedByALabelDoesNot) {
  const auto points = numbered_points(4);
  SpyScheme ahead;
  static_cast<void>(predict_all(delayed(0.0), points, 1, ahead));
  EXPECT_EQ(ahead.asked()[2].learned_s, (std::vector<double>{5.0, 10.0}));
  SpyScheme late;
  static_cast<void>(predict_all(delayed(5.0), points, 1, late));
  EXPECT_EQ(late.asked()[2].learned_s, std::vector<double>{5.0});
  EXPECT_EQ(late.asked()[1].learned_s, std::vector<double>{});
}

TEST(TestThenTrainLaws, ASchemeGetsAsManyFeaturesAsThereAre) {
  SpyScheme spy;
  static_cast<void>(predict_all(delayed(0.0), numbered_points(3), 2, spy));
  for (const auto& features : spy.features_learned()) EXPECT_EQ(features.size(), 2U);
  EXPECT_EQ(spy.features_learned().size(), 2U);
}

// ------------------------------------------------------------------------------- what is judged

TEST(TestThenTrainLaws, JudgedIsWhatEndsLaterThanToldAndNothingBeforeALabelIsKnown) {
  Protocol protocol = delayed(0.0);
  protocol.judged_from = core::from_seconds(15.0);
  SpyScheme spy(7.0);
  const auto judged = predict_all(protocol, numbered_points(5), 1, spy);
  EXPECT_FALSE(judged[2]);  // ends at 15 s
  ASSERT_TRUE(judged[3]);
  EXPECT_EQ(judged[3]->drift_radps, 7.0);

  SpyScheme late(7.0);
  const auto all = predict_all(delayed(10.0), numbered_points(5), 1, late);
  EXPECT_FALSE(all[0]);
  EXPECT_FALSE(all[2]);  // label 0 ended at 5 s, this one begins at 10 s
  EXPECT_TRUE(all[3]);
}

TEST(TestThenTrainLaws, FrozenBeforeTheFirstLabelJudgesNothing) {
  const auto points = numbered_points(10);
  SpyScheme spy;
  const auto judged = predict_all(frozen_at(2.0), points, 1, spy);
  EXPECT_TRUE(spy.learned().empty());
  for (const auto& one : judged) EXPECT_FALSE(one);
}

// ---------------------------------------------------------------------------------- intervals

// Rule: what a scheme said when it knew nothing (0, for a drift of a thousand) does not widen its
// intervals. The spy is off by one from then on: without a variance of its own, its intervals come
// from the mean square of such errors, 1, less the label's variance, 1; at least a thousandth of
// it.
TEST(TestThenTrainLaws, ErrorsMadeInIgnoranceDoNotCalibrate) {
  auto points = numbered_points(20);
  for (auto& point : points) point.drift_radps = 1000.0;
  class Later final : public regression::DriftScheme {
   public:
    void learn(const regression::DriftLabel& label) override { held_ = label.drift; }
    [[nodiscard]] regression::DriftPrediction predict(double /*time_s*/,
                                                      std::span<const double>) const override {
      return {held_ > 0.0 ? held_ + 1.0 : 0.0, -1.0};
    }

   private:
    double held_ = 0.0;
  } scheme;
  const auto judged = predict_all(delayed(0.0), points, 1, scheme);
  ASSERT_TRUE(judged.back());
  EXPECT_GE(judged.back()->variance, 0.0);
  EXPECT_LT(judged.back()->variance, 1.0);
}

TEST(TestThenTrainLaws, ErrorsBeforeCalibratedFromLeaveTheVarianceAsStated) {
  Protocol protocol = delayed(0.0);
  protocol.calibrated_from = core::from_seconds(1e6);
  SpyScheme unknowing(3.0, -1.0);
  EXPECT_EQ(predict_all(protocol, numbered_points(50), 1, unknowing).back()->variance, -1.0);
  SpyScheme stating(3.0, 0.25);
  EXPECT_EQ(predict_all(protocol, numbered_points(50), 1, stating).back()->variance, 0.25);
}

// Rule: what goes out with the service's samples is judged as it went out. Errors of 3 and more
// beside a stated 0.1 would widen it fortyfold were it calibrated, as the same numbers of a scheme
// for comparison are.
TEST(TestThenTrainLaws, WhatIsSentOutIsJudgedAsItIs) {
  const regression::DriftPrediction stated{.drift = -3.0, .variance = 0.01};
  regression::DriftPrediction sent_out = stated;
  sent_out.is_sent_out = true;
  SpyScheme of_the_service(sent_out);
  for (const auto& one : predict_all(delayed(0.0), numbered_points(50), 1, of_the_service)) {
    EXPECT_TRUE(!one || one->variance == 0.01);
  }
  SpyScheme for_comparison(stated);
  const auto calibrated = predict_all(delayed(0.0), numbered_points(50), 1, for_comparison);
  EXPECT_GT(calibrated.back()->variance, 0.01);
}

// ----------------------------------------------------------------------------------- statistics

// Residuals 3, -1, 1, 5 of drifts 0, 1, 2, 3; by hand.
TEST(ResidualStatisticsLaws, OfFourPoints) {
  const auto points = numbered_points(4);
  const auto s = residual_statistics(points, predicted({-3.0, 2.0, 1.0, -2.0}));
  EXPECT_EQ(s.points, 4U);
  EXPECT_DOUBLE_EQ(s.mean, 2.0);
  EXPECT_DOUBLE_EQ(s.standard_deviation, std::sqrt(5.0));  // (1 + 9 + 1 + 9) / 4
  EXPECT_DOUBLE_EQ(s.mean_absolute, 2.5);
  EXPECT_DOUBLE_EQ(s.root_mean_square, 3.0);  // 36 / 4
  EXPECT_TRUE(std::isnan(s.coverage));
}

TEST(ResidualStatisticsLaws, PointsThatWereNotJudgedDoNotCount) {
  const auto points = numbered_points(4);
  auto said = predicted({-1e9, 0.0, 1.0, 1e9});
  said.front().reset();
  said.back().reset();
  const auto s = residual_statistics(points, said);
  EXPECT_EQ(s.points, 2U);
  EXPECT_DOUBLE_EQ(s.mean, 1.0);
  EXPECT_DOUBLE_EQ(s.standard_deviation, 0.0);
}

// Rule: covered is what lies within 1.96 sqrt(stated + label variance). Label variance 1, stated 3:
// within 3.92.
TEST(ResidualStatisticsLaws, CoverageTakesTheLabelsOwnVarianceIn) {
  const auto points = numbered_points(4);
  auto said = predicted({0.0 - 3.91, 1.0 + 3.91, 2.0 + 3.93, 3.0}, 3.0);
  EXPECT_DOUBLE_EQ(residual_statistics(points, said).coverage, 0.75);
  said[3]->variance = -1.0;  // unknown: neither held nor missed
  EXPECT_DOUBLE_EQ(residual_statistics(points, said).coverage, 2.0 / 3.0);
}

// Rule: the deviation does not drown in a large mean. Residuals 1e6 and 1e6 + 1e-3; the spacing of
// doubles there is 1.2e-10, and the textbook difference of squares would leave nothing.
TEST(ResidualStatisticsLaws, ASmallSpreadAboutALargeMeanKeepsItsDigits) {
  auto points = numbered_points(2);
  points[0].drift_radps = 1e6;
  points[1].drift_radps = 1e6 + 1e-3;
  const auto s = residual_statistics(points, predicted({0.0, 0.0}));
  EXPECT_NEAR(s.standard_deviation, 0.5e-3, 2.4e-10);
}

TEST(ResidualStatisticsAbuse, NothingJudgedGivesNoNumberAndNoZero) {
  const auto points = numbered_points(3);
  const auto s = residual_statistics(points, std::vector<std::optional<PredictedPoint>>(3));
  EXPECT_EQ(s.points, 0U);
  for (const double value : {s.mean, s.standard_deviation, s.mean_absolute, s.root_mean_square})
    EXPECT_TRUE(std::isnan(value));
}

TEST(ResidualStatisticsAbuse, APredictionThatIsNoNumberSpoilsTheFiguresVisibly) {
  const auto points = numbered_points(3);
  const auto s = residual_statistics(points, predicted({0.0, kNaN, 0.0}));
  EXPECT_EQ(s.points, 3U);
  EXPECT_TRUE(std::isnan(s.root_mean_square));
}

// ------------------------------------------------------------------------------------- last leg

std::vector<LabelledPoint> with_temperatures(const std::vector<double>& temperatures) {
  auto points = numbered_points(temperatures.size());
  for (std::size_t i = 0; i < points.size(); ++i) points[i].features[1] = temperatures[i];
  return points;
}

double last_leg_s(const std::vector<double>& temperatures, double least_turn = 0.0) {
  return core::seconds(begin_of_last_leg(with_temperatures(temperatures), 1, least_turn));
}

// Straight lines between corners {number of the label, temperature}.
std::vector<double> polyline(const std::vector<std::pair<std::size_t, double>>& corners) {
  std::vector<double> temperatures{corners.front().second};
  for (std::size_t c = 1; c < corners.size(); ++c) {
    const auto& [from, low] = corners[c - 1];
    const auto& [to, high] = corners[c];
    for (std::size_t i = from + 1; i <= to; ++i) {
      const double share = static_cast<double>(i - from) / static_cast<double>(to - from);
      temperatures.push_back(std::lerp(low, high, share));
    }
  }
  return temperatures;
}

TEST(LastLegScenario, AMonotoneRecordIsCutAtTwoThirds) {
  EXPECT_DOUBLE_EQ(last_leg_s(polyline({{0, 0.0}, {299, 6.0}})), 5.0 * 201);
  EXPECT_DOUBLE_EQ(last_leg_s(std::vector<double>(300, 2.0)), 5.0 * 201);
}

TEST(LastLegScenario, ATriangleIsCutAtItsCorner) {
  EXPECT_DOUBLE_EQ(last_leg_s(polyline({{0, 0.0}, {120, 5.0}, {299, -1.0}})), 5.0 * 121);
  EXPECT_DOUBLE_EQ(last_leg_s(polyline({{0, 0.0}, {120, -5.0}, {299, 1.0}})), 5.0 * 121);
}

// Cool, heat, cool, with a sensor's noise: the chamber record's shape. The noise is a thousandth of
// the range, the corner is found within the time that the slope takes to leave the noise.
TEST(LastLegScenario, OfACycleTheLastTurnCounts) {
  auto temperatures = polyline({{0, 5.2}, {2700, -1.8}, {6200, 7.4}, {8399, 3.4}});
  for (std::size_t i = 0; i < temperatures.size(); ++i)
    temperatures[i] += 0.005 * std::sin(static_cast<double>(i * i));
  EXPECT_NEAR(last_leg_s(temperatures), 5.0 * 6201, 5.0 * 6);
}

TEST(LastLegScenario, ATurnTooNearTheEndOrTooSmallIsNone) {
  EXPECT_DOUBLE_EQ(last_leg_s(polyline({{0, 0.0}, {285, 6.0}, {299, 4.0}})),
                   5.0 * 201);  // 5 % left
  EXPECT_DOUBLE_EQ(last_leg_s(polyline({{0, 0.0}, {150, 6.0}, {299, 5.8}})),
                   5.0 * 201);  // 3 % of range
  EXPECT_DOUBLE_EQ(last_leg_s(polyline({{0, 0.0}, {15, -6.0}, {299, 4.0}})),
                   5.0 * 201);  // 5 % before
}

// A temperature held but for its sensor's noise turns all the time, by nothing.
TEST(LastLegScenario, NoiseOnAHeldTemperatureIsNoTurn) {
  std::vector<double> temperatures;
  for (int i = 0; i < 300; ++i) temperatures.push_back(0.002 * (i % 7) - 0.003 * (i % 3));
  EXPECT_DOUBLE_EQ(last_leg_s(temperatures, 0.1), 5.0 * 201);
}

TEST(LastLegAbuse, OneAndTwoLabelsHaveALastLeg) {
  EXPECT_DOUBLE_EQ(last_leg_s({1.0}), 5.0);
  EXPECT_DOUBLE_EQ(last_leg_s({1.0, 2.0}), 10.0);
}

}  // namespace
}  // namespace zerodrift::comparison
