// SPDX-License-Identifier: Apache-2.0
// Lines of a text file, plain or compressed (.gz, .xz, .zst by suffix), with a fixed buffer: a
// record of any length is read in constant memory.
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string_view>

namespace zerodrift::record {

class LineReader {
 public:
  // Throws files::FileError where the file can't be opened.
  explicit LineReader(const std::filesystem::path& path);
  ~LineReader();
  LineReader(LineReader&&) noexcept;
  LineReader& operator=(LineReader&&) noexcept;

  // The next line without its end (LF or CRLF) and, on the first line, without a UTF-8 byte-order
  // mark. Valid until the next call. False at the end of the file. Throws files::FileError for
  // corrupt compressed data and for a line of more than 1 MiB.
  bool next(std::string_view& line);

  // Of the line that next() gave: its number, from 1, and whether a line end closed it. Only a
  // file's last line can lack one, and then the file may have been cut there.
  [[nodiscard]] std::size_t line_number() const noexcept;
  [[nodiscard]] bool line_was_ended() const noexcept;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace zerodrift::record
