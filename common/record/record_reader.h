// SPDX-License-Identifier: Apache-2.0
// Reads a record row by row, in constant memory. A record is a text file (UTF-8), plain or
// compressed (.csv.gz, .csv.xz, .csv.zst): '# key: value' lines, a header, then one row an instant
// with strictly increasing time. What separates cells and decimals, and whether there is a header,
// is seen in its first lines (text_shape.h). A blank cell, "nan" or "NA" was not measured. Or it is
// an MCAP file of the live topics, known by its first bytes, or a ROS 2 bag in MCAP, one file or a
// folder: a row for each time at which something of one gyro was measured.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/core/axis.h"
#include "common/core/sample_interval.h"
#include "common/core/samples.h"
#include "common/core/time.h"
#include "common/record/column_map.h"
#include "common/record/line_reader.h"
#include "common/record/record_layout.h"
#include "common/record/text_shape.h"

namespace zerodrift::record {

// A column with the number of the rate that a row brings, blank where it brings none.
inline constexpr std::string_view kSequenceColumn = "sequence";

using core::kNoAxisMeasured;
using core::kNotMeasured;

// What was said on the live topics at one time, as it was said.
struct RecordedSamples {
  bool begins_anew = false;  // the clock of the rates was set back before this row
  std::optional<core::AngularRateSample> rate{};
  std::optional<core::RateReferenceSample> reference{};
  // One a probe, in the order of RecordInfo::probes.
  std::vector<std::optional<core::TemperatureSample>> temperatures{};
  std::optional<core::EnvironmentSample> environment{};
};

struct RecordRow {
  std::uint64_t index = 0;  // from 0
  core::SensorTime time{0};
  double interval_s = 0.0;  // since the row before; first row: the sample period
  // Of a text file. The rate that the row brings, or the next one: its number among the rates, and
  // the time that it was measured over (sample_interval.h). A row brings none where the record
  // numbers its rates (a column `sequence`) and has no number in this row.
  std::uint64_t rate = 0;
  double rate_interval_s = 0.0;
  bool has_rate = true;
  core::PerAxis<double> rate_radps = kNoAxisMeasured;  // body frame
  core::PerAxis<double> reference_radps{};  // true, body frame; 0 where there is no such column
  core::Environment inputs;                 // NaN: no such column, or not measured in this row
  std::vector<double> temperature_degc;     // one a probe, in the order of RecordInfo::probes
  std::vector<std::string> extra;  // text of the unknown columns, as RecordInfo::extra_columns
  // Of an MCAP file: which of the above this row brings, with what else is known of it. Null: each
  // row of the record brings all (record_samples.h).
  const RecordedSamples* recorded = nullptr;
};

// Where a row has the value of a column whose role is ColumnRole::kValue.
[[nodiscard]] double& value_of(RecordRow& row, const BoundColumn& column);
[[nodiscard]] inline double value_of(const RecordRow& row, const BoundColumn& column) {
  return value_of(const_cast<RecordRow&>(row), column);
}

// What is known of a record before its rows are read.
struct RecordInfo {
  std::filesystem::path path;
  std::uint32_t gyro_id = 0;         // of an MCAP file: the one whose rows these are
  std::vector<std::string> columns;  // the header, in the file's order; without one "1", "2", ...
  core::PerAxis<bool> has_rate{};
  core::PerAxis<bool> has_reference{};
  std::vector<std::string> probes;            // "coil", "case", ...
  core::EnvironmentChannels environment = 0;  // those of RecordRow::inputs that there are
  std::vector<std::string> extra_columns;     // kept, but without a known meaning
  // '# key: value' lines, in the file's order.
  std::vector<std::pair<std::string, std::string>> metadata;
  core::SensorTime first_time{0};
  double first_interval_s = 0.0;  // RecordRow::interval_s of the first rate, as it is on the topics
  double sample_period_s = 0.0;   // median over the first rows; 0 for a record of one row
  std::vector<std::string> warnings;  // one line each
};

// Which topics of a ROS 2 bag a record is made of.
struct BagTopics {
  std::string rates{};  // of sensor_msgs/msg/Imu; empty: the only one
  // Of sensor_msgs/msg/Temperature, each PROBE=TOPIC, or TOPIC for the probe "coil"; empty: the
  // only one, if there is one.
  std::vector<std::string> temperatures{};

  [[nodiscard]] bool any() const { return !rates.empty() || !temperatures.empty(); }
};

enum class TimeOrder : std::uint8_t {
  kStrictlyIncreasing,  // a row that isn't after the one before is an error: what a record promises
  kAsFound,  // such rows are given out and counted: for putting a faulty stream before the services
};

struct RecordOptions {
  std::vector<ColumnMapping> columns{};  // see parse_column_map()
  TimeOrder time_order = TimeOrder::kStrictlyIncreasing;
  // Of an MCAP file: the gyro. Without, it must hold one gyro alone, or the preferred one.
  std::optional<std::uint32_t> gyro_id{};
  std::optional<std::uint32_t> preferred_gyro_id{};
  BagTopics topics{};              // of a ROS 2 bag
  Rates rates = Rates::kOptional;  // of a text file; an MCAP file always has rates
};

// A record as those who ask for one name it.
struct RecordInput {
  std::string file{};
  std::string columns{};                   // names and units of a foreign CSV: parse_column_map()
  std::optional<std::uint32_t> gyro_id{};  // of an MCAP file that holds several
  BagTopics topics{};                      // of a ROS 2 bag

  // How its file is read: for its rates, without which it is refused. Throws as parse_column_map().
  [[nodiscard]] RecordOptions options() const;
  // Another file, read as this one is.
  [[nodiscard]] RecordInput beside(const std::string& other) const;
};

class McapRows;

class RecordReader {
 public:
  // Reads the header and the first rows. Throws files::FileError.
  explicit RecordReader(const std::filesystem::path& path, RecordOptions options = {});
  ~RecordReader();
  RecordReader(RecordReader&&) noexcept;
  RecordReader& operator=(RecordReader&&) noexcept;

  [[nodiscard]] const RecordInfo& info() const noexcept { return info_; }

  // The next row, valid until the next call; nullptr at the end. A last line that has no line end
  // and isn't a whole row was cut: it is left out and named in warnings(). Throws files::FileError
  // for any other bad row.
  [[nodiscard]] const RecordRow* next();

  // What info() warns of, then what the rows read so far gave rise to. One line each.
  [[nodiscard]] const std::vector<std::string>& warnings() const noexcept { return warnings_; }

  // Rows that were not after the row before; 0 unless TimeOrder::kAsFound lets them pass.
  [[nodiscard]] std::uint64_t rows_out_of_order() const noexcept { return rows_out_of_order_; }

 private:
  enum class PeriodEstimate : std::uint8_t { kMake, kSkip };
  RecordReader(const std::filesystem::path& path, RecordOptions options, PeriodEstimate estimate);

  [[nodiscard]] std::vector<std::string> first_lines();
  void note_metadata(std::string_view comment);
  void take_shape(const std::vector<std::string>& first_lines);
  [[nodiscard]] RecordLayout layout_or_guess(const std::vector<std::string>& first_lines);
  [[nodiscard]] std::string hint_of_other_lines(const std::vector<std::string>& first_lines) const;
  [[nodiscard]] std::string guessed_meaning(const std::vector<std::string>& first_lines) const;
  void describe_layout();
  void estimate_period();

  [[nodiscard]] bool next_data_line(std::string_view& line);
  void decode(std::string_view line);
  void decode_cells(std::string_view line);
  void decode_value(class CellCursor& cursor, const BoundColumn& column);
  [[nodiscard]] std::string_view as_point(std::string_view cell);
  [[nodiscard]] core::SensorTime decode_time(std::string_view cell, const BoundColumn& column);
  [[nodiscard]] std::optional<core::SensorTime> exact_time(std::string_view cell);
  [[nodiscard]] std::optional<core::SensorTime> scaled_time(double count) const;
  void check_order_and_set_interval();
  void number_rate();

  [[noreturn]] void refuse_time(const std::string& found, const BoundColumn* column) const;
  [[noreturn]] void refuse_row(const BoundColumn* column, const std::string& why) const;

  [[nodiscard]] const RecordRow* next_of_csv();
  [[nodiscard]] const RecordRow* next_of_mcap();

  std::unique_ptr<McapRows> mcap_;   // one of
  std::optional<LineReader> lines_;  // these two
  RecordOptions options_;
  RecordInfo info_;
  TextShape shape_;
  DecimalComma decimal_comma_;
  RecordLayout layout_;
  std::string guess_;  // what the columns probably mean, as the end of a line
  RecordRow row_;
  std::optional<std::size_t> sequence_slot_;  // among the extra columns
  core::SampleInterval rate_interval_;
  std::optional<core::SensorTime> previous_time_;
  std::optional<core::SensorTime> previous_rate_time_;
  std::uint64_t rows_read_ = 0;
  std::uint64_t rows_out_of_order_ = 0;
  std::vector<std::string> warnings_;
};

// A quick look: reads the header and the first rows. Throws files::FileError.
[[nodiscard]] RecordInfo inspect(const std::filesystem::path& path,
                                 const RecordOptions& options = {});

}  // namespace zerodrift::record
