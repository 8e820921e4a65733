// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <stdexcept>
#include <string>

#include "tests/system/child_process.h"

namespace zerodrift::system_test {

// The wall clock of the processes that were told of its file (clock_shift.cpp).
class WallClock {
 public:
  explicit WallClock(const std::filesystem::path& file) : file_(file) {
    const int descriptor = ::open(file.c_str(), O_CREAT | O_RDWR | O_CLOEXEC, 0600);
    if (descriptor < 0 || ::ftruncate(descriptor, sizeof(Shift)) != 0)
      throw std::runtime_error("cannot make " + file.string());
    void* memory =
        ::mmap(nullptr, sizeof(Shift), PROT_READ | PROT_WRITE, MAP_SHARED, descriptor, 0);
    ::close(descriptor);
    if (memory == MAP_FAILED) throw std::runtime_error("cannot map " + file.string());
    shift_ = static_cast<Shift*>(memory);
  }
  ~WallClock() { ::munmap(shift_, sizeof(Shift)); }
  WallClock(const WallClock&) = delete;
  WallClock& operator=(const WallClock&) = delete;

  void set_ahead(std::chrono::nanoseconds of_the_true_one) { *shift_ = of_the_true_one.count(); }
  [[nodiscard]] Environment environment() const {
    return {{"LD_PRELOAD", std::string(ZERODRIFT_BIN_DIR) + "/libclock_shift.so"},
            {"ZERODRIFT_CLOCK_SHIFT", file_.string()}};
  }

 private:
  using Shift = std::atomic<std::int64_t>;
  std::filesystem::path file_;
  Shift* shift_ = nullptr;
};

}  // namespace zerodrift::system_test
