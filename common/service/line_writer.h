// SPDX-License-Identifier: Apache-2.0
// Lines for a file descriptor, written by a thread of their own: who says something never waits for
// who reads it. (O_NONBLOCK is no way: an inherited descriptor shares it with other processes.)
#pragma once

#include <chrono>
#include <cstddef>
#include <memory>
#include <string_view>

namespace zerodrift::service {

class LineWriter {
 public:
  explicit LineWriter(int descriptor);
  // Gives up what was not written; a thread that is blocked in a write stays so until the reader
  // goes on, and holds nothing of this object.
  ~LineWriter();
  LineWriter(const LineWriter&) = delete;
  LineWriter& operator=(const LineWriter&) = delete;

  // Any thread. The text as one clean line (core/one_line.h) of at most kLongest bytes. Where
  // kMostWaiting lines wait, it is dropped; how many were is a line of its own once half of them
  // are written.
  void write(std::string_view text);
  // True once nothing waits to be written; false where the reader takes nothing for so long. Time
  // for which the writing thread wasn't given the processor doesn't count.
  bool wait_until_written(std::chrono::milliseconds at_most);

  static constexpr std::size_t kLongest = 4095;  // with its end PIPE_BUF: whole or not at all
  static constexpr std::size_t kMostWaiting = 512;

 private:
  struct Shared;
  int descriptor_;
  std::shared_ptr<Shared> shared_;
};

// Of standard error. It lives as long as the process.
LineWriter& standard_error();

// The longest that a process which ends waits for a reader who takes none of its last lines.
inline constexpr std::chrono::milliseconds kLastLinesWithin{200};

}  // namespace zerodrift::service
