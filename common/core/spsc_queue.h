// SPDX-License-Identifier: Apache-2.0
// Bounded queue between exactly one producing and one consuming thread: no lock, no allocation
// after construction.
#pragma once

#include <atomic>
#include <cstddef>
#include <utility>
#include <vector>

namespace zerodrift::core {

template <typename T>
class SpscQueue {
 public:
  explicit SpscQueue(std::size_t capacity) : slots_(capacity + 1) {}

  // Producer. False, and nothing changed, when full.
  bool push(T value) noexcept {
    const std::size_t tail = tail_.load(std::memory_order_relaxed);
    const std::size_t next = following(tail);
    if (next == head_.load(std::memory_order_acquire)) return false;
    slots_[tail] = std::move(value);
    tail_.store(next, std::memory_order_release);
    return true;
  }

  // Consumer. Null when empty; valid until pop().
  [[nodiscard]] T* front() noexcept {
    const std::size_t head = head_.load(std::memory_order_relaxed);
    return head == tail_.load(std::memory_order_acquire) ? nullptr : &slots_[head];
  }

  // Consumer; only after front() gave an element.
  void pop() noexcept {
    head_.store(following(head_.load(std::memory_order_relaxed)), std::memory_order_release);
  }

 private:
  [[nodiscard]] std::size_t following(std::size_t i) const noexcept {
    return i + 1 == slots_.size() ? 0 : i + 1;
  }

  std::vector<T> slots_;
  alignas(64) std::atomic<std::size_t> head_{0};
  alignas(64) std::atomic<std::size_t> tail_{0};
};

}  // namespace zerodrift::core
