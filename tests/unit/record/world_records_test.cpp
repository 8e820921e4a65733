// SPDX-License-Identifier: Apache-2.0
// Twelve shapes that loggers write: each is read to the right numbers, or refused with the cure.
#include <gtest/gtest.h>

#include <cmath>

#include "common/core/units.h"
#include "common/files/file_error.h"
#include "common/record/record_reader.h"
#include "tests/support/scratch_folder.h"

namespace zerodrift::record {
namespace {

class WorldRecords : public ScratchFolder {
 protected:
  std::string refusal(std::string_view content, std::string_view columns = "") {
    try {
      static_cast<void>(second_row(content, columns));
    } catch (const files::FileError& error) {
      return std::string{error.what()}.substr(path("a.csv").string().size());
    }
    return "read";
  }

  struct Row {
    std::int64_t time_ns = 0;
    double rate_x_deg_s = 0.0;
    double temperature_degc = std::nan("");
  };

  // The map that a refusal proposes, ready to be given.
  static std::string proposal(const std::string& line) {
    const std::string_view begin = "--columns '";
    const std::size_t from = line.rfind(begin);
    if (from == std::string::npos) return "";
    const std::size_t at = from + begin.size();
    return line.substr(at, line.find('\'', at) - at);
  }

  Row second_row(std::string_view content, std::string_view columns) {
    RecordReader reader{write("a.csv", content), {.columns = parse_column_map(columns)}};
    static_cast<void>(reader.next());
    const RecordRow* row = reader.next();
    if (row == nullptr) throw files::FileError(path("a.csv").string() + ": has one row");
    Row found{row->time.count(), row->rate_radps[0] / core::kRadPerDeg};
    if (!row->temperature_degc.empty()) found.temperature_degc = row->temperature_degc[0];
    return found;
  }

  // Tolerance: a degree and back is rounded four times, 4 * 2^-53 of the value.
  void expect_row(std::string_view content, std::string_view columns, Row expected) {
    const Row row = second_row(content, columns);
    EXPECT_EQ(row.time_ns, expected.time_ns);
    EXPECT_NEAR(row.rate_x_deg_s, expected.rate_x_deg_s,
                5e-16 * std::abs(expected.rate_x_deg_s) + 1e-18);
    if (std::isnan(expected.temperature_degc)) return;
    EXPECT_NEAR(row.temperature_degc, expected.temperature_degc, 1e-12);
  }

  // Refused without --columns, and read by what the refusal proposes.
  void expect_proposed(std::string_view content, std::string_view map, Row expected) {
    EXPECT_EQ(proposal(refusal(content)), map);
    expect_row(content, map, expected);
  }
};

TEST_F(WorldRecords, ADataAcquisitionsSemicolonsWithDecimalCommas) {
  expect_proposed(
      "Zeit;Time [s];Gyro X [\xC2\xB0/s];Temp [\xC2\xB0"
      "C]\r\n"
      "a;0,000;1,5;20,5\r\nb;0,005;-1,25;20,75\r\n",
      "time=Time [s][s],rate_x=Gyro X [\xC2\xB0/s][deg/s],temperature_coil=Temp "
      "[\xC2\xB0"
      "C][degC]",
      {5'000'000, -1.25, 20.75});
}

TEST_F(WorldRecords, ATabSeparatedTableOfANumericProgramme) {
  expect_proposed("t\tomega_x\tomega_y\n0\t1e-3\t0\n0.01\t2.5e-3\t0\n",
                  "time=t[s],rate_x=omega_x[deg/s],rate_y=omega_y[deg/s]", {10'000'000, 2.5e-3});
}

TEST_F(WorldRecords, APhonesNanosecondStamps) {
  expect_proposed(
      "time,seconds_elapsed,x,y,z,gyro_x_dps\n"
      "1714564800123456789,0.1,0,0,0,1\n1714564800133456790,0.2,0,0,0,2\n",
      "time=time[ns],rate_x=gyro_x_dps[deg/s]", {1'714'564'800'133'456'790, 2.0});
}

TEST_F(WorldRecords, ALoggersDatesWithAnOffset) {
  expect_proposed(
      "timestamp,gx (deg/s),temperature (F)\n2024-05-01 14:00:00.000000001+02:00,1,32\n"
      "2024-05-01 14:00:00.100000002+02:00,3,212\n",
      "time=timestamp[iso8601],rate_x=gx (deg/s)[deg/s],temperature_coil=temperature (F)[degF]",
      {1'714'564'800'100'000'002, 3.0, 100.0});
}

TEST_F(WorldRecords, ARobotsTopicPrintedAsATable) {
  expect_proposed(
      "%time,field.header.seq,timestamp,field.angular_velocity.x,field.angular_velocity.y\n"
      "1714564800000000000,0,1714564800000000000,0.5,0\n"
      "1714564800010000000,1,1714564800010000000,0.25,0\n",
      "time=%time[ns],rate_x=field.angular_velocity.x[deg/s],"
      "rate_y=field.angular_velocity.y[deg/s]",
      {1'714'564'800'010'000'000, 0.25});
}

TEST_F(WorldRecords, AnAutopilotsMicroseconds) {
  expect_proposed("timestamp_us,xgyro,ygyro,zgyro,temp_c\n100,1,0,0,25\n2100,0.5,0,0,26\n",
                  "time=timestamp_us[us],rate_x=xgyro[deg/s],rate_y=ygyro[deg/s],rate_z=zgyro["
                  "deg/s],temperature_coil=temp_c[degC]",
                  {2'100'000, 0.5, 26.0});
}

TEST_F(WorldRecords, BlanksOfANumberPrintingProgramme) {
  expect_row("# t gx\n 0.000e+00  1.0e+00\n 1.000e-02 -2.0e+00\n", "time=1[s],rate_x=2[deg/s]",
             {10'000'000, -2.0});
  EXPECT_EQ(proposal(refusal(" 0.000  1.0\n 0.010 -2.0\n")), "time=1[s],rate_x=2[deg/s]");
}

TEST_F(WorldRecords, ASerialTerminalsLinesWithoutAHeader) {
  expect_row("0,10,20\n10,-4,21\n", "time=1[ms],rate_x=2*0.05[deg/s],temperature_coil=3[degC]",
             {10'000'000, -0.2, 21.0});
}

TEST_F(WorldRecords, ASpreadsheetsByteOrderMarkAndQuotes) {
  expect_row("\xEF\xBB\xBF\"time_s\",\"rate_x_deg_s\"\r\n\"0\",\"1\"\r\n\"0.5\",\"2\"\r\n", "",
             {500'000'000, 2.0});
}

TEST_F(WorldRecords, CountsOfASensorWithoutAClock) {
  expect_proposed("gx_lsb,gx\n1,1\n2,2\n", "time=row*0.01,rate_x=gx[deg/s]", {10'000'000, 2.0});
}

TEST_F(WorldRecords, DecimalCommasBetweenCommasAreRefused) {
  EXPECT_EQ(refusal("time_s,rate_x_deg_s\n0,0,1,5\n0,5,2,5\n"),
            ":2: found 4 cells, the header has 2; cells with decimal commas have to be separated "
            "by semicolons or tabs");
}

TEST_F(WorldRecords, LinesOfAReportAboveTheHeaderAreRefused) {
  EXPECT_EQ(refusal("Measurement;of gyro 7\ntime_s;rate_x_deg_s;note\n0;1;a\n"),
            ": no column is the time (time_s); name one by --columns 'time=<column>[s]' or "
            "'time=row*<seconds>'; the columns are: Measurement, of gyro 7; lines above the header "
            "begin with '#'");
}

}  // namespace
}  // namespace zerodrift::record
