// SPDX-License-Identifier: Apache-2.0
// What arrives from the system, on its way to the gateway's thread. The middleware's threads push
// and go on: they never wait for a client or for encoding.
#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>
#include <utility>
#include <vector>

namespace zerodrift::services {

// Bounded. The lock is held for as long as it takes to push one message or to swap two vectors.
template <typename T>
class Mailbox {
 public:
  explicit Mailbox(std::size_t capacity) : capacity_(capacity) {}

  // What doesn't fit is counted.
  void push(T message) {
    const std::lock_guard lock(mutex_);
    if (messages_.size() < capacity_) {
      messages_.push_back(std::move(message));
    } else {
      overflow_.fetch_add(1, std::memory_order_relaxed);
    }
  }
  std::vector<T> take() {
    std::vector<T> taken;
    const std::lock_guard lock(mutex_);
    taken.swap(messages_);
    return taken;
  }
  [[nodiscard]] std::uint64_t overflow() const { return overflow_.load(std::memory_order_relaxed); }

 private:
  std::size_t capacity_;
  std::mutex mutex_;
  std::vector<T> messages_;
  std::atomic<std::uint64_t> overflow_{0};
};

}  // namespace zerodrift::services
