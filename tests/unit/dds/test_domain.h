// SPDX-License-Identifier: Apache-2.0
// A DDS domain for one test: loopback only, and held by a file lock, so that tests that run at the
// same time on one machine never hear each other.
#pragma once

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <stdexcept>
#include <string>
#include <thread>

#include "common/dds/participant.h"

namespace zerodrift::dds {

class TestDomain {
 public:
  explicit TestDomain(std::uint32_t domain) {
    network_.domain = domain;
    const auto path = std::filesystem::temp_directory_path() /
                      ("zerodrift-test-domain-" + std::to_string(domain) + ".lock");
    lock_ = ::open(path.c_str(), O_CREAT | O_RDWR | O_CLOEXEC, 0666);
    if (lock_ < 0 || ::flock(lock_, LOCK_EX) != 0) {
      throw std::runtime_error("cannot lock " + path.string());
    }
  }
  ~TestDomain() { ::close(lock_); }
  TestDomain(const TestDomain&) = delete;
  TestDomain& operator=(const TestDomain&) = delete;

  [[nodiscard]] const NetworkOptions& network() const { return network_; }

 private:
  NetworkOptions network_;
  int lock_;
};

// True as soon as `condition` holds; false if it does not within `at_most`, which bounds a test
// that fails: nothing is timed by it, and a machine may be slow.
inline bool eventually(const std::function<bool()>& condition,
                       std::chrono::milliseconds at_most = std::chrono::seconds(100)) {
  const auto end = std::chrono::steady_clock::now() + at_most;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return true;
}

}  // namespace zerodrift::dds
