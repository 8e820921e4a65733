// SPDX-License-Identifier: Apache-2.0
// A real record, as it was published, through the live system.
#include <gtest/gtest.h>

#include "tests/system/files.h"
#include "tests/system/pipeline.h"

namespace zerodrift::system_test {
namespace {

// Its README infers the row period of 1 s and the unit of the rates.
constexpr const char* kColumns =
    "time=row*1.0,rate_x=gyro_x[rad/s],rate_y=gyro_y[rad/s],rate_z=gyro_z[rad/"
    "s],temperature_coil=temp_c[degC]";
constexpr std::uint64_t kRows = 8400;

TEST(RealRecord, OfAMemsGyroInAThermalChamberLiveEqualsOffline) {
  const std::filesystem::path record =
      std::filesystem::path(ZERODRIFT_SHARED_DIR) / "data/imu_thermal_chamber/imu_thermal.csv";
  if (!std::filesystem::exists(record)) GTEST_SKIP() << "not here: " << record;
  SystemUnderTest system(Domain::kRealRecord);
  run_offline(system, record, system.path("offline.csv"), {"--columns", kColumns});
  run_live(system, {.source = {"--source", "record", "--record", record, "--columns", kColumns},
                    .samples = kRows,
                    .out = system.path("live.csv")});
  EXPECT_EQ(first_difference(system.path("live.csv"), system.path("offline.csv")), "");
  EXPECT_EQ(read_table(system.path("live.csv")).rows.size(), kRows);
}

}  // namespace
}  // namespace zerodrift::system_test
