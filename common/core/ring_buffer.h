// SPDX-License-Identifier: Apache-2.0
// Fixed-capacity first-in first-out buffer. Allocates once, in the constructor; one thread.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "common/core/require.h"

namespace zerodrift::core {

template <typename T>
class RingBuffer {
 public:
  explicit RingBuffer(std::size_t capacity) : slots_(capacity) {
    require(capacity > 0, "a ring buffer holds at least one element");
  }

  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  [[nodiscard]] std::size_t capacity() const noexcept { return slots_.size(); }
  [[nodiscard]] bool empty() const noexcept { return size_ == 0; }
  [[nodiscard]] bool full() const noexcept { return size_ == slots_.size(); }

  // False, and nothing changed, when full.
  bool push(T value) noexcept {
    if (full()) return false;
    slots_[wrap(first_ + size_)] = std::move(value);
    ++size_;
    return true;
  }

  // Drops the oldest element when full.
  void push_overwriting(T value) noexcept {
    if (full()) pop();
    push(std::move(value));
  }

  void pop() noexcept {
    require(!empty(), "a ring buffer that is popped holds an element");
    first_ = wrap(first_ + 1);
    --size_;
  }

  void clear() noexcept { first_ = size_ = 0; }

  // 0 is the oldest.
  [[nodiscard]] T& operator[](std::size_t i) noexcept { return slots_[place_of(i)]; }
  [[nodiscard]] const T& operator[](std::size_t i) const noexcept { return slots_[place_of(i)]; }
  [[nodiscard]] T& front() noexcept { return (*this)[0]; }
  [[nodiscard]] const T& front() const noexcept { return (*this)[0]; }
  [[nodiscard]] T& back() noexcept { return (*this)[size_ - 1]; }
  [[nodiscard]] const T& back() const noexcept { return (*this)[size_ - 1]; }

 private:
  [[nodiscard]] std::size_t place_of(std::size_t i) const noexcept {
    require(i < size_, "an element that is read from a ring buffer is in it");
    return wrap(first_ + i);
  }
  [[nodiscard]] std::size_t wrap(std::size_t i) const noexcept {
    return i < slots_.size() ? i : i - slots_.size();
  }

  std::vector<T> slots_;
  std::size_t first_ = 0;
  std::size_t size_ = 0;
};

}  // namespace zerodrift::core
