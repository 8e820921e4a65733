// SPDX-License-Identifier: Apache-2.0
#include "common/record/record_samples.h"

#include <gtest/gtest.h>

#include <cmath>

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

TEST_F(RecordSamples, ReferenceOfAnAbsentAxisIsZeroAndOfABlankCellInvalid) {
  RecordReader reader{write("a.csv", "time_s,reference_x_rad_s,reference_y_rad_s\n0,0.5,\n")};
  const auto sample = to_rate_reference(*reader.next(), reader.info(), 1e-12);
  ASSERT_TRUE(sample.has_value());
  EXPECT_EQ(sample->kind, core::ReferenceKind::kRecord);
  EXPECT_EQ(sample->valid, (core::PerAxis<bool>{true, false, true}));
  EXPECT_EQ(sample->rate_radps[0], 0.5);
  EXPECT_EQ(sample->rate_radps[2], 0.0);
  EXPECT_EQ(sample->variance[2], 1e-12);
}

TEST_F(RecordSamples, WithoutReferenceColumnsNothingIsKnownOfTheTrueRate) {
  RecordReader reader{write("a.csv", "time_s,rate_x_rad_s\n0,0.5\n")};
  EXPECT_FALSE(to_rate_reference(*reader.next(), reader.info()).has_value());
}

}  // namespace
}  // namespace zerodrift::record
