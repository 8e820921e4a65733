// SPDX-License-Identifier: Apache-2.0
// A thread that reads a file of a sensor from time to time: a 1-wire thermometer takes 0.75 s to
// answer, and one that hangs in the kernel never does. Others have threads of their own.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <string>
#include <thread>

namespace zerodrift::services {

class PeriodicReader {
 public:
  // Calls `read` at once and each `period` from then on, in its own thread; where a reading took
  // longer, at once again, and no reading is made up for.
  PeriodicReader(std::string what, std::chrono::nanoseconds period, std::function<void()> read);

  [[nodiscard]] const std::string& what() const noexcept { return what_; }  // is read
  // For how long a reading is under way that has taken longer than the period; zero: none has. Any
  // thread.
  [[nodiscard]] std::chrono::nanoseconds overdue() const noexcept;

 private:
  void run(const std::stop_token& stop);

  std::string what_;
  std::chrono::nanoseconds period_;
  std::function<void()> read_;
  std::atomic<std::int64_t> began_ns_{0};  // the reading that is under way; 0: none is
  std::jthread thread_;
};

}  // namespace zerodrift::services
