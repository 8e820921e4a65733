// SPDX-License-Identifier: Apache-2.0
// What is counted of a running service's data path, and of its learner. The library
// data_path_audit.cpp is loaded before a service (LD_PRELOAD) and counts into a file that both it
// and the test have mapped, named by the environment variable below.
//
// A thread is in the service's own code from the return of a take of a rate, temperature or
// reference to the next call into the middleware: what the middleware takes and locks isn't
// counted. The learner is the thread that calls itself "learner".
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

namespace zerodrift::system_test {

inline constexpr const char* kAuditFile = "ZERODRIFT_DATA_PATH_AUDIT";

struct LockSet {
  static constexpr std::size_t kMost = 128;
  std::array<std::atomic<std::uintptr_t>, kMost> locks;  // 0: free
  std::atomic<std::uint64_t> taken;                      // how often, of all
  std::atomic<std::uint64_t> left_out;                   // of locks beyond kMost
};

// All zero at first, as a new file is.
struct DataPathAudit {
  std::atomic<std::uint32_t> armed;         // by the test: counts are of what follows
  std::atomic<std::uint32_t> hold_learner;  // by the test: the learner goes no further

  std::atomic<std::uint64_t> samples;     // rates, temperatures and references in our code
  std::atomic<std::uint64_t> writes;      // of the data path
  std::atomic<std::uint64_t> taken;       // blocks of memory
  std::atomic<std::uint64_t> given_back;  // as well
  std::atomic<std::uint64_t> waits;       // on a futex, other than for a lock
  std::atomic<std::uint64_t> learners;    // threads that called themselves so
  LockSet of_data_path;
  LockSet of_learner;
  std::array<char, 1024> first_finding;  // where memory was taken or given back first
};

}  // namespace zerodrift::system_test
