// SPDX-License-Identifier: Apache-2.0
// What can hardly be right about a record stands before every result of it, on the terminal, in the
// JSON and in the HTML; the real records and the shipped simulations are not doubted.
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/cli/command_line.h"

namespace zerodrift::cli_test {
namespace {

const std::string kConfig = std::string(ZERODRIFT_SOURCE_DIR) + "/config/";
const std::filesystem::path kData = std::filesystem::path(ZERODRIFT_SHARED_DIR) / "data";

// Of 1 Hz: a drift that follows the temperature, which a thermometer gives in degC.
std::string record_of(const std::string& temperature, int samples) {
  std::string text = "time_s,rate_z_rad_s," + temperature + "\n";
  for (int k = 1; k <= samples; ++k) {
    const double temperature_degc = 20.0 + 10.0 * std::sin(0.01 * k);
    char row[96];
    std::snprintf(row, sizeof row, "%d,%.9e,%.4f\n", k,
                  1e-6 * temperature_degc + 1e-7 * std::sin(1.7 * k * k), temperature_degc);
    text += row;
  }
  return text;
}

class DoubtfulRecord : public CommandLine {
 protected:
  // The rest of a call of the command on r.csv, its reports left out.
  static Arguments call(const std::string& command) {
    Arguments arguments{command, "--record", "@r.csv"};
    if (command == "diagnose")
      arguments = system_test::operator+(arguments, {"--model", kConfig + "models/lab_fog.yaml"});
    if (command == "calibrate")
      arguments =
          system_test::operator+(arguments, {"--effects", "bias", "--out-model", "@m.yaml"});
    return arguments;
  }
  void expect_no_doubt(const std::string& record, const std::string& columns = "") {
    Arguments arguments{"info", record};
    if (!columns.empty()) arguments = system_test::operator+(arguments, {"--columns", columns});
    const Finished done = run(arguments);
    EXPECT_EQ(done.exit_code, 0) << done.err;
    EXPECT_EQ(done.out.find("doubtful"), std::string::npos) << done.out;
  }
};

TEST_F(DoubtfulRecord, IsDoubtedInTheFirstLineOfEveryCommandAndInEveryReport) {
  system_test::write(path("r.csv"), record_of("temperature_coil_K", 1500));
  const std::string doubt = "r.csv: column temperature_coil_K: 1500 of 1500 readings lie between";
  for (const std::string command :
       {"info", "compensate", "compare", "allan", "diagnose", "calibrate"}) {
    SCOPED_TRACE(command);
    const bool has_json = command != "compensate";
    const bool has_html = has_json && command != "info";
    Arguments arguments = call(command);
    if (has_json) arguments = system_test::operator+(arguments, {"--json", "@o.json"});
    if (has_html) arguments = system_test::operator+(arguments, {"--html", "@o.html"});
    const Finished done = run(arguments);
    EXPECT_EQ(done.exit_code, 0) << done.err;
    const std::string first = done.out.substr(0, done.out.find('\n'));
    EXPECT_TRUE(first.starts_with("doubtful: ")) << done.out;
    EXPECT_NE(first.find(doubt), std::string::npos) << first;
    EXPECT_NE(first.find("[degC]'"), std::string::npos) << first;
    if (has_json) {
      const auto json = nlohmann::json::parse(content(path("o.json")));
      ASSERT_EQ(json["doubts"].size(), 1U) << json["doubts"];
      EXPECT_EQ(json["doubts"][0]["kind"], "not_measurable");
      EXPECT_EQ(json["doubts"][0]["column"], "temperature_coil_K");
    }
    if (has_html) {
      const std::string page = content(path("o.html"));
      EXPECT_LT(page.find("<b>Doubtful:</b>"), page.find("class=\"verdict\"")) << command;
    }
  }
}

TEST_F(DoubtfulRecord, IsNoMoreDoubtedWithTheColumnsThatTheDoubtProposes) {
  system_test::write(path("r.csv"), record_of("temperature_coil_K", 1500));
  expect_no_doubt("@r.csv", "temperature_coil=temperature_coil_K[degC]");
}

TEST_F(DoubtfulRecord, OfSevenSecondsGivesNoTableOfZeros) {
  system_test::write(path("r.csv"), record_of("temperature_coil_degC", 7));
  const Finished done = run({"compensate", "--record", "@r.csv", "--out", "@out.csv"});
  EXPECT_EQ(done.exit_code, 0) << done.err;
  EXPECT_TRUE(done.out.starts_with("doubtful: ")) << done.out;
  EXPECT_NE(done.out.find("it spans 7.00 s"), std::string::npos) << done.out;
  EXPECT_NE(done.out.find("no table"), std::string::npos) << done.out;
  EXPECT_EQ(done.out.find("0.00000"), std::string::npos) << done.out;
  // What can be given is given: 7 samples below what the columns are.
  EXPECT_EQ(lines_of(content(path("out.csv"))), 9U);
}

TEST_F(DoubtfulRecord, IsNoneOfTheShippedSimulations) {
  std::size_t profiles = 0;
  for (const auto& profile : std::filesystem::directory_iterator(kConfig + "profiles")) {
    SCOPED_TRACE(profile.path());
    for (const std::string model : {"paper_fog.yaml", "lab_fog.yaml"}) {
      const Finished made = run({"simulate", "--model", kConfig + "models/" + model, "--profile",
                                 profile.path().string(), "--rate", "2", "--out", "@s.csv"});
      ASSERT_EQ(made.exit_code, 0) << made.err;
      expect_no_doubt("@s.csv");
    }
    ++profiles;
  }
  EXPECT_GE(profiles, 7U);
}

TEST_F(DoubtfulRecord, IsNoneOfTheRealOnes) {
  if (!std::filesystem::exists(kData)) GTEST_SKIP() << "not here: " << kData;
  const std::string adis =
      "time=row*0.01,rate_x=gx_lsb*0.05[deg/s],rate_y=gy_lsb*0.05[deg/s],"
      "rate_z=gz_lsb*0.05[deg/s]";
  for (const std::string run : {"1", "2", "3"})
    expect_no_doubt((kData / ("adis16405_static/adis16405_run" + run + ".csv.xz")).string(), adis);
  expect_no_doubt((kData / "imu_thermal_chamber/imu_thermal.csv").string(),
                  "time=row*1.0,rate_x=gyro_x[rad/s],rate_y=gyro_y[rad/s],rate_z=gyro_z[rad/s],"
                  "acceleration_x=acc_x[m/s^2],acceleration_y=acc_y[m/s^2],"
                  "acceleration_z=acc_z[m/s^2],temperature_coil=temp_c[degC]");
  expect_no_doubt((kData / "cubesat_tvac_gyro/tvac_gyro_20200307.csv").string(),
                  "rate_x=gyro_x_rad_s[rad/s],rate_y=gyro_y_rad_s[rad/s],"
                  "rate_z=gyro_z_rad_s[rad/s],temperature_coil=temp_c[degC],"
                  "magnetic_x=mag_x_t[T],magnetic_y=mag_y_t[T],magnetic_z=mag_z_t[T]");
}

}  // namespace
}  // namespace zerodrift::cli_test
