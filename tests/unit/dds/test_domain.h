// SPDX-License-Identifier: Apache-2.0
// A DDS domain for one test: loopback only, and held by a file lock, so that tests that run at the
// same time on one machine never hear each other.
#pragma once

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <stdexcept>
#include <string>
#include <thread>

#include "common/dds/participant.h"

namespace zerodrift::dds {

// Whoever finds its own domain held by another test takes one of these in its place.
inline constexpr std::uint32_t kFirstSpareDomain = 190;
inline constexpr std::uint32_t kLastSpareDomain = 214;

// Only a test that knows a port of its domain, or writes its number down, has to wait for it.
enum class IfHeld { kTakeASpare, kWait };

class TestDomain {
 public:
  explicit TestDomain(std::uint32_t domain, IfHeld if_held = IfHeld::kTakeASpare) {
    if (take(domain, LOCK_EX | LOCK_NB)) return;
    for (std::uint32_t spare = kFirstSpareDomain;
         if_held == IfHeld::kTakeASpare && spare <= kLastSpareDomain; ++spare) {
      if (take(spare, LOCK_EX | LOCK_NB)) return;
    }
    take(domain, LOCK_EX);
  }
  ~TestDomain() { ::close(lock_); }
  TestDomain(const TestDomain&) = delete;
  TestDomain& operator=(const TestDomain&) = delete;

  [[nodiscard]] const NetworkOptions& network() const { return network_; }

 private:
  // False where another test holds it and LOCK_NB says not to wait.
  bool take(std::uint32_t domain, int how) {
    const auto path = std::filesystem::temp_directory_path() /
                      ("zerodrift-test-domain-" + std::to_string(domain) + ".lock");
    lock_ = ::open(path.c_str(), O_CREAT | O_RDWR | O_CLOEXEC, 0666);
    if (lock_ >= 0 && ::flock(lock_, how) == 0) {
      network_.domain = domain;
      return true;
    }
    const bool is_held = lock_ >= 0 && errno == EWOULDBLOCK;
    if (lock_ >= 0) ::close(lock_);
    if (!is_held) throw std::runtime_error("cannot lock " + path.string());
    return false;
  }

  NetworkOptions network_;
  int lock_ = -1;
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
