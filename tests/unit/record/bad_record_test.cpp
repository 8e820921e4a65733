// SPDX-License-Identifier: Apache-2.0
// Bad input: each kind gives one line that names the file, the line and the column, what was found
// and what would be right.
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <zstd.h>

#include <algorithm>
#include <limits>
#include <memory>
#include <random>

#include "common/files/file_error.h"
#include "common/record/column_guess.h"
#include "common/record/record_reader.h"
#include "common/record/record_writer.h"
#include "tests/support/scratch_folder.h"

namespace zerodrift::record {
namespace {

class BadRecord : public ScratchFolder {
 protected:
  // Reads all of it. What was thrown, without the folder; "<rows> rows" where nothing was.
  std::string outcome(const std::filesystem::path& file, const RecordOptions& options = {}) {
    warnings_.clear();
    std::uint64_t rows = 0;
    try {
      RecordReader reader{file, options};
      while (reader.next() != nullptr) ++rows;
      for (const std::string& warning : reader.warnings())
        warnings_.push_back(without_folder(warning));
    } catch (const files::FileError& error) {
      EXPECT_EQ(std::string{error.what()}.find('\n'), std::string::npos)
          << "more than one line: " << error.what();
      return without_folder(error.what());
    }
    return std::to_string(rows) + " rows";
  }

  std::string outcome_of(std::string_view content, std::string_view columns = "") {
    return outcome(write("a.csv", content), {.columns = parse_column_map(columns)});
  }

  [[nodiscard]] const std::vector<std::string>& warnings() const { return warnings_; }

 private:
  [[nodiscard]] std::string without_folder(std::string text) const {
    const std::string folder = path("").string();
    for (std::size_t at = text.find(folder); at != std::string::npos; at = text.find(folder))
      text.erase(at, folder.size());
    return text;
  }

  std::vector<std::string> warnings_;
};

// What a spreadsheet saves as "Unicode text": in either order of bytes, with a mark and without.
TEST_F(BadRecord, TextInUtf16IsNamedWithTheWayToReadIt) {
  const std::string text = "time_s,rate_x_deg_h\n0,1\n1,2\n";
  for (const bool little_endian : {true, false}) {
    for (const bool marked : {true, false}) {
      std::string wide = !marked ? "" : little_endian ? "\xFF\xFE" : "\xFE\xFF";
      for (const char letter : text)
        wide += little_endian ? std::string{letter, '\0'} : std::string{'\0', letter};
      EXPECT_EQ(
          outcome_of(wide),
          "a.csv: text in UTF-16; a record is UTF-8: 'iconv -f UTF-16 -t UTF-8' makes it that")
          << little_endian << marked;
    }
  }
}

TEST_F(BadRecord, MissingFile) {
  EXPECT_EQ(outcome(path("b.csv")), "b.csv: cannot open: No such file or directory");
}

TEST_F(BadRecord, FolderInsteadOfAFile) {
  std::filesystem::create_directory(path("d.csv"));
  EXPECT_EQ(outcome(path("d.csv")),
            "d.csv: is a folder without metadata.yaml, expected a file, or the folder of a ROS 2 "
            "bag (`ros2 bag reindex` writes a lost metadata.yaml)");
}

// A record is read more than once, and opening a pipe that nobody writes would wait for good.
TEST_F(BadRecord, APipeOrADevice) {
  ASSERT_EQ(::mkfifo(path("p.csv").c_str(), 0600), 0);
  EXPECT_EQ(outcome(path("p.csv")), "p.csv: is a pipe, expected a regular file");
  EXPECT_EQ(outcome("/dev/zero"), "/dev/zero: is a device, expected a regular file");
  ASSERT_EQ(::mkfifo(path("p.mcap").c_str(), 0600), 0);
  EXPECT_EQ(outcome(path("p.mcap")), "p.mcap: is no regular file, expected one");
}

TEST_F(BadRecord, OtherFormat) {
  EXPECT_EQ(outcome(write("a.mcap", "x")),
            "a.mcap: is no MCAP file: it doesn't begin with MCAP's magic");
}

TEST_F(BadRecord, EmptyFile) {
  EXPECT_EQ(outcome_of(""), "a.csv: is empty; expected a header line with the columns' names");
  EXPECT_EQ(outcome_of("# only: this\n\n"),
            "a.csv: is empty; expected a header line with the columns' names");
}

TEST_F(BadRecord, HeaderWithoutRows) {
  EXPECT_EQ(outcome_of("time_s,rate_x_deg_h\n"),
            "a.csv: has a header but no row; expected at least one row of 2 cells");
}

TEST_F(BadRecord, NoTime) {
  EXPECT_EQ(outcome_of("a,b\n1,2\n"),
            "a.csv: no column is the time (time_s); name one by --columns 'time=<column>[s]' or "
            "'time=row*<seconds>'; the columns are: a, b");
}

TEST_F(BadRecord, MappedColumnIsNotThere) {
  EXPECT_EQ(outcome_of("time_s,gyro_x\n1,2\n", "rate_x=gyro_w[rad/s]"),
            "a.csv: no column 'gyro_w', which --columns names for rate_x; the columns are: time_s, "
            "gyro_x");
}

TEST_F(BadRecord, MappedColumnIsThereTwice) {
  EXPECT_EQ(
      outcome_of("time_s,g,g\n1,2,3\n", "rate_x=g[rad/s]"),
      "a.csv: column 'g', which --columns names, is there twice; the columns are: time_s, g, g");
}

TEST_F(BadRecord, OneColumnMappedToTwoChannels) {
  EXPECT_EQ(outcome_of("time_s,g\n1,2\n", "rate_x=g[rad/s],rate_y=g[rad/s]"),
            "a.csv: --columns maps column 'g' to both rate_x and rate_y; a column has one meaning");
}

TEST_F(BadRecord, TwoColumnsOfOneChannel) {
  EXPECT_EQ(outcome_of("time_s,rate_x_deg_h,rate_x_rad_s\n1,2,3\n"),
            "a.csv: columns 'rate_x_deg_h' and 'rate_x_rad_s' are both rate_x; keep one, or choose "
            "by --columns; a guess, not used: --columns "
            "'time=time_s[s],rate_x=rate_x_deg_h[deg/h]'");
}

// What is guessed is copied to a command line, whoever wrote the file: its names command neither
// the terminal nor the shell.
TEST_F(BadRecord, AGuessHoldsNoNameThatCommandsATerminalOrAShell) {
  for (const std::string evil : {"'; reboot; '", "\x1b[2J", "\x7f", "\x9b", "\xff"}) {
    const std::string guess = guessed_columns({"t", "gyro_x" + evil, "gyro_z"}, {"1", "2", "3"});
    EXPECT_EQ(guess.find("--columns 'time=t[s],rate_z=gyro_z[deg/s]'"), 0U) << guess;
    EXPECT_EQ(guess.find(evil), std::string::npos) << guess;
  }
}

TEST_F(BadRecord, UnknownUnitOfAKnownQuantity) {
  EXPECT_EQ(outcome_of("time_s,rate_x_rpm\n1,2\n"),
            "a.csv: column 'rate_x_rpm': unknown unit 'rpm' of rate_x; accepted: rad/s deg/s deg/h "
            "(in a column's name "
            "'_' stands for '/'); or map it by --columns 'rate_x=rate_x_rpm[<unit>]'");
  EXPECT_EQ(outcome_of("time_s,temperature_coil_degR\n1,2\n").substr(0, 75),
            "a.csv: column 'temperature_coil_degR': unknown unit 'degR' of temperature_c");
}

TEST_F(BadRecord, UnknownUnitBesideTheSameChannelInAKnownOneIsOnlyAnExtraColumn) {
  EXPECT_EQ(outcome_of("time_s,time_of_day\n1,12:00\n"), "1 rows");
  ASSERT_EQ(warnings().size(), 1U);
  EXPECT_EQ(warnings()[0],
            "a.csv: columns without a known meaning, kept and not used: time_of_day");
}

TEST_F(BadRecord, WordInANumberCell) {
  EXPECT_EQ(
      outcome_of("time_s,rate_x_deg_h\n1,2\n2,off\n3,4\n"),
      "a.csv:3: column 'rate_x_deg_h': found 'off', expected a number (blank = not measured)");
  EXPECT_EQ(
      outcome_of("time_s,rate_x_deg_h\n1,2\n2,1.5V\n3,4\n"),
      "a.csv:3: column 'rate_x_deg_h': found '1.5V', expected a number (blank = not measured)");
}

// Before: `"2"3` was 23, and so was a quote that never closes.
TEST_F(BadRecord, TextBehindAClosingQuoteOrAQuoteThatNeverClosesIsNoNumber) {
  for (const std::string cell :
       {"\"2\"3", "\"2\" 3", "\"2\"\"", "\"2\".5", "\"\"2", "\"2\"e3", "\"\"nan", "\"23", "\"2 "}) {
    const std::string found = cell.substr(0, cell.find_last_not_of(' ') + 1);
    EXPECT_EQ(outcome_of("time_s,rate_x_deg_h\n1,2\n2," + cell + "\n3,4\n"),
              "a.csv:3: column 'rate_x_deg_h': found '" + found +
                  "', expected a number (blank = not measured)");
    EXPECT_EQ(
        outcome_of("rate_x_deg_h;time_s\n1;2\n2;" + cell + "\n"),
        "a.csv:3: column 'time_s': found '" + found + "', expected a time: every row needs one");
  }
  EXPECT_EQ(outcome_of("time_s,rate_x_deg_h\n1,\"2\"\n2, \"3\" \n3,\"\"\n"), "3 rows");
}

TEST_F(BadRecord, WordInTheTimeCell) {
  EXPECT_EQ(outcome_of("time_s,rate_x_deg_h\nnoon,2\n"),
            "a.csv:2: column 'time_s': found 'noon', expected a time: every row needs one");
  EXPECT_EQ(outcome_of("time_s,rate_x_deg_h\n,2\n"),
            "a.csv:2: column 'time_s': found '', expected a time: every row needs one");
  EXPECT_EQ(outcome_of("time_s,rate_x_deg_h\nnan,2\n"),
            "a.csv:2: column 'time_s': found 'nan', expected a time: every row needs one");
}

// Beyond 2^61 ns sums and differences of two times overflow, and no sample would be compensated:
// seconds since 1904, as LabVIEW counts them, are beyond it.
TEST_F(BadRecord, ATimeBeyondTheUsableOnesInEveryUnitIsRefused) {
  const std::string bound =
      ", expected a time within ±2305843009 s (73 years): seconds from the record's start, or "
      "since "
      "1970; is the unit right?";
  for (const char* time : {"3850000000.000", "2305843009.213693953", "-2305843010", "1e12", "-4e9",
                           "9223372036.854775808", "99999999999999999999"}) {
    EXPECT_EQ(outcome_of("time_s\n" + std::string(time) + "\n"),
              "a.csv:2: column 'time_s': found '" + std::string(time) + "'" + bound);
  }
  EXPECT_EQ(outcome_of("t\n2305843009213693953\n", "time=t[ns]"),
            "a.csv:2: column 't': found '2305843009213693953'" + bound);
  EXPECT_EQ(outcome_of("t\n3850000000000\n", "time=t[ms]"),
            "a.csv:2: column 't': found '3850000000000'" + bound);
  EXPECT_EQ(outcome_of("t\n2\n", "time=t*2e9[s]"), "a.csv:2: column 't': found '2'" + bound);
  EXPECT_EQ(outcome_of("x\n1\n2\n3\n", "time=row*2e9[s]"), "a.csv:4: found 'row 2'" + bound);
  for (const std::string date : {"2043-01-26T00:00:00Z", "1896-12-06T00:00:00Z"}) {
    EXPECT_EQ(
        outcome_of("t\n" + date + "\n", "time=t[iso8601]"),
        "a.csv:2: column 't': found '" + date + "', expected a date from 1896-12-07 to 2043-01-25");
  }
}

TEST_F(BadRecord, TheLastUsableTimesAreTaken) {
  EXPECT_EQ(outcome_of("time_s\n-2305843009.213693952\n0\n2305843009.213693952\n"), "3 rows");
  EXPECT_EQ(outcome_of("t\n1896-12-07T00:00:00Z\n2043-01-25T23:59:59+00:10\n", "time=t[iso8601]"),
            "2 rows");
}

TEST_F(BadRecord, WrongCellCount) {
  EXPECT_EQ(outcome_of("time_s,rate_x_deg_h\n1,2\n2\n3,4\n"),
            "a.csv:3: found 1 cells, the header has 2");
  EXPECT_EQ(outcome_of("time_s,rate_x_deg_h\n1,2\n2,3,4\n3,4\n"),
            "a.csv:3: found 3 cells, the header has 2");
  EXPECT_EQ(outcome_of("time_s;rate_x_deg_h\n1;2;3\n"), "a.csv:2: found 3 cells, the header has 2");
}

TEST_F(BadRecord, TimeThatStandsStillOrRunsBack) {
  EXPECT_EQ(outcome_of("time_s\n1\n2\n2\n"),
            "a.csv:4: time 2.000000000 s is not after the row before (2.000000000 s); a record's "
            "time strictly increases: put what has one time into one row, or number the rows where "
            "stamps are too coarse (--columns 'time=row*<seconds>')");
  EXPECT_EQ(
      outcome_of("time_s\n1\n2\n1.5\n3\n"),
      "a.csv:4: time 1.500000000 s is not after the row before (2.000000000 s); a record's "
      "time strictly increases: sort its rows by time, or split it where its clock or counter "
      "began anew");
}

TEST_F(BadRecord, TimeThatRunsBackPassesWhereItIsAskedFor) {
  RecordReader reader{write("a.csv", "time_s\n1\n2\n3\n3\n2.5\n3.5\n"),
                      {.columns = {}, .time_order = TimeOrder::kAsFound}};
  std::vector<double> intervals_s;
  while (const RecordRow* row = reader.next()) intervals_s.push_back(row->interval_s);
  // The sample period where the difference is no interval.
  EXPECT_EQ(intervals_s, std::vector<double>(6, 1.0));
  EXPECT_EQ(reader.rows_out_of_order(), 2U);
}

TEST_F(BadRecord, CutLastLineIsLeftOutAndNamed) {
  EXPECT_EQ(outcome_of("time_s,rate_x_deg_h,rate_y_deg_h\n1,2,3\n2,3,4\n3,4"), "2 rows");
  ASSERT_EQ(warnings().size(), 1U);
  EXPECT_EQ(
      warnings()[0],
      "a.csv:4: found 2 cells, the header has 3; the file ends within this row, which is left out");

  EXPECT_EQ(outcome_of("time_s,rate_x_deg_h\n1,2\n2,3e-"), "1 rows");
  ASSERT_EQ(warnings().size(), 1U);
  EXPECT_EQ(warnings()[0],
            "a.csv:3: column 'rate_x_deg_h': found '3e-', expected a number (blank = not "
            "measured); the file ends within "
            "this row, which is left out");
}

TEST_F(BadRecord, WholeLastLineWithoutALineEndIsTakenAndNamed) {
  EXPECT_EQ(outcome_of("time_s,rate_x_deg_h\n1,2\n2,3"), "2 rows");
  ASSERT_EQ(warnings().size(), 1U);
  EXPECT_EQ(warnings()[0], "a.csv:3: the last row has no line end; taken as whole");
}

// Law: cut anywhere behind the first row, a record gives its whole rows and says that it was cut.
TEST_F(BadRecord, CutAnywhereItGivesItsWholeRows) {
  const std::string whole = "time_s,rate_x_deg_h\n1.5,-2.25\n2.5,3.5e-3\n3.5,4\n";
  for (std::size_t size = whole.find('\n') + 11; size < whole.size(); ++size) {
    const std::string cut = whole.substr(0, size);
    const auto ended_rows =
        static_cast<std::uint64_t>(std::count(cut.begin(), cut.end(), '\n')) - 1;
    RecordReader reader{write("a.csv", cut)};
    std::uint64_t rows = 0;
    while (reader.next() != nullptr) ++rows;
    EXPECT_GE(rows, ended_rows) << size;
    EXPECT_EQ(reader.warnings().empty(), cut.ends_with('\n')) << size;
    EXPECT_LE(rows, ended_rows + 1) << size;
  }
}

TEST_F(BadRecord, InfinityIsANumberForTheConsumerToRefuse) {
  RecordReader reader{write("a.csv", "time_s,rate_x_rad_s\n1,inf\n")};
  const RecordRow* row = reader.next();
  ASSERT_NE(row, nullptr);
  EXPECT_EQ(row->rate_radps[0], std::numeric_limits<double>::infinity());
}

TEST_F(BadRecord, LineWithoutEnd) {
  EXPECT_EQ(outcome_of("time_s,note\n1," + std::string(3'000'000, 'x')).substr(0, 36),
            "a.csv:2: a line of more than 1 MiB; ");
}

TEST_F(BadRecord, BinaryGarbageGivesOneLine) {
  constexpr std::uint64_t kSeed = 5;
  std::mt19937_64 random{kSeed};
  for (int trial = 0; trial < 200; ++trial) {
    std::string garbage = trial % 2 == 0 ? "" : "time_s,rate_x_deg_h\n";
    for (int i = 0; i < 300; ++i) garbage += static_cast<char>(random() & 0xFF);
    garbage += '\n';
    EXPECT_TRUE(outcome_of(garbage).starts_with("a.csv:"))
        << "seed " << kSeed << " trial " << trial;
  }
}

class BadCompressedRecord : public BadRecord, public ::testing::WithParamInterface<const char*> {
 protected:
  std::string compressed() {
    const bool by_zstd = std::string{GetParam()}.ends_with(".zst");
    const std::filesystem::path file = path(by_zstd ? "plain.csv" : GetParam());
    RecordWriter writer{file, {.columns = {"time_s", "rate_x_rad_s"}, .metadata = {}}};
    std::mt19937_64 random{1};
    for (int i = 0; i < 50000; ++i) {
      writer.time(core::SensorTime{i});
      writer.number(static_cast<double>(random()));
      writer.end_row();
    }
    writer.commit();
    return by_zstd ? zstd(content(file)) : content(file);
  }

  // As the program of that name does: with a check sum.
  static std::string zstd(const std::string& text) {
    const std::unique_ptr<ZSTD_CCtx, decltype(&ZSTD_freeCCtx)> stream{ZSTD_createCCtx(),
                                                                      ZSTD_freeCCtx};
    ZSTD_CCtx_setParameter(stream.get(), ZSTD_c_checksumFlag, 1);
    std::string bytes(ZSTD_compressBound(text.size()), '\0');
    bytes.resize(
        ZSTD_compress2(stream.get(), bytes.data(), bytes.size(), text.data(), text.size()));
    return bytes;
  }

  void expect_refused() {
    const std::string line = outcome(path(GetParam()));
    EXPECT_NE(
        line.find(std::string{GetParam()} + ": the compressed data is corrupt or cut behind line"),
        std::string::npos)
        << line;
  }
};

TEST_P(BadCompressedRecord, CutFile) {
  const std::string whole = compressed();
  for (const std::size_t size :
       {std::size_t{0}, std::size_t{7}, whole.size() / 2, whole.size() - 1}) {
    write(GetParam(), whole.substr(0, size));
    expect_refused();
  }
}

// gzip proves its contents only at the end, so wrong rows may be met, and refused, before.
TEST_P(BadCompressedRecord, OneBitFlipped) {
  std::string bytes = compressed();
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 0x10);
  write(GetParam(), bytes);
  EXPECT_TRUE(outcome(path(GetParam())).starts_with(std::string{GetParam()} + ":"));
}

TEST_P(BadCompressedRecord, PlainTextUnderTheName) {
  write(GetParam(), "time_s\n1\n2\n");
  expect_refused();
}

TEST_P(BadCompressedRecord, TwoStreamsInARowAreOneRecordToTheLastRow) {
  const std::string whole = compressed();
  write(GetParam(), whole);
  EXPECT_EQ(outcome(path(GetParam())), "50000 rows");
  write(GetParam(), whole + whole);
  const std::string line = outcome(path(GetParam()));
  EXPECT_NE(line.find(":50002: column 'time_s': found 'time_s'"), std::string::npos) << line;
}

TEST_F(BadRecord, ARecordIsNotWrittenByZstd) {
  EXPECT_THROW((RecordWriter{path("a.csv.zst"), {.columns = {"time_s"}, .metadata = {}}}),
               files::FileError);
  EXPECT_FALSE(std::filesystem::exists(path("a.csv.zst")));
}

INSTANTIATE_TEST_SUITE_P(EachCompression, BadCompressedRecord,
                         ::testing::Values("a.csv.gz", "a.csv.xz", "a.csv.zst"),
                         [](const auto& suite) { return std::string{suite.param}.substr(6); });

}  // namespace
}  // namespace zerodrift::record
