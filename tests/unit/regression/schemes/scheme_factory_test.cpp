// SPDX-License-Identifier: Apache-2.0
// What holds for every scheme.
#include "common/regression/schemes/scheme_factory.h"

#include <gtest/gtest.h>

#include <set>
#include <stdexcept>
#include <string>

#include "tests/unit/regression/schemes/drift_records.h"

namespace zerodrift::regression::testing {
namespace {

constexpr std::uint64_t kSeed = 9;

class EveryScheme : public ::testing::TestWithParam<Baseline> {
 protected:
  static SchemeOptions quick() {
    SchemeOptions options;
    options.rbf.initial.labels = options.svr.initial.labels = options.krls_t.initial.labels = 200;
    return options;
  }
};

TEST_P(EveryScheme, PredictsZeroAndKnowsNothingBeforeTheFirstLabel) {
  const auto scheme = GetParam().make({});
  const DriftPrediction prediction = scheme->predict(1.0, Features{0.1, 0.2});
  EXPECT_EQ(prediction.drift, 0.0);
  EXPECT_LT(prediction.variance, 0.0);
}

TEST_P(EveryScheme, GivesTheSameOutputToTheBitForTheSameInput) {
  const Record record = heat_cool_record(800, 0.001, kSeed);
  const auto first = GetParam().make(quick()), second = GetParam().make(quick());
  const auto a = predict_all(*first, record, 3), b = predict_all(*second, record, 3);
  for (std::size_t i = 0; i < record.size(); ++i) {
    ASSERT_EQ(a[i].drift, b[i].drift);
    ASSERT_EQ(a[i].variance, b[i].variance);
  }
}

TEST_P(EveryScheme, ConstantFeaturesAndLabelsAreHeld) {
  const auto scheme = GetParam().make(quick());
  const Features x{-0.4, 0.0};
  for (int i = 0; i < 1000; ++i) {
    scheme->learn(
        {.time_s = i + 1.0, .duration_s = 1.0, .features = x, .drift = -2e-6, .variance = 1e-14});
  }
  const DriftPrediction prediction = scheme->predict(1001.0, x);
  const double expected = GetParam().name == "none" ? 0.0 : -2e-6;
  EXPECT_NEAR(prediction.drift, expected, 1e-9);  // a hundredth of the labels' deviation, 1e-7
  EXPECT_TRUE(std::isfinite(prediction.variance));
}

TEST_P(EveryScheme, StaysFiniteFarFromAllItHasSeen) {
  const Record record = heat_cool_record(600, 0.0, kSeed);
  const auto scheme = GetParam().make(quick());
  static_cast<void>(predict_all(*scheme, record, 1));
  for (const double far : {-1e3, 1e3}) {
    const DriftPrediction prediction = scheme->predict(601.0, Features{far, far});
    EXPECT_TRUE(std::isfinite(prediction.drift));
    EXPECT_TRUE(std::isfinite(prediction.variance));
  }
}

INSTANTIATE_TEST_SUITE_P(Schemes, EveryScheme, ::testing::ValuesIn(baselines()),
                         [](const auto& parameter) {
                           std::string text(parameter.param.name);
                           std::erase(text, '-');
                           return text;
                         });

TEST(SchemeFactory, NamesAreThoseOfTheTablesAndAllDifferent) {
  std::set<std::string_view> names;
  for (const Baseline& baseline : baselines()) EXPECT_TRUE(names.insert(baseline.name).second);
  EXPECT_EQ(names, (std::set<std::string_view>{"none", "persistence", "polynomial", "rbf", "svr",
                                               "krls-t"}));
}

TEST(SchemeFactory, WrongOptionsAreNamedWithTheirScheme) {
  SchemeOptions options;
  options.krls_t.budget = 0;
  EXPECT_NO_THROW(static_cast<void>(make_scheme("svr", options)));
  try {
    static_cast<void>(make_scheme("krls-t", options));
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_STREQ(error.what(), "krls-t: budget: found 0, expected at least 1");
  }
}

}  // namespace
}  // namespace zerodrift::regression::testing
