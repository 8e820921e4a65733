// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>

#include "tests/system/child_process.h"
#include "tests/system/mapped_file.h"

namespace zerodrift::system_test {

// The wall clock of the processes that know its file (clock_shift.cpp).
class WallClock {
 public:
  explicit WallClock(const std::filesystem::path& file) : file_(file), shift_(file) {}

  void set_ahead(std::chrono::nanoseconds of_the_true_one) { *shift_ = of_the_true_one.count(); }
  [[nodiscard]] Environment environment() const {
    return {{"LD_PRELOAD", std::string(ZERODRIFT_BIN_DIR) + "/libclock_shift.so"},
            {"ZERODRIFT_CLOCK_SHIFT", file_.string()}};
  }

 private:
  using Shift = std::atomic<std::int64_t>;
  std::filesystem::path file_;
  MappedFile<Shift> shift_;
};

}  // namespace zerodrift::system_test
