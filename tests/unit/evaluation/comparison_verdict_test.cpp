// SPDX-License-Identifier: Apache-2.0
#include "common/evaluation/comparison_verdict.h"

#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

namespace zerodrift::evaluation {
namespace {

using core::from_seconds;

// Two schemes on one axis over `span_s` of labels, the stack's RMSE `ratio` of holding's a minute
// late.
ComparisonResult judged(double span_s, double ratio, const std::string& held = "persistence") {
  ComparisonResult result;
  AxisComparison axis;
  for (double end_s = 5.0; end_s <= span_s; end_s += 5.0)
    axis.points.push_back({from_seconds(end_s - 5.0), from_seconds(end_s)});
  ProtocolOutcome late{
      .protocol = {.name = "delayed 60 s", .delay_s = 60.0}, .schemes = {}, .raw = {}};
  for (const auto& [name, rms] : {std::pair{held, 1.0}, std::pair{std::string("stack"), ratio}}) {
    SchemeOutcome scheme;
    scheme.name = name;
    scheme.statistics.root_mean_square = rms;
    late.schemes.push_back(scheme);
  }
  axis.protocols.push_back(late);
  result.axes.push_back(axis);
  return result;
}

ComparisonResult with_scheme(ComparisonResult result, const std::string& name, double rms) {
  SchemeOutcome scheme;
  scheme.name = name;
  scheme.statistics.root_mean_square = rms;
  result.axes.front().protocols.front().schemes.push_back(scheme);
  return result;
}

TEST(Advice, IsTheSchemeThatGainsWithItsFigure) {
  const std::string advice = recommendation(judged(600.0, 0.49));
  EXPECT_TRUE(advice.starts_with("Use stack: with labels 60 s late its RMSE is 0.49 of that of "))
      << advice;
}

// Stops of two labels every two minutes: who waits for labels a minute late has those of the stop
// before. Before: "60 s late", an age at which nothing was judged.
TEST(Advice, SaysHowOldLabelsAreBehindMotion) {
  ComparisonResult result = judged(600.0, 0.49);
  std::erase_if(result.axes.front().points, [](const comparison::LabelledPoint& point) {
    return point.begin % from_seconds(120.0) >= from_seconds(10.0);
  });
  const std::string advice = recommendation(result);
  EXPECT_TRUE(advice.starts_with("Use stack: with labels 60 s late (115 s old behind motion) its "))
      << advice;
}

// Rule: only what the service can be configured to run is recommended.
TEST(Advice, IsTheServicesBestWhereNothingGains) {
  const std::string advice = recommendation(judged(600.0, 0.97));
  EXPECT_TRUE(
      advice.starts_with("Use stack: with late labels none that the service runs gains 5 % "
                         "over holding the last minute on this record"))
      << advice;
  EXPECT_EQ(advice.find("doesn't run"), std::string::npos) << advice;
  EXPECT_NE(recommendation(judged(600.0, 2.0)).find("persistence, which the service doesn't run"),
            std::string::npos);
}

// Before: "Use cubic", which no service can.
TEST(Advice, NamesABetterSchemeThatTheServiceDoesNotRunBehindTheOneToUse) {
  const auto result = with_scheme(judged(600.0, 0.49), "cubic", 0.3);
  const std::string advice = recommendation(result);
  EXPECT_TRUE(advice.starts_with("Use stack: ")) << advice;
  EXPECT_NE(advice.find("; cubic, which the service doesn't run, has 0.30 of it over all these "
                        "ages, stack 0.49."),
            std::string::npos)
      << advice;
  EXPECT_EQ(recommendation_of(result)->scheme, "stack");
  EXPECT_EQ(recommendation_of(result)->better, "cubic");
}

TEST(Advice, IsNoneWithoutASchemeThatTheServiceRuns) {
  auto result = with_scheme(judged(600.0, 0.49), "cubic", 0.3);
  auto& schemes = result.axes.front().protocols.front().schemes;
  schemes.erase(schemes.begin() + 1);
  EXPECT_FALSE(recommendation_of(result));
  EXPECT_EQ(recommendation(result),
            "No scheme is recommended: none that the service runs (online-svr, stack, none) is "
            "among --schemes.");
}

// A delay that leaves no label to judge has no protocol. Before: "not comparable without
// persistence", which was compared.
TEST(Advice, SaysThatARecordIsTooShortForADelayThatLeavesNothingToJudge) {
  auto result = judged(600.0, 0.49);
  result.axes.front().protocols.front().protocol = {.name = "one ahead"};
  result.delays_s = {20000.0};
  EXPECT_EQ(recommendation(result),
            "No scheme is recommended: the record is too short, its judged labels span less than 3 "
            "times 20000 s.");
}

TEST(Advice, IsNoneOfARecordThatIsTooShortForItsDelays) {
  EXPECT_TRUE(recommendation_of(judged(180.0, 0.49)));
  EXPECT_FALSE(recommendation_of(judged(175.0, 0.49)));
  EXPECT_NE(recommendation(judged(175.0, 0.49)).find("too short"), std::string::npos);
}

TEST(Advice, IsNoneWhereNobodyHolds) {
  EXPECT_FALSE(recommendation_of(judged(600.0, 0.49, "trend")));
  EXPECT_NE(recommendation(judged(600.0, 0.49, "trend")).find("not comparable"), std::string::npos);
}

// Four stops, a minute of motion before each; only the first label after it counts.
TEST(Advice, SaysWhatMotionLeaves) {
  ComparisonResult result = judged(600.0, 0.49);
  AxisComparison& axis = result.axes.front();
  axis.points.clear();
  ProtocolOutcome ahead = axis.protocols.front();
  ahead.protocol = {.name = "one ahead"};
  for (int stop = 0; stop < 8; ++stop) {
    for (int i = 0; i < 2; ++i) {
      const double begin_s = 120.0 * stop + 5.0 * i;
      axis.points.push_back({from_seconds(begin_s), from_seconds(begin_s + 5.0), 1.0});
      ahead.schemes[0].predicted.push_back(comparison::PredictedPoint{i == 0 ? 0.0 : 1.0});
      ahead.schemes[1].predicted.push_back(comparison::PredictedPoint{i == 0 ? 0.75 : -9.0});
    }
  }
  axis.protocols.insert(axis.protocols.begin(), ahead);
  EXPECT_NE(recommendation(result).find("at the first label after motion 0.25"), std::string::npos)
      << recommendation(result);
}

}  // namespace
}  // namespace zerodrift::evaluation
