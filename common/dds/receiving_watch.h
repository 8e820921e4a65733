// SPDX-License-Identifier: Apache-2.0
// Whether the threads that receive datagrams still come to their next one.
//
// Each says when it begins with a datagram and when it is done, the samples' callbacks included. A
// thread that spins in the middleware, waits for a lock that nobody gives back, or hangs in a
// callback is found by the datagram that it never leaves. No lock, no memory, O(kMostThreads).
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace zerodrift::dds {

class ReceivingWatch {
 public:
  using Time = std::chrono::steady_clock::time_point;

  // From the arrival of a datagram until all is done that it led to.
  class Passage {
   public:
    Passage(ReceivingWatch& watch, Time now) noexcept;
    ~Passage() {
      if (slot_ != nullptr) slot_->store(kFree, std::memory_order_release);
    }
    Passage(const Passage&) = delete;
    Passage& operator=(const Passage&) = delete;

   private:
    std::atomic<std::int64_t>* slot_ = nullptr;  // none: more threads than are watched
  };

  // The begin of the oldest passage that lasts; none: all threads wait for datagrams.
  [[nodiscard]] std::optional<std::int64_t> busy_since_ns() const noexcept;

 private:
  // Two of each participant for its own ports, and some for further interfaces.
  static constexpr std::size_t kMostThreads = 16;
  static constexpr std::int64_t kFree = 0;
  std::array<std::atomic<std::int64_t>, kMostThreads> since_ns_{};
};

// Distinguishes a thread that is stuck from one that is busy, and from a process that stood still:
// counted in rounds of whoever looks, which also stand still with the process.
class StuckCount {
 public:
  static constexpr int kRounds = 20;  // 5 s of the main loop
  // True: the same datagram has been worked on in kRounds rounds without a break.
  bool look(std::optional<std::int64_t> busy_since_ns) noexcept;

 private:
  std::optional<std::int64_t> seen_;
  int rounds_ = 0;
};

}  // namespace zerodrift::dds
