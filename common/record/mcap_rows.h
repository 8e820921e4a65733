// SPDX-License-Identifier: Apache-2.0
// A recording of the live topics, or a ROS 2 bag (both MCAP), as rows: rates, temperatures,
// references and environment of one gyro, merged by sensor time (stream_merge.h).
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/record/record_reader.h"
#include "common/record/recorded_messages.h"
#include "common/record/run_numbers.h"
#include "common/record/stream_merge.h"

namespace zerodrift::record {

class McapRows {
 public:
  // Throws files::FileError where there are no such messages, or of several gyros or topics none
  // was chosen.
  McapRows(const std::filesystem::path& path, const RecordOptions& options);
  ~McapRows();
  McapRows(const McapRows&) = delete;  // a row points into it
  McapRows& operator=(const McapRows&) = delete;

  [[nodiscard]] const RecordInfo& info() const noexcept { return info_; }
  // As RecordReader::next(). Ends with the last rate: what thermometers say later is left out, and
  // so is what is stamped far ahead of what comes behind it; a rate of that kind draws nothing
  // along.
  [[nodiscard]] const RecordRow* next();
  // What was found damaged or left out since the last call.
  [[nodiscard]] std::vector<std::string> take_warnings();
  [[nodiscard]] std::uint64_t rows_out_of_order() const noexcept { return rows_out_of_order_; }

 private:
  void open_files(const std::filesystem::path& path);
  void look_ahead();
  void find_columns(MessageStreams& ahead);
  void name_columns();
  void count_what_is_left();
  void fill(core::SensorTime time);
  void number_rate();
  [[nodiscard]] bool is_in_order(core::SensorTime time);

  McapFiles files_;
  RecordInfo info_;
  TimeOrder time_order_;
  std::unique_ptr<RecordedMessages> messages_;
  std::optional<StreamMerge> streams_;
  RecordRow row_;
  RecordedSamples recorded_;
  std::optional<core::SensorTime> previous_time_;
  std::uint64_t rows_ = 0;
  std::uint64_t rates_ = 0;
  RunNumbers numbers_;
  std::vector<ReadingNumbers> reading_numbers_;  // by probe
  std::uint64_t rows_out_of_order_ = 0;
  std::uint64_t left_out_ = 0;                  // readings and references whose time went back
  std::uint64_t after_the_last_ = 0;            // far behind the last rate
  std::vector<std::size_t> reported_findings_;  // by file
  bool is_over_ = false;
  bool reported_left_out_ = false;
  bool reported_missed_ = false;
};

}  // namespace zerodrift::record
