// SPDX-License-Identifier: Apache-2.0
// `zerodrift compensate` tells a wrong sign, and tells nothing of what is as it should be.
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <string>

#include "tests/cli/command_line.h"

namespace zerodrift::cli_test {
namespace {

class InputFaults : public CommandLine {
 protected:
  void expect_none(const Arguments& compensate) {
    const Finished done = run(compensate);
    EXPECT_EQ(done.exit_code, 0) << done.err;
    EXPECT_EQ(done.err.find("turns the other way round"), std::string::npos) << done.err;
    EXPECT_EQ(done.err.find("corrects twice"), std::string::npos) << done.err;
  }
};

TEST_F(InputFaults, NoneIsFoundInTheDefaultRun) {
  const std::string config = std::string(ZERODRIFT_SOURCE_DIR) + "/config/";
  ASSERT_EQ(run({"simulate", "--model", config + "models/paper_fog.yaml", "--profile",
                 config + "profiles/paper_chamber.yaml", "--rate", "10", "--out", "@r.csv"})
                .exit_code,
            0);
  expect_none({"compensate", "--record", "@r.csv"});
}

TEST_F(InputFaults, NoneIsFoundInTheRealChamberRecord) {
  const std::filesystem::path record =
      std::filesystem::path(ZERODRIFT_SHARED_DIR) / "data/imu_thermal_chamber/imu_thermal.csv";
  if (!std::filesystem::exists(record)) GTEST_SKIP() << "not here: " << record;
  expect_none({"compensate", "--record", record.string(), "--columns",
               "time=row*1.0,rate_x=gyro_x[rad/s],rate_y=gyro_y[rad/s],rate_z=gyro_z[rad/s],"
               "temperature_coil=temp_c[degC]"});
}

// Turns and rests of ten seconds, of which z is measured with the opposite sign.
TEST_F(InputFaults, AReversedAxisIsNamedAndAMountingRightsIt) {
  std::string text =
      "time_s,rate_x_rad_s,rate_y_rad_s,rate_z_rad_s,reference_x_rad_s,reference_y_rad_s,"
      "reference_z_rad_s,temperature_coil_degC\n";
  for (int k = 1; k <= 2000; ++k) {
    const double turn_radps = k / 100 % 2 == 0 ? 0.0 : 0.1;
    char row[160];
    std::snprintf(row, sizeof row, "%g,%.9g,0,%.9g,%g,0,%g,20\n", 0.1 * k,
                  turn_radps + 1e-6 * std::sin(1.7 * k * k),
                  -turn_radps + 1e-6 * std::sin(1.3 * k * k), turn_radps, turn_radps);
    text += row;
  }
  system_test::write(path("r.csv"), text);
  const Finished done = run({"compensate", "--record", "@r.csv"});
  EXPECT_EQ(done.exit_code, 0) << done.err;
  EXPECT_NE(done.err.find("r.csv: axis z turns the other way round"), std::string::npos)
      << done.err;
  system_test::write(path("c.yaml"), "mounting: {axes: [x, y, -z]}\n");
  expect_none({"compensate", "--record", "@r.csv", "--config", "@c.yaml"});
}

}  // namespace
}  // namespace zerodrift::cli_test
