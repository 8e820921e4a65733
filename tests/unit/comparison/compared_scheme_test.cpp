// SPDX-License-Identifier: Apache-2.0
#include "common/comparison/compared_scheme.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "common/comparison/test_then_train.h"
#include "tests/unit/comparison/test_points.h"

namespace zerodrift::comparison {
namespace {

const regression::InitialSetOptions kInitial{.labels = 30};

std::string refusal(std::string_view name, const compensation::CompensationOptions& options) {
  try {
    static_cast<void>(make_compared_scheme(name, options, kInitial));
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return {};
}

// A drift of 1e-6 rad/s for each unit of temperature, which turns at label 100; labels good to
// 1e-9.
std::vector<LabelledPoint> triangle() {
  auto points = numbered_points(200);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double temperature = 0.02 * static_cast<double>(i < 100 ? i : 200 - i);
    points[i].features = {temperature, i < 100 ? 0.24 : -0.24};
    points[i].drift_radps = 1e-6 * temperature;
    points[i].variance = 1e-18;
  }
  return points;
}

TEST(ComparedScheme, EveryNameMakesASchemeThatLearnsAndPredictsFiniteNumbers) {
  const auto points = triangle();
  for (const auto name : kSchemeNames) {
    SCOPED_TRACE(name);
    const auto scheme = make_compared_scheme(name, {}, kInitial);
    const auto predicted = predict_all({.name = "one ahead"}, points, 2, *scheme);
    for (std::size_t i = 1; i < points.size(); ++i) {
      ASSERT_TRUE(predicted[i]) << i;
      ASSERT_TRUE(std::isfinite(predicted[i]->drift_radps)) << i;
      ASSERT_FALSE(std::isnan(predicted[i]->variance)) << i;
    }
  }
}

// Knowing nothing, every scheme says 0 with unknown variance.
TEST(ComparedScheme, ANewSchemeKnowsNothing) {
  const std::vector<double> features{0.3, 0.1};
  for (const auto name : kSchemeNames) {
    const auto made = make_compared_scheme(name, {}, kInitial)->predict(5.0, features);
    EXPECT_EQ(made.drift, 0.0) << name;
    EXPECT_LT(made.variance, 0.0) << name;
  }
}

// Rule: a batch scheme does not change once its initial set is complete, an online one does.
TEST(ComparedScheme, TheBatchSchemesStayAsTrainedAndTheOthersGoOnLearning) {
  const auto points = triangle();
  for (const auto name : kSchemeNames) {
    if (name == "none") continue;
    SCOPED_TRACE(name);
    const auto scheme = make_compared_scheme(name, {}, kInitial);
    const auto learn = [&](std::size_t i, double off) {
      scheme->observe(core::seconds(points[i].end), {points[i].features.data(), 2});
      scheme->learn({.time_s = core::seconds(points[i].end),
                     .duration_s = 5.0,
                     .features = {points[i].features.data(), 2},
                     .drift = points[i].drift_radps + off,
                     .variance = points[i].variance});
    };
    const auto said = [&] {
      return scheme->predict(1000.0, std::span(points[20].features.data(), 2)).drift;
    };
    for (std::size_t i = 0; i < kInitial.labels; ++i) learn(i, 0.0);
    const double trained = said();
    for (std::size_t i = kInitial.labels; i < 60; ++i) learn(i, 1e-6);
    const bool batch = name == "rbf" || name == "svr";
    EXPECT_EQ(said() == trained, batch);
  }
}

// The line is linear in its features: the compensation's own learner must find it, and its mirror
// image behind the turn, far better than holding does a minute late.
TEST(ComparedSchemeScenario, OnlineSvrFollowsALineThatHoldingLagsBehind) {
  const auto points = triangle();
  const auto rms = [&](std::string_view name) {
    const auto scheme = make_compared_scheme(name, {}, kInitial);
    const Protocol protocol{
        .name = "delayed", .delay_s = 60.0, .judged_from = core::from_seconds(500.0)};
    const auto predicted = predict_all(protocol, points, 2, *scheme);
    return residual_statistics(points, predicted).root_mean_square;
  };
  EXPECT_LT(rms("online-svr"), rms("persistence"));
}

TEST(ComparedSchemeAbuse, AnUnknownNameIsRefusedInOneLineThatListsTheKnownOnes) {
  const std::string line = refusal("magic", {});
  EXPECT_NE(line.find("'magic'"), std::string::npos) << line;
  for (const auto name : kSchemeNames) EXPECT_NE(line.find(name), std::string::npos) << line;
  EXPECT_EQ(line.find('\n'), std::string::npos);
}

TEST(ComparedSchemeAbuse, ASchemeOfTemperatureWithoutItsFeaturesIsRefusedInOneLine) {
  compensation::CompensationOptions options;
  options.features = {{.kind = thermal::FeatureKind::kTemperature, .probe = "coil"}};
  const std::string line = refusal("polynomial", options);
  EXPECT_NE(line.find("polynomial"), std::string::npos) << line;
  EXPECT_NE(line.find("temperature_rate"), std::string::npos) << line;
  EXPECT_EQ(line.find('\n'), std::string::npos);
  for (const auto name : kSchemeNames) {
    const bool is_of_temperature = name == "polynomial" || name == "linear" || name == "cubic" ||
                                   name == "lagged" || name == "shupe";
    EXPECT_EQ(refusal(name, options).empty(), !is_of_temperature) << name;
  }
}

// The polynomial finds its features by kind, wherever they stand.
TEST(ComparedScheme, ThePolynomialTakesItsFeaturesByKind) {
  compensation::CompensationOptions options;
  std::reverse(options.features.begin(), options.features.end());
  auto turned = triangle();
  for (auto& point : turned) std::swap(point.features[0], point.features[1]);
  const auto straight =
      predict_all({}, triangle(), 2, *make_compared_scheme("polynomial", {}, kInitial));
  const auto reversed =
      predict_all({}, turned, 2, *make_compared_scheme("polynomial", options, kInitial));
  for (std::size_t i = 1; i < turned.size(); ++i)
    ASSERT_EQ(straight[i]->drift_radps, reversed[i]->drift_radps) << i;
}

}  // namespace
}  // namespace zerodrift::comparison
