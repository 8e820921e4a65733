// SPDX-License-Identifier: Apache-2.0
#include "common/record/record_reader.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "common/core/units.h"
#include "common/record/record_writer.h"
#include "tests/support/scratch_folder.h"

namespace zerodrift::record {
namespace {

using core::SensorTime;

class RecordReading : public ScratchFolder {
 protected:
  static std::vector<SensorTime> times(RecordReader& reader) {
    std::vector<SensorTime> all;
    while (const RecordRow* row = reader.next()) all.push_back(row->time);
    return all;
  }
};

constexpr const char* kSmallRecord =
    "# gyro: F1\n"
    "# note: with: colon\n"
    "time_s,rate_x_deg_h,rate_z_rad_s,reference_x_deg_s,temperature_coil_degC,temperature_case_K,"
    "comment,supply_mV\n"
    "10.0,3600,-0.5,1,20.5,300.15,start,5000\n"
    "10.005,,nan,,,,\"a, b\",\n"
    "10.010,7200,0.25,2,21.5,,end,4900\n";

TEST_F(RecordReading, GivesRowsInDefaultUnitsAndBlanksAsNotMeasured) {
  RecordReader reader{write("a.csv", kSmallRecord)};

  const RecordRow* row = reader.next();
  ASSERT_NE(row, nullptr);
  EXPECT_EQ(row->index, 0U);
  EXPECT_EQ(row->time, SensorTime{10'000'000'000});
  EXPECT_EQ(row->rate_radps[0], core::radps_from_deg_h(3600.0));
  EXPECT_TRUE(std::isnan(row->rate_radps[1]));
  EXPECT_EQ(row->rate_radps[2], -0.5);
  EXPECT_EQ(row->reference_radps[0], core::kRadPerDeg);
  EXPECT_EQ(row->reference_radps[1], 0.0);
  EXPECT_EQ(row->temperature_degc[0], 20.5);
  EXPECT_EQ(row->temperature_degc[1], 300.15 - 273.15);
  EXPECT_EQ(row->inputs.supply_v, 5000 * 1e-3);
  EXPECT_TRUE(std::isnan(row->inputs.vibration_g));
  EXPECT_EQ(row->extra[0], "start");

  row = reader.next();
  ASSERT_NE(row, nullptr);
  EXPECT_TRUE(std::isnan(row->rate_radps[0]));
  EXPECT_TRUE(std::isnan(row->rate_radps[2]));
  EXPECT_TRUE(std::isnan(row->reference_radps[0]));
  EXPECT_TRUE(std::isnan(row->temperature_degc[0]));
  EXPECT_TRUE(std::isnan(row->inputs.supply_v));
  EXPECT_EQ(row->extra[0], "a, b");

  row = reader.next();
  ASSERT_NE(row, nullptr);
  EXPECT_EQ(row->index, 2U);
  EXPECT_EQ(reader.next(), nullptr);
  EXPECT_EQ(reader.next(), nullptr);
}

TEST_F(RecordReading, QuotedTextOfEveryColumnStaysAsLongAsItsRow) {
  const std::string long_text(100, 'l');
  const std::filesystem::path path = write("quoted.csv",
                                           "time_s,first,second,third\n"
                                           "0,\"a, b\",\"c\",\"" +
                                               long_text +
                                               "\"\n"
                                               "1,\"d\",\"e\",plain\n");
  RecordReader reader(path);
  const RecordRow* row = reader.next();
  ASSERT_NE(row, nullptr);
  EXPECT_EQ(row->extra, (std::vector<std::string>{"a, b", "c", long_text}));
  const RecordRow kept = *row;
  row = reader.next();
  ASSERT_NE(row, nullptr);
  EXPECT_EQ(row->extra, (std::vector<std::string>{"d", "e", "plain"}));
  EXPECT_EQ(kept.extra, (std::vector<std::string>{"a, b", "c", long_text}));
}

TEST_F(RecordReading, InspectNamesWhatIsThere) {
  const RecordInfo info = inspect(write("a.csv", kSmallRecord));
  EXPECT_EQ(info.columns.size(), 8U);
  EXPECT_EQ(info.has_rate, (core::PerAxis<bool>{true, false, true}));
  EXPECT_EQ(info.has_reference, (core::PerAxis<bool>{true, false, false}));
  EXPECT_EQ(info.probes, (std::vector<std::string>{"coil", "case"}));
  EXPECT_EQ(info.environment, 1U << 8) << "the supply alone";
  EXPECT_EQ(info.extra_columns, (std::vector<std::string>{"comment"}));
  ASSERT_EQ(info.metadata.size(), 2U);
  EXPECT_EQ(info.metadata[1], (std::pair<std::string, std::string>{"note", "with: colon"}));
  EXPECT_EQ(info.first_time, SensorTime{10'000'000'000});
  EXPECT_EQ(info.sample_period_s, 0.01) << "the second row measures no rate";
  ASSERT_EQ(info.warnings.size(), 1U);
  EXPECT_EQ(info.warnings[0], path("a.csv").string() +
                                  ": columns without a known meaning, kept and not used: comment");
}

TEST_F(RecordReading, IntervalIsTheTimeSinceTheRowBeforeAndTheMedianForTheFirst) {
  RecordReader reader{write("a.csv", "time_s\n0\n1\n2\n5\n")};
  std::vector<double> intervals_s;
  while (const RecordRow* row = reader.next()) intervals_s.push_back(row->interval_s);
  EXPECT_EQ(intervals_s, (std::vector<double>{1.0, 1.0, 1.0, 3.0}));
}

TEST_F(RecordReading, TakesForeignSpellingsOfACsv) {
  const auto file = write("a.csv",
                          "\xEF\xBB\xBF\r\n"
                          "\"time_s\" , \"rate_x_rad_s\",\"a \"\"quoted\"\" name, with comma\"\r\n"
                          " 0.0 , +1.5e-3 ,x\r\n"
                          "\r\n"
                          "\"1\",\" 2 \",\"y\"\"z\"\r\n");
  RecordReader reader{file};
  EXPECT_EQ(reader.info().extra_columns,
            (std::vector<std::string>{"a \"quoted\" name, with comma"}));
  const RecordRow* row = reader.next();
  ASSERT_NE(row, nullptr);
  EXPECT_EQ(row->rate_radps[0], 1.5e-3);
  row = reader.next();
  ASSERT_NE(row, nullptr);
  EXPECT_EQ(row->time, SensorTime{1'000'000'000});
  EXPECT_EQ(row->rate_radps[0], 2.0);
  EXPECT_EQ(row->extra[0], "y\"z");
  EXPECT_EQ(reader.next(), nullptr);
}

TEST_F(RecordReading, MapGivesForeignColumnsTheirMeaningAndCanonicalNamesStillCount) {
  const auto file = write("a.csv",
                          "time_s,stamp,gx,temp,rate_y_deg_s\n"
                          "0,100,10,300,1\n"
                          "0,350,20,301,2\n");
  RecordReader reader{file,
                      {.columns = parse_column_map(
                           "time=stamp[us],rate_x=gx*0.5[deg/s],temperature_coil=temp[K]")}};
  // The map's time wins; the column that is named like one has no meaning then.
  EXPECT_EQ(reader.info().extra_columns, (std::vector<std::string>{"time_s"}));
  const RecordRow* row = reader.next();
  ASSERT_NE(row, nullptr);
  EXPECT_EQ(row->time, SensorTime{100'000});
  EXPECT_EQ(row->rate_radps[0], 10 * (core::kRadPerDeg * 0.5));
  EXPECT_EQ(row->rate_radps[1], core::kRadPerDeg);
  EXPECT_EQ(row->temperature_degc[0], 300 - 273.15);
}

TEST_F(RecordReading, ClockFromACounterColumn) {
  RecordReader reader{write("a.csv", "row,rate_x_rad_s\n7,0\n8,0\n10,0\n"),
                      {.columns = parse_column_map("time=row*0.005")}};
  EXPECT_EQ(times(reader), (std::vector<SensorTime>{SensorTime{35'000'000}, SensorTime{40'000'000},
                                                    SensorTime{50'000'000}}));
}

TEST_F(RecordReading, ClockFromTheRowNumberWhereThereIsNoSuchColumn) {
  RecordReader reader{write("a.csv", "rate_x_rad_s\n1\n1\n1\n"),
                      {.columns = parse_column_map("time=row*10[ms]")}};
  EXPECT_EQ(reader.info().sample_period_s, 0.01);
  EXPECT_EQ(times(reader), (std::vector<SensorTime>{SensorTime{0}, SensorTime{10'000'000},
                                                    SensorTime{20'000'000}}));
}

TEST_F(RecordReading, CompressedRecordsReadLikePlainOnes) {
  for (const char* file : {"a.csv", "a.csv.gz", "a.csv.xz"}) {
    RecordWriter writer{path(file), {.columns = {"time_s", "rate_x_rad_s"}, .metadata = {}}};
    for (int i = 0; i < 20000; ++i) {  // some 500 kB: more than the buffer holds at once
      writer.time(SensorTime{i * 5'000'000LL});
      writer.number(std::sin(i));
      writer.end_row();
    }
    writer.commit();
    RecordReader reader{path(file)};
    int i = 0;
    while (const RecordRow* row = reader.next()) {
      ASSERT_EQ(row->time, SensorTime{i * 5'000'000LL}) << file;
      ASSERT_EQ(row->rate_radps[0], std::sin(i)) << file;
      ++i;
    }
    EXPECT_EQ(i, 20000) << file;
  }
  EXPECT_LT(std::filesystem::file_size(path("a.csv.gz")),
            std::filesystem::file_size(path("a.csv")));
  EXPECT_LT(std::filesystem::file_size(path("a.csv.xz")),
            std::filesystem::file_size(path("a.csv")));
}

TEST_F(RecordReading, LinesLongerThanTheBufferAreRead) {
  const std::string filler(700'000, 'x');
  RecordReader reader{write("a.csv", "time_s,note\n0," + filler + "\n1,short\n")};
  const RecordRow* row = reader.next();
  ASSERT_NE(row, nullptr);
  EXPECT_EQ(row->extra[0], filler);
  row = reader.next();
  ASSERT_NE(row, nullptr);
  EXPECT_EQ(row->extra[0], "short");
}

TEST_F(RecordReading, TwoReadersSeeTheSameBits) {
  const auto file = write("a.csv", kSmallRecord);
  RecordReader first{file};
  RecordReader second{file};
  while (const RecordRow* a = first.next()) {
    const RecordRow* b = second.next();
    ASSERT_NE(b, nullptr);
    EXPECT_EQ(a->time, b->time);
    EXPECT_EQ(std::signbit(a->rate_radps[0]), std::signbit(b->rate_radps[0]));
    if (!std::isnan(a->rate_radps[0])) {
      EXPECT_EQ(a->rate_radps[0], b->rate_radps[0]);
    }
    EXPECT_EQ(a->interval_s, b->interval_s);
  }
}

}  // namespace
}  // namespace zerodrift::record
