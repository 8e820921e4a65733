// SPDX-License-Identifier: Apache-2.0
#include "services/console/telemetry.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/console/samples.h"

namespace zerodrift::services {
namespace {

TEST(Telemetry, SpeaksDegreesPerHour) {
  const auto out = to_telemetry(sample_at(1'500'000'000, 15.0, 2.0));
  // A double's relative rounding is 1e-16; 1e-12 leaves room for a dozen operations.
  EXPECT_NEAR(out.raw_deg_h().x(), 15.0, 15e-12);
  EXPECT_NEAR(out.compensated_deg_h().y(), 13.0, 13e-12);
  EXPECT_NEAR(out.drift_deg_h().z(), 2.0, 2e-12);
  EXPECT_NEAR(out.drift_sigma_deg_h().x(), 0.5, 5e-13);
  EXPECT_EQ(out.timestamp().seconds(), 1);
  EXPECT_EQ(out.timestamp().nanos(), 500'000'000);
  EXPECT_EQ(out.x().mode(), telemetry::LEARNING);
}

TEST(Telemetry, WhatIsNotKnownIsNaN) {
  auto sample = sample_at(0, 1.0, 0.0);
  sample.drift_variance_radps2()[0] = -1.0;
  sample.validity(0b110);
  EXPECT_TRUE(std::isnan(to_telemetry(sample).drift_sigma_deg_h().x()));
  EXPECT_TRUE(std::isnan(to_telemetry(sample).latency_us()));
  EXPECT_TRUE(std::isnan(raw_deg_h(sample, 0)));
  EXPECT_FALSE(std::isnan(raw_deg_h(sample, 1)));
}

TEST(Telemetry, AStampOfAnotherClockGivesNoWallTime) {
  auto sample = sample_at(0, 1.0, 0.0);
  const service::ArrivalClocks arrival{.unix_ns = 1'000'000'000'000,
                                       .monotonic_ns = 500'000'000'000};
  sample.publish_time_ns(arrival.monotonic_ns - 5);
  EXPECT_EQ(publish_unix_ns(sample, arrival), arrival.unix_ns - 5);
  for (const std::int64_t stamp : {std::int64_t{0}, arrival.monotonic_ns + 1,
                                   arrival.monotonic_ns - 61'000'000'000, INT64_MIN, INT64_MAX}) {
    sample.publish_time_ns(stamp);
    EXPECT_EQ(publish_unix_ns(sample, arrival), 0) << stamp;
  }
}

TEST(Telemetry, ATwinReportKeepsItsCandidatesAndTheInputOfEachPoint) {
  msg::TwinReport report;
  report.input("magnetic_y (uT)");
  report.effects().resize(1);
  auto& other = report.effects()[0].alternatives().emplace_back();
  other.name("line");
  other.probability(0.06);
  report.points().resize(2);
  report.points()[1].input(-50.0);
  const auto out = to_telemetry(report);
  EXPECT_EQ(out.input(), "magnetic_y (uT)");
  ASSERT_EQ(out.effects(0).alternatives_size(), 1);
  EXPECT_EQ(out.effects(0).alternatives(0).name(), "line");
  EXPECT_EQ(out.effects(0).alternatives(0).probability(), 0.06);
  ASSERT_EQ(out.input_value_size(), 2);
  EXPECT_EQ(out.input_value(1), -50.0);
}

TEST(Telemetry, OfTheTemperaturesLearnedThoseWithLabelsAreSaid) {
  msg::ThermalCoverage coverage;
  coverage.labels_x()[2 * 36 + 16] = 7;
  coverage.labels_z()[2 * 36 + 16] = 9;
  coverage.labels_y()[0] = 1;
  const auto out = to_telemetry(coverage);
  ASSERT_EQ(out.cells_size(), 2);
  EXPECT_EQ(out.cells(0).from_degc(), -60.0);
  EXPECT_EQ(out.cells(0).rate(), 0U);
  EXPECT_EQ(out.cells(1).from_degc(), 20.0);
  EXPECT_EQ(out.cells(1).rate(), 2U);
  ASSERT_EQ(out.cells(1).labels_size(), 3);
  EXPECT_EQ(out.cells(1).labels(0), 7U);
  EXPECT_EQ(out.cells(1).labels(1), 0U);
  EXPECT_EQ(out.cells(1).labels(2), 9U);
}

TEST(Telemetry, TimeBeforeTheEpochHasNanosecondsFromItsSecondOn) {
  google::protobuf::Timestamp time;
  set_time(time, -1);
  EXPECT_EQ(time.seconds(), -1);
  EXPECT_EQ(time.nanos(), 999'999'999);
}

}  // namespace
}  // namespace zerodrift::services
