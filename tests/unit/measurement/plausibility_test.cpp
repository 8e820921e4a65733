// SPDX-License-Identifier: Apache-2.0
// What can hardly be right about a record is doubted with its kind, its column and the cure; what
// gyros really show is not.
#include "common/measurement/plausibility.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace zerodrift::measurement {
namespace {

using Cells = std::vector<double>;  // one a column, as in the file

double noise(int i) {
  return std::sin(1.7 * i * i);
}

// A record of 1 Hz with these columns, bound as a reader binds them.
std::vector<Doubt> doubts_of(const std::vector<std::string>& values,
                             const std::function<Cells(int)>& cells, int rows = 1200,
                             const std::string& columns = "") {
  record::RecordInfo info;
  info.path = "r.csv";
  info.columns = {"time_s"};
  info.columns.insert(info.columns.end(), values.begin(), values.end());
  const auto layout =
      record::bind_columns(info.path, info.columns, record::parse_column_map(columns));
  RecordWatch watch(info, columns);
  record::RecordRow row;
  row.temperature_degc.assign(layout.probes.size(), 0.0);
  for (int i = 0; i < rows; ++i) {
    row.time = core::from_seconds(i);
    const Cells in_file = cells(i);
    for (std::size_t c = 1; c < layout.columns.size(); ++c) {
      const record::BoundColumn& column = layout.columns[c];
      record::value_of(row, column) =
          in_file[c - 1] * column.conversion.scale + column.conversion.offset;
    }
    static_cast<void>(watch.add(row));
  }
  return watch.doubts();
}

// One doubt, of this kind and column, that says this.
void expect_one(const std::vector<Doubt>& doubts, DoubtKind kind, const std::string& column,
                const std::string& said) {
  ASSERT_EQ(doubts.size(), 1U) << (doubts.empty() ? "none" : lines_of(doubts).back());
  EXPECT_EQ(doubts.front().kind, kind) << doubts.front().text;
  EXPECT_EQ(doubts.front().column, column);
  EXPECT_EQ(doubts.front().record, "r.csv");
  EXPECT_NE(doubts.front().text.find(said), std::string::npos) << doubts.front().text;
}

std::vector<Doubt> doubts_of_temperature(const std::string& header,
                                         const std::function<double(int)>& cell,
                                         const std::string& columns = "") {
  return doubts_of(
      {header}, [&](int i) { return Cells{cell(i)}; }, 1200, columns);
}

TEST(Doubts, OfACoilAtMinus266DegreesNameTheUnitThatCuresIt) {
  expect_one(doubts_of_temperature("temperature_coil_K", [](int i) { return 7.35 + 0.01 * i; }),
             DoubtKind::kNotMeasurable, "temperature_coil_K",
             "between -265.8 and -253.8 degC, expected -100 to 200 degC; is it in degC? then "
             "--columns 'temperature_coil=temperature_coil_K[degC]'");
}

TEST(Doubts, OfKelvinReadAsCelsiusNameKelvin) {
  expect_one(doubts_of_temperature("temperature_coil_degC", [](int i) { return 293.0 + 0.01 * i; }),
             DoubtKind::kNotMeasurable, "temperature_coil_degC", "[K]'");
}

TEST(Doubts, OfFahrenheitReadAsCelsiusNameFahrenheit) {
  // A laboratory, 22 to 25 degC.
  expect_one(doubts_of_temperature("temperature_coil_degC", [](int i) { return 72.0 + 0.005 * i; }),
             DoubtKind::kUnit, "temperature_coil_degC",
             "is it in degF? then --columns 'temperature_coil=temperature_coil_degC[degF]'");
  // A chamber, -40 to 71 degC.
  expect_one(doubts_of_temperature(
                 "t", [](int i) { return -40.0 + i / 6.0; }, "temperature_case=t[degC]"),
             DoubtKind::kUnit, "t", "'temperature_case=t[degF]'");
}

TEST(Doubts, AreCuredByWhatTheyPropose) {
  const auto cell = [](int i) { return 72.0 + 0.005 * i; };
  EXPECT_TRUE(doubts_of_temperature("t", cell, "temperature_coil=t[degF]").empty());
}

// A hot plateau is reached from somewhere, and a cold one is not a laboratory in degF.
TEST(Doubts, AreNoneOfWhatAChamberDoes) {
  for (const double from_degc : {-55.0, -20.0, 20.0, 40.0}) {
    for (const double to_degc : {-40.0, 25.0, 71.0, 85.0, 110.0}) {
      const auto doubts = doubts_of_temperature("temperature_coil_degC", [&](int i) {
        return from_degc + (to_degc - from_degc) * i / 1200.0;
      });
      EXPECT_TRUE(doubts.empty()) << from_degc << " to " << to_degc << ": "
                                  << lines_of(doubts).back();
    }
  }
}

TEST(Doubts, OfASpreadOf100DegPerSecondAtRestNameTheUnitOrTheMissingTruth) {
  const auto cells = [](int i) { return Cells{140.0 * noise(i)}; };
  const std::vector<Doubt> doubts = doubts_of({"rate_x_deg_s"}, cells);
  expect_one(doubts, DoubtKind::kNotAtRest, "rate_x_deg_s",
             "too much for a gyro at rest: it turned, and no true rate says how");
  EXPECT_NE(doubts.front().text.find("is it in deg/h? then --columns 'rate_x=rate_x_deg_s[deg/h]'"),
            std::string::npos)
      << doubts.front().text;
}

TEST(Doubts, AreNoneOfATurnWhoseTruthIsThere) {
  const auto turn = [](int i) { return Cells{100.0 + noise(i), 100.0}; };
  EXPECT_TRUE(doubts_of({"rate_z_deg_s", "reference_z_deg_s"}, turn).empty());
  const auto reversed = [](int i) { return Cells{100.0 + noise(i), -100.0}; };
  expect_one(doubts_of({"rate_z_deg_s", "reference_z_deg_s"}, reversed), DoubtKind::kNotAtRest,
             "rate_z_deg_s", "sign or unit");
}

// The poorest gyros: a bias at the end of the data sheet's range under noise of 1 deg/s; and a
// count of 0.05 deg/s, whose unit nobody knows but the one who wrote the map.
TEST(Doubts, AreNoneOfAPoorGyro) {
  EXPECT_TRUE(doubts_of(
                  {"g"}, [](int i) { return Cells{std::round(180.0 + 20.0 * noise(i))}; }, 1200,
                  "rate_y=g*0.05[deg/s]")
                  .empty());
}

TEST(Doubts, OfCountsTakenForDegreesPerSecondProposeNoUnit) {
  const auto doubts = doubts_of(
      {"g"}, [](int i) { return Cells{1000.0 + noise(i)}; }, 1200, "rate_y=g*0.05[deg/s]");
  expect_one(doubts, DoubtKind::kNotAtRest, "g", "too much for a gyro at rest");
  EXPECT_EQ(doubts.front().text.find("--columns"), std::string::npos) << doubts.front().text;
}

TEST(Doubts, OfAStuckRateAreCertainAndOfAStuckThermometerOnlyBesideAnotherOrForLong) {
  expect_one(doubts_of(
                 {"rate_x_deg_h"}, [](int) { return Cells{1.0}; }, 1200),
             DoubtKind::kStuck, "rate_x_deg_h", "all 1200 readings are equal");
  const auto two = [](int i) { return Cells{25.0, 20.0 + 0.01 * i}; };
  expect_one(doubts_of({"temperature_case_degC", "temperature_coil_degC"}, two, 300),
             DoubtKind::kStuck, "temperature_case_degC", "while another probe moves by 2.99 degC");
  const auto alone = [](int) { return Cells{25.0}; };
  EXPECT_TRUE(doubts_of({"temperature_case_degC"}, alone, 590).empty());
  expect_one(doubts_of({"temperature_case_degC"}, alone, 610), DoubtKind::kStuck,
             "temperature_case_degC", "stuck, or too coarse");
}

// Rule: a thermometer that stops part-way is asked about, one that is coarse, slow or stays for
// some minutes isn't.
TEST(Doubts, OfAThermometerThatStopsWhileAnotherMovesAskWhetherItIsStuck) {
  const auto of_two = [](const std::function<Cells(int)>& cells, int rows) {
    return doubts_of({"temperature_case_degC", "temperature_coil_degC"}, cells, rows);
  };
  const auto stops = [](int i) { return Cells{20.0 + 0.01 * std::min(i, 1000), 20.0 + 0.01 * i}; };
  expect_one(of_two(stops, 3001), DoubtKind::kStuck, "temperature_case_degC",
             "degC for 2000 s while another probe moves by 20.0 degC: is it stuck?");
  const auto coarse = [](int i) {
    return Cells{std::round((20.0 + 0.002 * i) / 0.5) * 0.5, 20.0 + 0.002 * i};
  };
  EXPECT_TRUE(of_two(coarse, 9000).empty());
  const auto slow = [](int i) {
    return Cells{i % 900 == 0 ? 20.0 + 0.01 * i : record::kNotMeasured, 20.0 + 0.01 * i};
  };
  EXPECT_TRUE(of_two(slow, 9000).empty());
  const auto short_stop = [](int i) {
    return Cells{20.0 + 0.01 * (i < 1000 ? i : std::max(i - 500, 1000)), 20.0 + 0.01 * i};
  };
  EXPECT_TRUE(of_two(short_stop, 3000).empty());
}

TEST(Doubts, OfSevenSecondsSayThatNoDriftIsInThem) {
  const auto cells = [](int i) { return Cells{noise(i)}; };
  expect_one(doubts_of({"rate_x_deg_h"}, cells, 7), DoubtKind::kTooShort, "", "spans 7.00 s");
  EXPECT_TRUE(doubts_of({"rate_x_deg_h"}, cells, 60).empty());
}

TEST(Doubts, OfAFewImpossibleReadingsCountThemAndProposeNothing) {
  const auto doubts = doubts_of_temperature(
      "temperature_coil_degC", [](int i) { return i % 100 == 7 ? -999.0 : 20.0 + 0.01 * i; });
  expect_one(doubts, DoubtKind::kNotMeasurable, "temperature_coil_degC",
             "12 of 1200 readings lie between -999");
  EXPECT_EQ(doubts.front().text.find("--columns"), std::string::npos) << doubts.front().text;
}

// Nothing measured, infinities, a single row: no doubt that isn't one, and no crash.
TEST(Doubts, OfNothingAreNone) {
  EXPECT_TRUE(doubts_of(
                  {"rate_x_deg_h"}, [](int) { return Cells{0.0}; }, 0)
                  .empty());
  const auto blank = [](int) { return Cells{std::nan(""), std::nan("")}; };
  EXPECT_TRUE(doubts_of({"rate_x_deg_h", "temperature_coil_degC"}, blank).empty());
  const auto infinite = [](int) { return Cells{HUGE_VAL}; };
  expect_one(doubts_of({"rate_x_deg_h"}, infinite), DoubtKind::kNotMeasurable, "rate_x_deg_h",
             "1200 of 1200 readings");
}

}  // namespace
}  // namespace zerodrift::measurement
