// SPDX-License-Identifier: Apache-2.0
#include "services/console/history.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/core/mode.h"
#include "common/core/samples.h"
#include "tests/unit/console/samples.h"

namespace zerodrift::services {
namespace {

constexpr std::int64_t kS = 1'000'000'000;
// Rows are kept in single precision: 2^-24 of the value, twice for the conversion to rad/s and
// back.
constexpr double kSingle = 2.4e-7;

void add_second(GyroHistory& history, std::int64_t second, double raw_deg_h) {
  for (int k = 0; k < 4; ++k) history.add(sample_at(second * kS + k * kS / 4, raw_deg_h + k, 2.0));
}

TEST(HistoryLaws, ARowIsLeastMeanAndGreatestOfItsSecond) {
  GyroHistory history(1);
  add_second(history, 10, 100.0);
  EXPECT_EQ(history.rows(), 0U);  // not complete
  add_second(history, 11, 0.0);
  const auto rows = history.take_new();
  ASSERT_TRUE(rows);
  EXPECT_FALSE(rows->is_backlog());
  ASSERT_EQ(rows->sensor_time_ns_size(), 1);
  EXPECT_EQ(rows->sensor_time_ns(0), 10 * kS);
  ASSERT_EQ(rows->axes_size(), 3);
  for (const auto& axis : rows->axes()) {
    EXPECT_NEAR(axis.raw_min_deg_h(0), 100.0, 100.0 * kSingle);
    EXPECT_NEAR(axis.raw_mean_deg_h(0), 101.5, 101.5 * kSingle);
    EXPECT_NEAR(axis.raw_max_deg_h(0), 103.0, 103.0 * kSingle);
    EXPECT_NEAR(axis.compensated_min_deg_h(0), 98.0, 98.0 * kSingle);
    EXPECT_NEAR(axis.compensated_mean_deg_h(0), 99.5, 99.5 * kSingle);
    EXPECT_NEAR(axis.compensated_max_deg_h(0), 101.0, 101.0 * kSingle);
    EXPECT_NEAR(axis.drift_mean_deg_h(0), 2.0, 2.0 * kSingle);
    EXPECT_NEAR(axis.drift_sigma_deg_h(0), 0.5, 0.5 * kSingle);
    EXPECT_TRUE(std::isnan(axis.reference_mean_deg_h(0)));
    EXPECT_EQ(axis.mode(), std::string("\x01"));
  }
  EXPECT_FALSE(history.take_new());
}

TEST(HistoryLaws, WhatIsTakenInPiecesIsTheBacklog) {
  GyroHistory history(1);
  telemetry::History pieces;
  for (int second = -3; second < 50; ++second) {
    add_second(history, second, second);
    if (second % 7 != 0) continue;
    if (const auto rows = history.take_new()) pieces.MergeFrom(*rows);
  }
  if (const auto rows = history.take_new()) pieces.MergeFrom(*rows);
  const telemetry::History backlog = history.backlog();
  EXPECT_TRUE(backlog.is_backlog());
  ASSERT_EQ(pieces.sensor_time_ns_size(), backlog.sensor_time_ns_size());
  EXPECT_EQ(backlog.sensor_time_ns(0), -3 * kS);  // seconds before zero are seconds too
  for (int i = 0; i < backlog.sensor_time_ns_size(); ++i)
    EXPECT_EQ(pieces.sensor_time_ns(i), backlog.sensor_time_ns(i));
}

TEST(HistoryLaws, HoldsNoMoreThanItsSpanHoweverLongItRuns) {
  GyroHistory history(1, {.kept_s = 100});
  for (int second = 0; second < 1000; ++second) {
    add_second(history, second, 1.0);
    ASSERT_LE(history.rows(), 100U);
  }
  EXPECT_EQ(history.rows(), 100U);
  EXPECT_EQ(history.backlog().sensor_time_ns(0), 899 * kS);
  // Behind a gap longer than the span nothing old is left.
  add_second(history, 5000, 1.0);
  add_second(history, 5001, 1.0);
  EXPECT_EQ(history.rows(), 1U);
  // What nobody took and is no more is not given out twice or at all.
  const auto rows = history.take_new();
  ASSERT_TRUE(rows);
  EXPECT_EQ(rows->sensor_time_ns_size(), 1);
}

TEST(HistoryLaws, ALateSampleChangesNothingAndANewBeginStartsAnew) {
  GyroHistory history(1);
  for (int second = 100; second < 110; ++second) add_second(history, second, 1.0);
  history.forget_new();
  history.add(sample_at(50 * kS, 1e6, 0.0));  // one alone
  auto late = sample_at(50 * kS, 1e6, 0.0);
  late.order(1);
  for (int k = 0; k < 10; ++k) history.add(late);  // said to be late
  EXPECT_EQ(history.rows(), 9U);
  EXPECT_EQ(history.left_out(), 11U);
  for (int second = 0; second < 3; ++second) add_second(history, second, 5.0);
  const auto anew = history.take_new();
  ASSERT_TRUE(anew);
  EXPECT_TRUE(anew->is_backlog());
  EXPECT_EQ(anew->sensor_time_ns(0), 0);
  EXPECT_EQ(anew->sensor_time_ns_size(), 2);
}

// Before: a stamp of tomorrow opened that second, and the next samples "began anew": hours were
// gone.
TEST(HistoryAbuse, ATimeThatIsDoubtedMovesNothing) {
  GyroHistory history(1);
  for (int second = 100; second < 110; ++second) add_second(history, second, 1.0);
  auto ahead = sample_at((110 + 86400) * kS, 1.0, 0.0);
  ahead.order(1);
  history.add(ahead);
  for (int second = 110; second < 120; ++second) add_second(history, second, 1.0);
  EXPECT_EQ(history.rows(), 19U);
  EXPECT_EQ(history.left_out(), 1U);
}

TEST(HistoryLaws, AnAxisWithoutValidSamplesIsNaN) {
  GyroHistory history(1);
  for (int second = 0; second < 2; ++second) {
    auto sample = sample_at(second * kS, 1.0, 0.0);
    sample.validity(0b101);
    sample.rate_radps()[2] = std::numeric_limits<double>::quiet_NaN();
    history.add(sample);
  }
  const auto rows = history.take_new();
  EXPECT_NEAR(rows->axes(0).raw_mean_deg_h(0), 1.0, kSingle);
  for (const int axis : {1, 2}) {
    EXPECT_TRUE(std::isnan(rows->axes(axis).raw_min_deg_h(0)));
    EXPECT_TRUE(std::isnan(rows->axes(axis).raw_mean_deg_h(0)));
    EXPECT_TRUE(std::isnan(rows->axes(axis).drift_sigma_deg_h(0)));
  }
}

TEST(HistoryLaws, ReferencesBelongToTheirSecondThoughTheyComeEarly) {
  GyroHistory history(1);
  for (int second = 0; second < 20; ++second) {
    msg::RateReference reference;
    reference.kind(static_cast<std::uint32_t>(core::ReferenceKind::kRecord));
    reference.sensor_time_ns(second * kS + kS / 2);
    reference.validity(1);
    reference.rate_radps().fill(core::radps_from_deg_h(second));
    history.add(reference);
  }
  for (int second = 0; second < 20; ++second) add_second(history, second, 0.0);
  const auto rows = history.take_new();
  ASSERT_EQ(rows->sensor_time_ns_size(), 19);
  for (int i = 0; i < 19; ++i) {
    EXPECT_NEAR(rows->axes(0).reference_mean_deg_h(i), i, i * kSingle);
    EXPECT_TRUE(std::isnan(rows->axes(1).reference_mean_deg_h(i)));
  }
}

TEST(HistoryLaws, AReadingHoldsForAMinuteAndNeverBeforeItsTime) {
  GyroHistory history(1, {.most_probes = 1});
  history.add("coil", {5 * kS, 21.0, 0.1});
  history.add("another", {5 * kS, 99.0, 0.0});  // beyond most_probes
  for (int second = 0; second < 80; ++second) add_second(history, second, 0.0);
  const auto rows = history.take_new();
  ASSERT_EQ(rows->probes_size(), 1);
  const auto& probe = rows->probes(0);
  EXPECT_EQ(probe.probe(), "coil");
  EXPECT_TRUE(std::isnan(probe.temperature_degc(4)));
  EXPECT_EQ(probe.temperature_degc(5), 21.0);
  EXPECT_EQ(probe.temperature_degc(65), 21.0);
  EXPECT_TRUE(std::isnan(probe.temperature_degc(66)));
  EXPECT_NEAR(probe.rate_degc_per_min(30), 0.1, kSingle);
}

TEST(HistoryLaws, AFiltersResidualIsNoTrueRate) {
  GyroHistory history(1);
  for (const auto kind : {core::ReferenceKind::kNone, core::ReferenceKind::kNavigationResidual}) {
    msg::RateReference reference;
    reference.kind(static_cast<std::uint32_t>(kind));
    reference.validity(0b111);
    history.add(reference);
  }
  for (int second = 0; second < 2; ++second) add_second(history, second, 0.0);
  EXPECT_TRUE(std::isnan(history.take_new()->axes(0).reference_mean_deg_h(0)));
}

// Rule: a replay's temperatures run ahead of its samples, and each row has its own all the same.
TEST(HistoryLaws, ReadingsFarAheadAreNotLost) {
  constexpr int kAhead = 1000;
  GyroHistory history(1);
  for (int second = 0; second < kAhead; ++second)
    history.add("coil", {second * kS, 0.01 * second, 0.0});
  for (int second = 0; second <= kAhead; ++second) add_second(history, second, 0.0);
  const auto rows = history.take_new();
  for (int second = 0; second < kAhead; ++second)
    ASSERT_NEAR(rows->probes(0).temperature_degc(second), 0.01 * second, kAhead * kSingle);
}

// Ten minutes, of which the fifth turns steadily; one sample in a second says so, of one axis.
TEST(HistoryLaws, AMinuteInWhichAnAxisIsSaidToMoveIsComparedOfNone) {
  for (const auto reason :
       {core::Reason::kMotion, core::Reason::kSettling, core::Reason::kLevelImplausible}) {
    GyroHistory history(1);
    for (int second = 0; second <= 600; ++second) {
      const bool turns = second / 60 == 4;
      const double drift = 0.1 * (second / 60);
      for (int k = 0; k < 4; ++k) {
        auto sample = sample_at(second * kS + k * kS / 4, drift + (turns ? 3600.0 : 0.0), drift);
        sample.reason()[1] = turns && k == 2 ? static_cast<std::uint8_t>(reason) : 0;
        for (std::size_t i = 0; i < 3; ++i)
          sample.rate_radps()[i] += core::radps_from_deg_h(0.01 * drift);
        history.add(sample);
      }
    }
    for (std::size_t axis = 0; axis < 3; ++axis) {
      EXPECT_EQ(history.comparison(axis, false).blocks(), 9U) << core::name(reason);
      EXPECT_LT(history.comparison(axis, false).raw_deg_h(), 1.0);
    }
  }
}

}  // namespace
}  // namespace zerodrift::services
