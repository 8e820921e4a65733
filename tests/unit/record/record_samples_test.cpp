// SPDX-License-Identifier: Apache-2.0
#include "common/record/record_samples.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <vector>

#include "tests/support/scratch_folder.h"

namespace zerodrift::record {
namespace {

class RecordSamples : public ScratchFolder {};

TEST_F(RecordSamples, AngularRateCarriesValidityPerAxis) {
  RecordReader reader{write("a.csv", "time_s,rate_x_rad_s,rate_z_rad_s\n0,1,2\n0.5,inf,\n")};
  core::AngularRateSample sample = to_angular_rate(*reader.next());
  EXPECT_EQ(sample.sequence, 0U);
  EXPECT_EQ(sample.time, core::SensorTime{0});
  EXPECT_EQ(sample.interval_s, 0.5);
  EXPECT_EQ(sample.rate_radps[0], 1.0);
  EXPECT_EQ(sample.valid, (core::PerAxis<bool>{true, false, true}));
  EXPECT_EQ(sample.clipped, (core::PerAxis<bool>{}));
  EXPECT_EQ(sample.clock, core::ClockSource::kReplay);

  sample = to_angular_rate(*reader.next());
  EXPECT_EQ(sample.sequence, 1U);
  EXPECT_EQ(sample.valid, (core::PerAxis<bool>{}));
  EXPECT_TRUE(std::isinf(sample.rate_radps[0]));
}

// Rule: where a record numbers its rates, a row without a number has none; numbers and intervals go
// from rate to rate. Before: it was an invalid rate, and the next one's interval that since it.
TEST_F(RecordSamples, ARowWithoutANumberWhereRatesAreNumberedBringsNone) {
  RecordReader reader{write("a.csv",
                            "time_s,rate_x_rad_s,temperature_coil_degC,sequence\n"
                            "0,1,20,7\n0.5,2,,8\n0.503,,20.1,\n1,3,,9\n1.5,,,10\n5,4,,17\n")};
  EXPECT_EQ(reader.info().sample_period_s, 0.5);
  EXPECT_TRUE(reader.info().warnings.empty());
  std::vector<std::uint64_t> numbers;
  std::vector<double> intervals_s;
  std::vector<bool> valid;
  while (const RecordRow* row = reader.next()) {
    if (!brings_rate(*row)) {
      EXPECT_EQ(row->temperature_degc[0], 20.1);
      continue;
    }
    const core::AngularRateSample sample = to_angular_rate(*row);
    numbers.push_back(sample.sequence);
    intervals_s.push_back(sample.interval_s);
    valid.push_back(sample.valid[0]);
  }
  EXPECT_EQ(numbers, (std::vector<std::uint64_t>{0, 1, 2, 3, 4}));
  EXPECT_EQ(intervals_s, (std::vector<double>(5, 0.5))) << "a gap is no part of the rate behind it";
  EXPECT_EQ(valid, (std::vector<bool>{true, true, true, false, true}));
}

// Rule: what two tables joined by their times leave blank is no rate that ends the next one's time.
// Before: the rate behind such a row counted for what lay between the two rows.
TEST_F(RecordSamples, ARowWithoutAnyRateTakesNoTimeOfTheNextOne) {
  RecordReader reader{write("a.csv",
                            "time_s,rate_x_rad_s,rate_z_rad_s,temperature_coil_degC\n"
                            "0,1,1,\n0.1,,,20\n0.5,2,,\n0.6,,,20\n1,3,1,\n1.4,,,20\n1.5,4,1,\n"
                            "1.9,,,20\n3,4,1,\n")};
  EXPECT_EQ(reader.info().sample_period_s, 0.5);
  EXPECT_EQ(reader.info().first_interval_s, 0.5);
  std::uint64_t measured = 0;
  while (const RecordRow* row = reader.next()) {
    const core::AngularRateSample sample = to_angular_rate(*row);
    EXPECT_EQ(sample.sequence, row->index);
    EXPECT_EQ(sample.interval_s, 0.5) << core::seconds(row->time);
    if (sample.valid[0]) ++measured;
  }
  EXPECT_EQ(measured, 5U);
}

// Some seconds of such rows may begin a record.
TEST_F(RecordSamples, WhereTheFirstRowsMeasureNoRateTheRowsTellThePeriod) {
  std::string text = "time_s,rate_x_rad_s\n";
  for (int i = 0; i < 200; ++i) text += std::to_string(0.25 * i) + ",\n";
  RecordReader reader{write("a.csv", text + "50,1\n50.25,1\n")};
  EXPECT_EQ(reader.info().sample_period_s, 0.25);
}

TEST_F(RecordSamples, TemperatureOfABlankCellStillMovesTimeForward) {
  RecordReader reader{
      write("a.csv", "time_s,temperature_case_degC,temperature_coil_degC\n0,20,30\n1,21,\n")};
  core::TemperatureSample sample;
  to_temperature(*reader.next(), reader.info(), 1, sample);
  EXPECT_EQ(sample.probe, "coil");
  EXPECT_EQ(sample.temperature_degc, 30.0);
  EXPECT_TRUE(sample.measured);

  to_temperature(*reader.next(), reader.info(), 1, sample);
  EXPECT_EQ(sample.sequence, 1U);
  EXPECT_EQ(sample.time, core::SensorTime{1'000'000'000});
  EXPECT_FALSE(sample.measured);
  EXPECT_EQ(sample.clock, core::ClockSource::kReplay);
}

TEST_F(RecordSamples, EnvironmentIsOfTheColumnsThatThereAre) {
  RecordReader reader{write("a.csv", "time_s,vibration_g,magnetic_y_uT\n0,0.5,-20\n1,,inf\n")};
  auto sample = to_environment(*reader.next(), reader.info());
  ASSERT_TRUE(sample);
  EXPECT_EQ(sample->channels, 1U << 6U | 1U << 1U);
  EXPECT_EQ(sample->values.vibration_g, 0.5);
  EXPECT_EQ(sample->values.magnetic_ut[1], -20.0);
  EXPECT_EQ(sample->clock, core::ClockSource::kReplay);
  sample = to_environment(*reader.next(), reader.info());
  ASSERT_TRUE(sample) << "time went on";
  EXPECT_EQ(sample->sequence, 1U);
  EXPECT_FALSE(core::is_any_measured(sample->values));

  RecordReader without{write("b.csv", "time_s,rate_x_rad_s\n0,0.5\n")};
  EXPECT_FALSE(to_environment(*without.next(), without.info()));
}

// Before: an absent one was a true rate of 0.
TEST_F(RecordSamples, ReferencesOfAnAbsentAxisAndOfABlankCellAreInvalid) {
  RecordReader reader{write("a.csv", "time_s,reference_x_rad_s,reference_y_rad_s\n0,0.5,\n")};
  const auto sample = to_rate_reference(*reader.next(), reader.info(), 1e-12);
  ASSERT_TRUE(sample.has_value());
  EXPECT_EQ(sample->kind, core::ReferenceKind::kRecord);
  EXPECT_EQ(sample->valid, (core::PerAxis<bool>{true, false, false}));
  EXPECT_EQ(sample->rate_radps[0], 0.5);
  EXPECT_EQ(sample->variance[0], 1e-12);
}

TEST_F(RecordSamples, WithoutReferenceColumnsNothingIsKnownOfTheTrueRate) {
  RecordReader reader{write("a.csv", "time_s,rate_x_rad_s\n0,0.5\n")};
  EXPECT_FALSE(to_rate_reference(*reader.next(), reader.info()).has_value());
}

}  // namespace
}  // namespace zerodrift::record
