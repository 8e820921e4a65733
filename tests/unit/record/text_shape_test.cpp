// SPDX-License-Identifier: Apache-2.0
// What separates cells and decimals, and whether there is a header, is seen in the first lines.
#include "common/record/text_shape.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "common/core/units.h"
#include "common/files/file_error.h"
#include "common/record/record_reader.h"
#include "tests/support/scratch_folder.h"

namespace zerodrift::record {
namespace {

struct Reading {
  std::vector<double> time_s;
  std::vector<double> rate_radps;  // of x
  std::vector<double> temperature_degc;
  std::string refusal;  // without the file's name; empty where all was read
};

class TextShapes : public ScratchFolder {
 protected:
  Reading read(std::string_view content, std::string_view columns = "") {
    const std::filesystem::path file = write("a.csv", content);
    Reading reading;
    try {
      RecordReader reader{file, {.columns = parse_column_map(columns)}};
      while (const RecordRow* row = reader.next()) {
        reading.time_s.push_back(core::seconds(row->time));
        reading.rate_radps.push_back(row->rate_radps[0]);
        if (!row->temperature_degc.empty())
          reading.temperature_degc.push_back(row->temperature_degc[0]);
      }
    } catch (const files::FileError& error) {
      reading.refusal = std::string{error.what()}.substr(file.string().size());
    }
    return reading;
  }

  void expect_the_same(std::string_view content, std::string_view columns = "") {
    const Reading reading = read(content, columns);
    EXPECT_EQ(reading.refusal, "") << content;
    EXPECT_EQ(reading.time_s, (std::vector<double>{0.0, 0.5, 1.0})) << content;
    EXPECT_EQ(reading.rate_radps, (std::vector<double>{1.5, -2.25e-3, 4.0})) << content;
    EXPECT_EQ(reading.temperature_degc.size(), 3U) << content;
    EXPECT_EQ(reading.temperature_degc.front(), 20.5) << content;
    EXPECT_TRUE(std::isnan(reading.temperature_degc[1])) << content;
  }
};

TEST_F(TextShapes, EachWayToSeparateCellsGivesTheSameRows) {
  expect_the_same(
      "time_s,rate_x_rad_s,temperature_coil_degC\n0,1.5,20.5\n0.5,-2.25e-3,\n1,+4,21\n");
  expect_the_same(
      "time_s;rate_x_rad_s;temperature_coil_degC\n0;1.5;20.5\n0.5;-2.25e-3;\n1;+4;21\n");
  expect_the_same(
      "time_s;rate_x_rad_s;temperature_coil_degC\r\n0;1,5;20,5\r\n0,5;-2,25e-3;\r\n1;+4;21\r\n");
  expect_the_same(
      "\xEF\xBB\xBF# note: x\n# y\ntime_s\trate_x_rad_s\ttemperature_coil_degC\n"
      "0\t1.5\t20.5\n0.5\t-2.25e-3\t\n1\t+4\t21\n");
  expect_the_same(
      "\"time_s\";\"rate_x_rad_s\";\"temperature_coil_degC\"\n\"0\";\"1,5\";\"20,5\"\n"
      "\"0,5\";\"-2,25e-3\";\"\"\n\"1\";\"+4\";\"21\"\n");
  expect_the_same(
      "  time_s   rate_x_rad_s  temperature_coil_degC\n  0.0   1.5     20.5\n"
      "  0.5 -2.25e-3   nan \n  1.0\t4.0   21\n");
}

TEST_F(TextShapes, AFileWithoutAHeaderIsReadByNumbersOfColumns) {
  const std::string_view by_number = "time=1[s],rate_x=2[rad/s],temperature_coil=3[degC]";
  expect_the_same("0,1.5,20.5\n0.5,-2.25e-3,\n1,+4,21\n", by_number);
  expect_the_same("0;1,5;20,5\n0,5;-2,25e-3;\n1;+4;21\n", by_number);
  expect_the_same("# made by hand\n0\t1.5\t20.5\n0.5\t-2.25e-3\t\n1\t+4\t21\n", by_number);
  expect_the_same(" 0 1.5 20.5\n .5 -2.25e-3 nan\n 1 +4 21\n", by_number);
}

TEST_F(TextShapes, ANumberThatIsAColumnsNameIsThatColumn) {
  const Reading reading = read("0,1,2\n5,0.5,7\n6,1.0,8\n", "time=1[s],rate_x=2[rad/s]");
  EXPECT_EQ(reading.time_s, (std::vector<double>{0.5, 1.0}));
  EXPECT_EQ(reading.rate_radps, (std::vector<double>{7.0, 8.0}));
}

TEST_F(TextShapes, NumbersThatCouldBeNamesOrARowAreRefused) {
  EXPECT_EQ(read("2,1,7\n3,4,7\n", "time=1[s],rate_x=2[rad/s]").refusal,
            ": the first line is numbers, which may be a row or the columns' names that --columns "
            "uses; write names above it");
}

TEST_F(TextShapes, CommasThatGiveTheColumnsAMeaningStayWhatTheyAre) {
  const Reading reading = read("time_s,rate_x_rad_s,a;b c\n0,1.5,x;y z\n0.5,2,\n", "");
  EXPECT_EQ(reading.rate_radps, (std::vector<double>{1.5, 2.0}));
}

TEST_F(TextShapes, ATableWithTwoPossibleSeparatorsIsRefused) {
  EXPECT_EQ(read("t,a;gx\n0,1;2\n").refusal,
            ": the first two lines fall into equally many cells in more than one way: 2 by ',' and "
            "2 by ';'; put quotes around cells that hold the one that separates nothing");
}

TEST_F(TextShapes, PointsAndCommasInOneFileAreRefused) {
  EXPECT_EQ(
      read("time_s;rate_x_rad_s\n0.5;1,5\n").refusal,
      ": found '1,5' and '0.5', expected decimals with a comma or with a point, not with both");
  EXPECT_EQ(read("time_s;rate_x_rad_s\n0,5;1.234,5\n").refusal.substr(0, 62),
            ":2: column 'rate_x_rad_s': found '1.234,5', expected a number ");
  std::string late = "time_s;rate_x_rad_s\n";
  for (int i = 0; i < 40; ++i) late += std::to_string(i) + ";2,5\n";
  EXPECT_EQ(read(late + "40;2.5\n").refusal,
            ":42: column 'rate_x_rad_s': found '2.5', expected a number with a decimal comma "
            "(blank = not measured)");
}

// A version in a column that is not used says nothing of the decimals.
TEST_F(TextShapes, OnlyColumnsWithAMeaningSayHowDecimalsAreWritten) {
  EXPECT_EQ(read("time_s;rate_x_rad_s;version\n0;1,5;2.1\n").rate_radps,
            (std::vector<double>{1.5}));
}

TEST_F(TextShapes, DatesAreTimes) {
  const auto reading = [&](const char* first, const char* second) {
    return read("stamp,rate_x_rad_s\n" + std::string{first} + ",1\n" + second + ",2\n",
                "time=stamp[iso8601]");
  };
  EXPECT_EQ(reading("1970-01-01T00:00:01Z", "1970-01-01T00:00:01.5Z").time_s,
            (std::vector<double>{1.0, 1.5}));
  EXPECT_EQ(reading("1970-01-01 01:00:01+01:00", "1970-01-01 00:00:02").time_s,
            (std::vector<double>{1.0, 2.0}));
  EXPECT_EQ(read("time_iso8601;rate_x_rad_s\n1970-01-01T00:00:02;1,5\n").time_s,
            (std::vector<double>{2.0}));
  EXPECT_EQ(reading("5.5", "6").refusal,
            ":2: column 'stamp': found '5.5', expected a date as 2024-05-01T12:00:00.5Z: every row "
            "needs one");
  EXPECT_EQ(read("time_s,rate_x_rad_s\n1970-01-01T00:01,1\n").refusal,
            ":2: column 'time_s': found '1970-01-01T00:01', expected a time: every row needs one; "
            "a date has the unit iso8601; a guess, not used: --columns "
            "'time=time_s[iso8601],rate_x=rate_x_rad_s[rad/s]'");
  EXPECT_EQ(read("time_s,rate_x_rad_s\n1,1\n1970-01-01T00:01,1\n").refusal,
            ":3: column 'time_s': found '1970-01-01T00:01', expected a time: every row needs one; "
            "a date has the unit iso8601")
      << "the first row is what the guess looks at";
  EXPECT_THROW(static_cast<void>(parse_column_map("time=t*2[iso8601]")), files::FileError);
}

TEST_F(TextShapes, FahrenheitIsAUnit) {
  EXPECT_NEAR(read("time_s,temperature_coil_degF\n0,212\n").temperature_degc.front(), 100.0,
              1e-12);  // some roundings of doubles near 100
}

}  // namespace
}  // namespace zerodrift::record
