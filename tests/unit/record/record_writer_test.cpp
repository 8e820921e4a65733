// SPDX-License-Identifier: Apache-2.0
#include "common/record/record_writer.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <bit>
#include <cmath>
#include <csignal>
#include <limits>
#include <random>
#include <stdexcept>

#include "common/files/file_error.h"
#include "common/record/record_reader.h"
#include "tests/support/scratch_folder.h"

namespace zerodrift::record {
namespace {

class RecordWriting : public ScratchFolder {};

TEST_F(RecordWriting, WritesTheFormatOfTheReader) {
  RecordWriter writer{
      path("a.csv"), {.columns = {"time_s", "rate_x_rad_s", "a, b"}, .metadata = {{"gyro", "F1"}}}};
  writer.time(core::SensorTime{5'000'000});
  writer.number(0.1);
  writer.text("say \"x\"");
  writer.end_row();
  writer.time(core::SensorTime{10'000'000});
  writer.number(std::nan(""));
  writer.blank();
  writer.end_row();
  writer.commit();
  EXPECT_EQ(content(path("a.csv")),
            "# gyro: F1\n"
            "time_s,rate_x_rad_s,\"a, b\"\n"
            "0.005000000,0.1,\"say \"\"x\"\"\"\n"
            "0.010000000,,\n");
}

TEST_F(RecordWriting, EveryDoubleReadsBackWithTheSameBits) {
  constexpr std::uint64_t kSeed = 21;
  std::mt19937_64 random{kSeed};
  std::vector<double> values{0.0,
                             -0.0,
                             std::numeric_limits<double>::denorm_min(),
                             std::numeric_limits<double>::min(),
                             std::numeric_limits<double>::max(),
                             std::numeric_limits<double>::lowest(),
                             std::numeric_limits<double>::infinity(),
                             0.1,
                             1.0 / 3.0};
  while (values.size() < 20000) {
    const double value = std::bit_cast<double>(random());
    if (!std::isnan(value)) values.push_back(value);
  }
  RecordWriter writer{
      path("a.csv.gz"),
      {.columns = {"time_s", "rate_x_rad_s", "temperature_coil_degC"}, .metadata = {}}};
  for (std::size_t i = 0; i < values.size(); ++i) {
    writer.time(core::SensorTime{static_cast<std::int64_t>(i * i)});
    writer.number(values[i]);
    writer.number(values[i]);
    writer.end_row();
  }
  writer.commit();

  RecordReader reader{path("a.csv.gz")};
  for (std::size_t i = 0; i < values.size(); ++i) {
    const RecordRow* row = reader.next();
    ASSERT_NE(row, nullptr);
    ASSERT_EQ(row->time.count(), static_cast<std::int64_t>(i * i));
    ASSERT_EQ(std::bit_cast<std::uint64_t>(row->rate_radps[0]),
              std::bit_cast<std::uint64_t>(values[i]))
        << values[i] << " seed " << kSeed;
    ASSERT_EQ(std::bit_cast<std::uint64_t>(row->temperature_degc[0]),
              std::bit_cast<std::uint64_t>(values[i]));
  }
  EXPECT_EQ(reader.next(), nullptr);
}

// Before: a stream whose times went back was written as a record that nobody could read, without a
// word.
TEST_F(RecordWriting, SaysOfTimesThatGoBackOrRepeatThatNoRecordIsRead) {
  const auto fault_of = [&](std::initializer_list<int> times_s) {
    RecordWriter writer(path("a.csv"), {.columns = {"time_s"}, .metadata = {}});
    for (const int time_s : times_s) {
      writer.time(std::chrono::seconds(time_s));
      writer.end_row();
    }
    writer.commit();
    return writer.fault_of_times();
  };
  const std::string file = path("a.csv").string() + ": ";
  const std::string end = " s; no command reads such a file as a record";
  EXPECT_EQ(fault_of({}), "");
  EXPECT_EQ(fault_of({-2, -1, 0, 3}), "");
  EXPECT_EQ(
      fault_of({1, 1, 2}),
      file + "1 row with a time that is not after the row before, the first of 1.000000000" + end);
  EXPECT_EQ(
      fault_of({5, 3, 4, 4}),
      file + "2 rows with a time that is not after the row before, the first of 3.000000000" + end);
}

TEST_F(RecordWriting, WithoutCommitNothingIsLeftBehindAndAnOldFileStays) {
  write("a.csv", "old");
  {
    RecordWriter writer{path("a.csv"), {.columns = {"time_s"}, .metadata = {}}};
    EXPECT_EQ(file_count(), 2U);  // the old file and the one being written
  }
  EXPECT_EQ(content(path("a.csv")), "old");
  EXPECT_EQ(file_count(), 1U);
}

TEST_F(RecordWriting, CommitReplacesAnOldFileAndLeavesNothingElse) {
  write("a.csv", "old");
  RecordWriter writer{path("a.csv"), {.columns = {"time_s"}, .metadata = {}}};
  writer.commit();
  EXPECT_EQ(content(path("a.csv")), "time_s\n");
  EXPECT_EQ(file_count(), 1U);
}

TEST_F(RecordWriting, TwoWritersOfOneNameDoNotMix) {
  RecordWriter first{path("a.csv"), {.columns = {"time_s"}, .metadata = {}}};
  RecordWriter second{path("a.csv"), {.columns = {"rate_x_rad_s"}, .metadata = {}}};
  second.commit();
  first.commit();
  EXPECT_EQ(content(path("a.csv")), "time_s\n");
}

TEST_F(RecordWriting, MovedFromWriterLeavesTheFileToTheOther) {
  RecordWriter first{path("a.csv"), {.columns = {"time_s"}, .metadata = {}}};
  RecordWriter second{std::move(first)};
  second.commit();
  EXPECT_EQ(content(path("a.csv")), "time_s\n");
}

TEST_F(RecordWriting, MissingFolderIsRefusedWithTheFilesName) {
  try {
    RecordWriter writer{path("none/a.csv"), {.columns = {"time_s"}, .metadata = {}}};
    FAIL() << "expected files::FileError";
  } catch (const files::FileError& error) {
    EXPECT_EQ(std::string{error.what()},
              path("none/a.csv").string() +
                  ": cannot create a file in its folder: No such file or directory");
  }
}

TEST_F(RecordWriting, MetadataWithALineEndIsRefused) {
  EXPECT_THROW(RecordWriter(path("a.csv"), {.columns = {"time_s"}, .metadata = {{"k", "a\nb"}}}),
               files::FileError);
  EXPECT_EQ(file_count(), 0U);
}

TEST_F(RecordWriting, RowWithAnotherNumberOfCellsIsAProgrammingError) {
  RecordWriter writer{path("a.csv"), {.columns = {"time_s", "rate_x_rad_s"}, .metadata = {}}};
  writer.time(core::SensorTime{0});
  EXPECT_THROW(writer.end_row(), std::logic_error);
}

// A file-size limit stands for the full disk: write() then fails with EFBIG.
TEST_F(RecordWriting, FullDiskIsOneErrorLineAndNoFile) {
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto old_handler = std::signal(SIGXFSZ, SIG_IGN);
  for (const char* file : {"a.csv", "a.csv.gz", "a.csv.xz"}) {
    std::string line;
    {
      RecordWriter writer{path(file), {.columns = {"time_s", "rate_x_rad_s"}, .metadata = {}}};
      const rlimit small{100'000, before.rlim_max};
      ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);
      try {
        std::mt19937_64 random{1};
        for (int i = 0; i < 100'000; ++i) {
          writer.time(core::SensorTime{i});
          writer.number(static_cast<double>(random()));
          writer.end_row();
        }
        writer.commit();
      } catch (const files::FileError& error) {
        line = error.what();
      }
      ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &before), 0);
    }
    EXPECT_EQ(line, path(file).string() + ": writing fails: File too large");
    EXPECT_EQ(file_count(), 0U);
  }
  std::signal(SIGXFSZ, old_handler);
}

}  // namespace
}  // namespace zerodrift::record
