// SPDX-License-Identifier: Apache-2.0
// Records that others measured, where they are at hand: figures from their README files.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "common/core/units.h"
#include "common/record/record_reader.h"

namespace zerodrift::record {
namespace {

std::filesystem::path shared(const std::string& file) {
  return std::filesystem::path{ZERODRIFT_SHARED_DIR} / "data" / file;
}

struct Totals {
  std::uint64_t rows = 0;
  core::SensorTime first{0};
  core::SensorTime last{0};
  core::PerAxis<double> rate_sum_radps{};
  double coldest_degc = 1e9;
  double hottest_degc = -1e9;
};

Totals read_all(RecordReader& reader) {
  Totals totals;
  while (const RecordRow* row = reader.next()) {
    if (totals.rows++ == 0) totals.first = row->time;
    totals.last = row->time;
    for (std::size_t i = 0; i < core::kAxisCount; ++i)
      totals.rate_sum_radps[i] += row->rate_radps[i];
    for (const double temperature_degc : row->temperature_degc) {
      totals.coldest_degc = std::min(totals.coldest_degc, temperature_degc);
      totals.hottest_degc = std::max(totals.hottest_degc, temperature_degc);
    }
  }
  return totals;
}

#define SKIP_WITHOUT(file) \
  if (!std::filesystem::exists(file)) GTEST_SKIP() << (file) << " is not there"

TEST(RealRecords, ThermalChamberRunReadsInFull) {
  const auto file = shared("imu_thermal_chamber/imu_thermal.csv");
  SKIP_WITHOUT(file);
  RecordReader reader{
      file,
      {.columns = parse_column_map(
           "time=row*1.0,rate_x=gyro_x[rad/s],rate_y=gyro_y[rad/s],rate_z=gyro_z[rad/s],"
           "temperature_coil=temp_c[degC]")}};
  EXPECT_EQ(reader.info().sample_period_s, 1.0);
  EXPECT_EQ(reader.info().extra_columns.size(), 5U);
  const Totals totals = read_all(reader);
  EXPECT_EQ(totals.rows, 8400U);
  EXPECT_EQ(totals.last, std::chrono::seconds{8399});
  EXPECT_NEAR(totals.coldest_degc, -17.6, 0.05);  // the README gives one decimal
  EXPECT_NEAR(totals.hottest_degc, 74.0, 0.05);
}

TEST(RealRecords, PublishedStampsAreNanoseconds) {
  const auto file = shared("imu_thermal_chamber/imu_thermal.csv");
  SKIP_WITHOUT(file);
  RecordReader reader{
      file, {.columns = parse_column_map("time=stamp_ns_as_published[ns],rate_x=gyro_x[rad/s]")}};
  const RecordRow* row = reader.next();
  ASSERT_NE(row, nullptr);
  EXPECT_EQ(row->time, core::SensorTime{256'551'281'491'968});
  EXPECT_NEAR(reader.info().sample_period_s, 0.506e-3, 1e-5);  // "step 0.506 ms"
}

TEST(RealRecords, SatelliteVacuumRunReadsInFull) {
  const auto file = shared("cubesat_tvac_gyro/tvac_gyro_20200307.csv");
  SKIP_WITHOUT(file);
  RecordReader reader{
      file,
      {.columns = parse_column_map(
           "rate_x=gyro_x_rad_s[rad/s],rate_y=gyro_y_rad_s[rad/s],rate_z=gyro_z_rad_s[rad/s],"
           "temperature_board=temp_c[degC],magnetic_x=mag_x_t[T]")}};
  const Totals totals = read_all(reader);
  EXPECT_GE(totals.rows, 6249U);
  EXPECT_EQ(totals.first, core::SensorTime{15'352'000'000});
  EXPECT_EQ(totals.last, core::SensorTime{7'339'962'000'000});
  EXPECT_NEAR(reader.info().sample_period_s, 0.02, 0.002);  // "about 50 Hz"
}

TEST(RealRecords, ChamberThermocouplesReadWithTimeFromElapsedSeconds) {
  const auto file = shared("cubesat_tvac_gyro/chamber_thermocouples_20200307.csv");
  SKIP_WITHOUT(file);
  RecordReader reader{
      file,
      {.columns = parse_column_map("time=elapsed_s[s],temperature_case=c1_satellite_degC[degC]")}};
  const RecordRow* row = reader.next();
  ASSERT_NE(row, nullptr);
  EXPECT_EQ(row->temperature_degc[0], 21.5);
  EXPECT_EQ(read_all(reader).coldest_degc, 8.8);
  EXPECT_EQ(reader.info().sample_period_s, 300.0);
}

TEST(RealRecords, StaticMillionRowsOfCountsReadThroughXz) {
  const auto file = shared("adis16405_static/adis16405_run1.csv.xz");
  SKIP_WITHOUT(file);
  RecordReader reader{file,
                      {.columns = parse_column_map(
                           "time=row*0.01,rate_x=gx_lsb*0.05[deg/s],rate_y=gy_lsb*0.05[deg/s],"
                           "rate_z=gz_lsb*0.05[deg/s]")}};
  const RecordRow* row = reader.next();
  ASSERT_NE(row, nullptr);
  EXPECT_EQ(row->rate_radps[1], -6 * (core::kRadPerDeg * 0.05));
  const Totals totals = read_all(reader);
  EXPECT_EQ(totals.rows + 1, 1'000'000U);
  EXPECT_EQ(totals.last, core::SensorTime{9'999'990'000'000});
  EXPECT_EQ(reader.info().sample_period_s, 0.01);
}

}  // namespace
}  // namespace zerodrift::record
