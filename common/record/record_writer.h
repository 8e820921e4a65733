// SPDX-License-Identifier: Apache-2.0
// Writes a record (.csv; .csv.gz and .csv.xz by suffix) that appears whole or not at all: into a
// temporary file beside the target, then fsync and rename. Numbers are the shortest text that reads
// back to the same bits.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/core/time.h"

namespace zerodrift::record {

// Called from time to time while a file is written, with the share of it that is done, 0 to 1, and
// its bytes so far, before compression.
using WriteShare = std::function<void(double share, std::uint64_t bytes)>;

struct RecordWriterOptions {
  std::vector<std::string> columns;  // the header, at least one
  // '# key: value' lines on top; one line each.
  std::vector<std::pair<std::string, std::string>> metadata;
};

class RecordWriter {
 public:
  // Throws files::FileError where the folder can't be written or the options are wrong.
  RecordWriter(const std::filesystem::path& path, const RecordWriterOptions& options);

  // Without commit() nothing is left behind.
  ~RecordWriter();
  RecordWriter(RecordWriter&&) noexcept;
  RecordWriter& operator=(RecordWriter&&) noexcept;

  // The cells of a row, in the order of the columns. Whoever calls end_row() with another number of
  // cells than columns made a programming error (std::logic_error).
  void time(core::SensorTime time);  // seconds with nine decimals, exact
  void number(double value);         // NaN becomes a blank cell: not measured
  void text(std::string_view cell);
  void blank();
  void end_row();  // throws files::FileError where the disk is full

  // What is wrong with the times so far, as a line; empty where each is after the one before, which
  // a record promises.
  [[nodiscard]] std::string fault_of_times() const;

  // Of text so far, before compression.
  [[nodiscard]] std::uint64_t bytes() const noexcept;

  // Makes the file durable and gives it its name. Throws files::FileError. Nothing may be written
  // after it.
  void commit();

  // After a failure: what was written so far stays under a name of its own, which it gives; empty
  // where nothing could be kept (AtomicFile::keep()).
  std::filesystem::path keep();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace zerodrift::record
