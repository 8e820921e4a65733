// SPDX-License-Identifier: Apache-2.0
// A recording of the live topics (MCAP) as rows: angular_rate, temperature and rate_reference of
// one gyro, merged by sensor time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/mcap/mcap_reader.h"
#include "common/record/cdr_samples.h"
#include "common/record/record_reader.h"

namespace zerodrift::record {

class McapRows {
 public:
  // Throws files::FileError where the file has no such messages, or several gyros and none was
  // chosen.
  McapRows(const std::filesystem::path& path, const RecordOptions& options);
  ~McapRows();
  McapRows(const McapRows&) = delete;  // a row points into it
  McapRows& operator=(const McapRows&) = delete;

  [[nodiscard]] const RecordInfo& info() const noexcept { return info_; }
  // As RecordReader::next(). Ends with the last rate: what thermometers say later is left out.
  [[nodiscard]] const RecordRow* next();
  // What was found damaged or left out since the last call.
  [[nodiscard]] std::vector<std::string> take_warnings();
  [[nodiscard]] std::uint64_t rows_out_of_order() const noexcept { return rows_out_of_order_; }

 private:
  // The messages of one type, and of one probe, in the file's order.
  template <typename Sample>
  class Stream;
  struct Streams;

  void choose_gyro(const RecordOptions& options);
  void scan_for_keys();
  void look_ahead();
  [[nodiscard]] std::unique_ptr<Streams> make_streams();
  void fill(core::SensorTime time);
  [[nodiscard]] bool is_in_order(core::SensorTime time);

  std::shared_ptr<mcap::Reader> reader_;
  RecordInfo info_;
  TimeOrder time_order_;
  using Thermometer = std::pair<std::uint32_t, std::string>;  // gyro and probe
  void add(const Thermometer& thermometer) {
    if (seen_.insert(thermometer).second) thermometers_.push_back(thermometer);
  }
  std::set<std::uint32_t> gyros_;  // with rates
  std::set<Thermometer> seen_;
  std::vector<Thermometer> thermometers_;  // as they come in the file
  std::unique_ptr<Streams> streams_;
  RecordRow row_;
  RecordedSamples recorded_;
  std::optional<core::SensorTime> previous_time_;
  std::optional<core::SensorTime> previous_rate_time_;
  std::uint64_t rows_ = 0;
  std::uint64_t rows_out_of_order_ = 0;
  std::uint64_t left_out_ = 0;  // readings and references whose time went back
  std::size_t findings_told_ = 0;
  bool left_out_told_ = false;
};

}  // namespace zerodrift::record
