// SPDX-License-Identifier: Apache-2.0
// What `compensate` and `compare` call means over so many seconds are that: by the time stamps,
// whatever is missing in between, and with a line wherever there are none.
#include <algorithm>
#include <cmath>
#include <functional>
#include <sstream>
#include <string>

#include "tests/cli/command_line.h"

namespace zerodrift::cli_test {
namespace {

using Row = std::function<std::string(int k, const std::string& x, const std::string& z)>;

// Of `samples` rows, the k-th at interval_s * k: a drift that follows the temperature and a fixed
// pattern for noise; `row` gives what stands between time and temperature, "" where there is no
// row.
std::string record_of(int samples, double interval_s, const Row& row) {
  std::string text = "time_s,rate_x_rad_s,rate_z_rad_s,temperature_coil_degC\n";
  for (int k = 0; k < samples; ++k) {
    const double time_s = interval_s * k;
    const double temperature_degc = 20.0 + 10.0 * std::sin(2e-3 * time_s);
    char x[32];
    char z[32];
    std::snprintf(x, sizeof x, "%.9e", 1e-6 * temperature_degc + 1e-7 * std::sin(1.7 * k * k));
    std::snprintf(z, sizeof z, "%.9e", 2e-6 * temperature_degc + 1e-7 * std::cos(1.3 * k * k));
    const std::string cells = row(k, x, z);
    if (cells.empty()) continue;
    char line[128];
    std::snprintf(line, sizeof line, "%.3f,%s,%.4f\n", time_s, cells.c_str(), temperature_degc);
    text += line;
  }
  return text;
}

std::string both(int, const std::string& x, const std::string& z) {
  return x + "," + z;
}

class Minutes : public CommandLine {
 protected:
  std::string compensated(const std::string& record) {
    system_test::write(path("r.csv"), record);
    const Finished done = run({"compensate", "--record", "@r.csv"});
    EXPECT_EQ(done.exit_code, 0) << done.err;
    return done.out;
  }
  // Of the axis' row, the one behind its name counted 0.
  static std::string cell(const std::string& out, const std::string& axis, int number) {
    const std::size_t begin = out.find("\n" + axis + "   ");
    std::istringstream row(out.substr(std::min(begin, out.size() - 1) + 1));
    std::string text;
    for (int i = 0; i <= number + 1; ++i) row >> text;
    return text;
  }
  static bool has_row(const std::string& out, const std::string& axis) {
    return out.find("\n" + axis + "   ") != std::string::npos;
  }
};

// Two tables joined by their times. Before: half of each minute's samples were missing.
TEST_F(Minutes, RowsOfTemperatureAloneAreNoSamplesOfAMinute) {
  const Row joined = [](int k, const std::string& x, const std::string& z) {
    return k % 2 == 0 ? both(k, x, z) : ",";
  };
  const std::string out = compensated(record_of(12000, 0.05, joined));
  EXPECT_TRUE(has_row(out, "x")) << out;
  EXPECT_TRUE(has_row(out, "z")) << out;
  EXPECT_NE(out.find("6000 samples compensated"), std::string::npos) << out;
}

TEST_F(Minutes, TheHeadingSaysHowLongTheMeansAre) {
  const std::pair<double, std::string> cases[] = {
      {1.0, "60"}, {7.0, "63"}, {40.0, "80"}, {45.0, "45"}, {300.0, "300"}};
  for (const auto& [interval_s, block] : cases) {
    SCOPED_TRACE(interval_s);
    const std::string out = compensated(record_of(1200, interval_s, both));
    EXPECT_NE(out.find("standard deviation of " + block + " s means"), std::string::npos) << out;
    const Finished compared = run({"compare", "--record", "@r.csv", "--schemes", "none,stack"});
    EXPECT_EQ(compared.exit_code, 0) << compared.err;
    EXPECT_NE(compared.out.find(" " + block + " s std"), std::string::npos) << compared.out;
  }
}

// Half a minute every ten holds no minute, however the samples are counted.
TEST_F(Minutes, BurstsFarApartMakeNoMinutes) {
  const std::string out =
      compensated(record_of(12000, 1.0, [](int k, const auto& x, const auto& z) {
        return k % 600 < 30 ? x + "," + z : "";
      }));
  EXPECT_NE(out.find("\nno table: "), std::string::npos) << out;
  EXPECT_EQ(out.find("persistence"), std::string::npos) << out;
  for (const std::string axis : {"x", "z"})
    EXPECT_NE(out.find("\n" + axis + ": no spread, which takes two blocks of 60 s"),
              std::string::npos)
        << out;
}

// One in so many is lost: the same table, within what fewer samples make, whether the row is gone
// or its cells are blank.
TEST_F(Minutes, LostSamplesTakeNoResultAway) {
  const std::string blank =
      compensated(record_of(6000, 1.0, [](int k, const auto& x, const auto& z) {
        return k % 50 == 7 ? "," : x + "," + z;
      }));
  const std::string dropped =
      compensated(record_of(6000, 1.0, [](int k, const auto& x, const auto& z) {
        return k % 50 == 7 ? "" : x + "," + z;
      }));
  for (const std::string& out : {blank, dropped}) {
    EXPECT_TRUE(has_row(out, "x") && has_row(out, "z")) << out;
    EXPECT_EQ(out.find("no table"), std::string::npos) << out;
    EXPECT_EQ(out.find("no spread"), std::string::npos) << out;
  }
  const Finished compared = run({"compare", "--record", "@r.csv", "--schemes", "none,stack"});
  EXPECT_EQ(compared.exit_code, 0) << compared.err;
  // "none (before)": mean, std, MAE, RMSE, std of the minutes.
  const std::size_t row = compared.out.find("none (before)");
  ASSERT_NE(row, std::string::npos) << compared.out;
  char figures[5][16] = {};
  ASSERT_EQ(std::sscanf(compared.out.c_str() + row + 13, "%15s %15s %15s %15s %15s", figures[0],
                        figures[1], figures[2], figures[3], figures[4]),
            5);
  EXPECT_NE(std::string(figures[4]), "n/a") << compared.out;
}

// Rule: what no figure is made of is n/a. Seventy seconds every ten minutes hold minutes of which
// no two are neighbours. Before: 0.000, as if holding the last minute were perfect.
TEST_F(Minutes, PersistenceOfMinutesApartIsNotKnown) {
  const std::string out =
      compensated(record_of(24000, 1.0, [](int k, const auto& x, const auto& z) {
        return k % 600 < 70 ? x + "," + z : "";
      }));
  ASSERT_TRUE(has_row(out, "x")) << out;
  EXPECT_EQ(cell(out, "x", 2), "n/a") << out;
  EXPECT_EQ(out.find("0.000"), std::string::npos) << out;
}

// Half an hour at rest, then minutes of turning about z: 0, 100 and 200 deg/h.
std::string turning_record(const std::string& reference) {
  std::string text = "time_s,rate_x_deg_h,rate_z_deg_h" + reference + ",temperature_coil_degC\n";
  for (int k = 0; k < 36000; ++k) {
    const double time_s = 0.1 * k;
    const double turn = time_s < 1800.0 ? 0.0 : 100.0 * (static_cast<int>(time_s / 60.0) % 3);
    const double drift = 0.5 * std::sin(2e-3 * time_s);
    char line[128];
    std::snprintf(line, sizeof line, "%.1f,%.6f,%.6f", time_s, drift + std::sin(1.7 * k * k),
                  turn + drift + std::cos(1.3 * k * k));
    text += line;
    if (!reference.empty()) {
      std::snprintf(line, sizeof line, ",%.1f", turn);
      text += line;
    }
    std::snprintf(line, sizeof line, ",%.4f\n", 20.0 + 10.0 * std::sin(2e-3 * time_s));
    text += line;
  }
  return text;
}

// Rule: the table speaks of drift. What turned is taken off by the reference, and without one there
// is no ratio. Before: the spread was that of the rotation, and the ratio 1.
TEST_F(Minutes, WhatTurnedIsNoDrift) {
  const std::string without = compensated(turning_record(""));
  EXPECT_EQ(cell(without, "z", 3) + cell(without, "z", 4), "notcomparable") << without;
  EXPECT_NE(cell(without, "x", 3), "not") << without;
  EXPECT_NE(without.find("\nz: turned without a reference"), std::string::npos) << without;
  const std::string with = compensated(turning_record(",reference_z_deg_h"));
  EXPECT_NE(with.find("\nz: less the reference."), std::string::npos) << with;
  // The drift's own deviation is 0.35 deg/h.
  EXPECT_LT(std::stod(cell(with, "z", 0)), 0.5) << with;
  EXPECT_LT(std::stod(cell(with, "z", 1)), std::stod(cell(with, "z", 0))) << with;
  EXPECT_EQ(cell(with, "x", 0), cell(without, "x", 0)) << with;
}

// Rule: a spread of fewer than ten means is known to worse than a quarter, and is no figure.
TEST_F(Minutes, FewMinutesMakeNoSpreadOfSchemes) {
  system_test::write(path("r.csv"), record_of(600, 1.0, both));
  const Finished compared =
      run({"compare", "--record", "@r.csv", "--schemes", "none,stack", "--json", "@r.json"});
  EXPECT_EQ(compared.exit_code, 0) << compared.err;
  EXPECT_NE(compared.out.find("n/a (8)"), std::string::npos) << compared.out;
  EXPECT_NE(content(path("r.json")).find("\"blocks\": 8"), std::string::npos);
}

TEST_F(Minutes, AnAxisWithoutARowHasALineThatSaysWhatIsLacking) {
  const std::string out = compensated(record_of(6000, 1.0, [](int k, const auto& x, const auto& z) {
    return (k % 3 == 0 ? "" : x) + "," + z;
  }));
  EXPECT_TRUE(has_row(out, "z")) << out;
  EXPECT_FALSE(has_row(out, "x")) << out;
  EXPECT_NE(out.find("\nx: no spread, which takes two blocks of 60 s, compensated and with 80 % of "
                     "their\nsamples each: found 0\n"),
            std::string::npos)
      << out;
  EXPECT_EQ(out.find("\ny: "), std::string::npos) << out;
}

}  // namespace
}  // namespace zerodrift::cli_test
