// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <limits>
#include <stdexcept>

#include "common/regression/schemes/initial_set.h"
#include "common/regression/schemes/no_scheme.h"
#include "common/regression/schemes/persistence.h"
#include "tests/unit/regression/schemes/drift_records.h"

namespace zerodrift::regression::testing {
namespace {

constexpr Features kAny{0.0, 0.0};

DriftLabel label_of(double time_s, double drift, double variance = 1e-6) {
  return {
      .time_s = time_s, .duration_s = 1.0, .features = kAny, .drift = drift, .variance = variance};
}

TEST(NoSchemeLaws, PredictsZeroWithTheMeanSquareOfTheLabelsLessTheirNoise) {
  NoScheme none;
  EXPECT_LT(none.predict(0.0, kAny).variance, 0.0);
  none.learn(label_of(1.0, 3.0, 0.5));
  none.learn(label_of(2.0, -1.0, 1.5));
  EXPECT_EQ(none.predict(3.0, kAny).drift, 0.0);
  EXPECT_DOUBLE_EQ(none.predict(3.0, kAny).variance, (9.0 - 0.5 + 1.0 - 1.5) / 2.0);
}

TEST(NoSchemeLaws, LabelsBelowTheirOwnNoiseGiveNoNegativeVariance) {
  NoScheme none;
  none.learn(label_of(1.0, 0.1, 1.0));
  EXPECT_EQ(none.predict(2.0, kAny).variance, 0.0);
}

TEST(PersistenceLaws, HoldsTheMeanOfTheLastMinuteByHand) {
  Persistence persistence;
  EXPECT_EQ(persistence.predict(0.0, kAny).drift, 0.0);
  persistence.learn(label_of(10.0, 100.0));  // 60 s before the newest: begins before the minute
  persistence.learn(label_of(10.5, 1.0));
  persistence.learn(label_of(40.0, 2.0));
  persistence.learn(label_of(70.0, 6.0));
  EXPECT_DOUBLE_EQ(persistence.predict(71.0, kAny).drift, 3.0);
  EXPECT_DOUBLE_EQ(persistence.predict(1e6, kAny).drift, 3.0);
  EXPECT_LT(persistence.predict(71.0, kAny).variance, 0.0);
  persistence.learn(label_of(1000.0, 7.0));  // after a gap it stands alone
  EXPECT_DOUBLE_EQ(persistence.predict(1001.0, kAny).drift, 7.0);
}

TEST(PersistenceAbuse, MoreLabelsInAMinuteThanItKeepsGiveTheMeanOfTheNewest) {
  Persistence persistence;
  const auto count = 2 * Persistence::kMostLabels;
  for (std::size_t i = 0; i < count; ++i) {
    persistence.learn(label_of(1e-3 * static_cast<double>(i), i < count / 2 ? 5.0 : 2.0));
  }
  EXPECT_DOUBLE_EQ(persistence.predict(10.0, kAny).drift, 2.0);
}

TEST(PersistenceAbuse, ImpossibleWindowsAreRefused) {
  EXPECT_THROW(Persistence({.window_s = 0.0}), std::invalid_argument);
  EXPECT_THROW(Persistence({.window_s = std::numeric_limits<double>::quiet_NaN()}),
               std::invalid_argument);
}

TEST(InitialSetLaws, IsCompleteByNumberOrByTime) {
  InitialSet by_number({.labels = 3});
  EXPECT_FALSE(by_number.add(label_of(1.0, 1.0)));
  EXPECT_FALSE(by_number.add(label_of(2.0, 2.0)));
  EXPECT_TRUE(by_number.add(label_of(3.0, 6.0)));
  EXPECT_DOUBLE_EQ(by_number.mean(), 3.0);
  EXPECT_DOUBLE_EQ(by_number.scale(), std::sqrt(14.0 / 3.0));

  InitialSet by_time({.labels = 100, .until_s = 5.0});
  EXPECT_FALSE(by_time.add(label_of(4.9, 1.0)));
  EXPECT_TRUE(by_time.add(label_of(7.0, 1.0)));
  EXPECT_EQ(by_time.size(), 2u);
  EXPECT_EQ(by_time.scale(), 1.0);  // no spread to divide by
}

TEST(InitialSetAbuse, WhatCannotBeLearnedIsKnown) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr Features kBad{0.0, kNan};
  EXPECT_TRUE(is_learnable(label_of(1.0, 1.0)));
  EXPECT_FALSE(is_learnable(label_of(kNan, 1.0)));
  EXPECT_FALSE(is_learnable(label_of(1.0, kNan)));
  EXPECT_FALSE(is_learnable(label_of(1.0, 1.0, 0.0)));
  DriftLabel label = label_of(1.0, 1.0);
  label.features = kBad;
  EXPECT_FALSE(is_learnable(label));
  label.features = {};
  EXPECT_FALSE(is_learnable(label));
}

}  // namespace
}  // namespace zerodrift::regression::testing
