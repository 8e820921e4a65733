// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/measured_series.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>
#include <vector>

namespace zerodrift::diagnosis {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

MeasuredRow row_of(double time_s, double rate, std::span<const double> temperatures) {
  MeasuredRow row;
  row.time_s = time_s;
  row.rate_radps = {rate, kNone, kNone};
  row.reference_radps = {kNone, kNone, kNone};
  row.temperature_degc = temperatures;
  row.magnetic_ut = {kNone, kNone, kNone};
  row.acceleration_mps2 = {kNone, kNone, kNone};
  row.vibration_g = row.source_current_ma = row.supply_v = kNone;
  return row;
}

TEST(MeasuredSeriesLaws, AFastRecordIsItsBlockMeansWithTheirVariance) {
  SeriesBuilder builder({.sample_period_s = 0.001});
  for (int i = 0; i < 10'000; ++i) builder.add(row_of(1e-3 * i, i % 2 == 0 ? 3.0 : 5.0, {}));
  const MeasuredSeries series = builder.finish();
  ASSERT_EQ(series.size, 10U);
  EXPECT_EQ(series.interval_s, 1.0);
  EXPECT_EQ(series.missing_samples, 0U);
  for (std::size_t i = 0; i < series.size; ++i) {
    EXPECT_EQ(series.rate_radps[0][i], 4.0);
    EXPECT_NEAR(series.sample_variance[0][i], 1000.0 / 999.0, 1e-12);
  }
  EXPECT_TRUE(series.rate_radps[1].empty());
  EXPECT_TRUE(series.vibration_g.empty());
}

TEST(MeasuredSeriesLaws, ASlowRecordKeepsItsOwnGridWhateverTheStampsJitter) {
  SeriesBuilder builder({.sample_period_s = 10.0});
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> jitter(-2.0, 2.0);
  for (int i = 0; i < 500; ++i)
    builder.add(row_of(100.0 + 10.0 * i + (i == 0 ? 0.0 : jitter(random)), i, {}));
  const MeasuredSeries series = builder.finish();
  ASSERT_EQ(series.size, 500U);
  for (std::size_t i = 0; i < series.size; ++i)
    EXPECT_EQ(series.rate_radps[0][i], static_cast<double>(i));
}

TEST(MeasuredSeriesLaws, AParabolaOfTemperatureAndItsRateComeBackExactly) {
  SeriesBuilder builder({.probes = {"coil"}});
  const auto temperature = [](double t) { return 20.0 + 0.03 * t - 2e-5 * t * t; };
  for (int i = 0; i < 1000; ++i) {
    const double reading = i % 3 == 0 ? temperature(i) : kNone;  // slower than the gyro
    builder.add(row_of(i, 0.0, std::span(&reading, 1)));
  }
  const MeasuredSeries series = builder.finish();
  ASSERT_EQ(series.probes.size(), 1U);
  for (std::size_t i = 0; i < series.size; ++i) {
    const auto t = static_cast<double>(i);
    EXPECT_NEAR(series.probes[0].temperature_degc[i], temperature(t), 1e-9);
    EXPECT_NEAR(series.probes[0].rate_degc_per_s[i], 0.03 - 4e-5 * t, 1e-10);
  }
}

TEST(MeasuredSeriesScenario, AnOutageIsNotValidAndItsInputsAreBridged) {
  SeriesBuilder builder({.probes = {"coil"}});
  for (int i = 0; i < 2000; ++i) {
    if (i >= 700 && i < 1300) continue;
    const double reading = 0.01 * i;
    builder.add(row_of(i, 1.0, std::span(&reading, 1)));
  }
  const MeasuredSeries series = builder.finish();
  EXPECT_EQ(series.missing_samples, 600U);
  EXPECT_EQ(series.valid[0][699], 1);
  EXPECT_EQ(series.valid[0][700], 0);
  EXPECT_EQ(series.valid[0][1299], 0);
  EXPECT_EQ(series.valid[0][1300], 1);
  EXPECT_NEAR(series.probes[0].temperature_degc[1000], 10.0, 1e-6);
}

TEST(MeasuredSeriesScenario, TheSupplyTellsWhenTheGyroWasSwitchedOn) {
  SeriesBuilder builder({});
  for (int i = 0; i < 100; ++i) {
    MeasuredRow row = row_of(i, 1.0, {});
    row.supply_v = i < 10 || (i >= 50 && i < 60) ? 0.0 : 5.0;
    builder.add(row);
  }
  const MeasuredSeries series = builder.finish();
  EXPECT_EQ(series.valid[0][9], 0);
  EXPECT_EQ(series.since_power_on_s[10], 1.0);
  EXPECT_EQ(series.since_power_on_s[49], 40.0);
  EXPECT_EQ(series.valid[0][55], 0);
  EXPECT_EQ(series.since_power_on_s[60], 1.0);
}

TEST(MeasuredSeriesScenario, ALongRecordGetsACoarserGridAndLosesNoSample) {
  SeriesBuilder builder({.longest = 64});
  for (int i = 0; i < 1000; ++i) builder.add(row_of(i, i % 16, {}));
  const MeasuredSeries series = builder.finish();
  EXPECT_EQ(series.interval_s, 16.0);
  ASSERT_EQ(series.size, 63U);
  EXPECT_EQ(series.rate_radps[0][5], 7.5);  // mean of 0 to 15
}

TEST(MeasuredSeriesAbuse, WhatIsNotFiniteIsNotMeasured) {
  SeriesBuilder builder({.probes = {"coil"}});
  for (int i = 0; i < 100; ++i) {
    const double reading = i == 40 ? std::numeric_limits<double>::infinity() : 20.0;
    builder.add(row_of(i, i == 50 ? kNone : 2.0, std::span(&reading, 1)));
  }
  const MeasuredSeries series = builder.finish();
  EXPECT_EQ(series.valid[0][50], 0);
  EXPECT_EQ(series.valid[0][51], 1);
  EXPECT_NEAR(series.probes[0].temperature_degc[40], 20.0, 1e-12);
}

TEST(MeasuredSeriesAbuse, WithoutAnyRateThereIsNothingToDiagnose) {
  SeriesBuilder empty({});
  EXPECT_THROW(static_cast<void>(empty.finish()), std::invalid_argument);
  SeriesBuilder blank({});
  for (int i = 0; i < 10; ++i) blank.add(row_of(i, kNone, {}));
  EXPECT_THROW(static_cast<void>(blank.finish()), std::invalid_argument);
}

TEST(MeasuredSeriesAbuse, WrongOptionsAreNamed) {
  EXPECT_NE(SeriesOptions{.sample_period_s = 0.0}.validate()->find("sample_period_s"),
            std::string::npos);
  EXPECT_NE(SeriesOptions{.longest = 1}.validate()->find("longest"), std::string::npos);
  EXPECT_THROW(SeriesBuilder({.grid_interval_s = kNone}), std::invalid_argument);
}

}  // namespace
}  // namespace zerodrift::diagnosis
