// SPDX-License-Identifier: Apache-2.0
// Running state as bytes, for a twin process of the same build: every value in its own width, in
// the machine's byte order, nothing between them. A class lists its state once, for both ways:
//
//   void carry(core::StateArchive& archive) { archive(level_, noise_, blocks_); }
//
// What follows from options alone is not carried. Bytes to be read may come from anybody: nothing
// is read beyond them, and ok() says so where something was refused: counts beyond what the
// receiver has room for, flags that are neither 0 nor 1, numbers that are not finite or beyond
// 1e30, times that are neither usable (integer_time.h; here with some room) nor kNever, signed
// integers beyond theirs. What holds between several values, the class requires itself.
#pragma once

#include <array>
#include <bitset>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>

#include "common/core/integer_time.h"
#include "common/core/ring_buffer.h"

namespace zerodrift::core {

class StateArchive {
 public:
  // Writes: appends to `out`, and allocates where its capacity doesn't suffice.
  explicit StateArchive(std::string& out) : out_(&out) {}
  // Reads. What was read by then is in place even where ok() is false in the end: read into
  // something that can be thrown away.
  explicit StateArchive(std::string_view in) : in_(in) {}

  template <typename... Values>
  void operator()(Values&... values) {
    (one(values), ...);
  }

  // Of what was read: false makes the whole reading fail.
  void require(bool holds) noexcept {
    if (holds) return;
    ok_ = false;
    in_ = {};
  }
  [[nodiscard]] bool ok() const noexcept { return ok_; }
  // Nothing is left to be read.
  [[nodiscard]] bool at_end() const noexcept { return in_.empty(); }

 private:
  static constexpr double kLargestNumber = 1e30;
  // What is computed from a usable time may lie a little beyond. Differences of two still don't
  // overflow.
  static constexpr std::int64_t kLargestTicks = kLatestUsableTime.count() / 8 * 9;

  void bytes(void* value, std::size_t size) {
    if (out_ != nullptr) {
      out_->append(static_cast<const char*>(value), size);
      return;
    }
    require(size <= in_.size());
    if (!ok_) {
      std::memset(value, 0, size);
      return;
    }
    std::memcpy(value, in_.data(), size);
    in_.remove_prefix(size);
  }

  template <typename T>
  void one(T& value) {
    if constexpr (std::is_same_v<T, bool>) {
      std::uint8_t flag = value ? 1 : 0;
      bytes(&flag, 1);
      require(flag <= 1);
      value = flag == 1;
    } else if constexpr (std::is_floating_point_v<T>) {
      bytes(&value, sizeof value);
      require(std::abs(value) <= kLargestNumber);  // false for NaN
    } else if constexpr (std::is_integral_v<T> && std::is_signed_v<T>) {
      bytes(&value, sizeof value);
      require(value >= -kLargestTicks && value <= kLargestTicks);
    } else if constexpr (std::is_integral_v<T> || std::is_enum_v<T>) {
      bytes(&value, sizeof value);
    } else {
      value.carry(*this);
    }
  }
  void one(SensorTime& value) {
    std::int64_t ticks = value.count();
    bytes(&ticks, sizeof ticks);
    value = SensorTime{ticks};
    require(value == kNever || (ticks >= -kLargestTicks && ticks <= kLargestTicks));
  }
  template <typename T, std::size_t kSize>
  void one(std::array<T, kSize>& values) {
    for (T& value : values) one(value);
  }
  template <std::size_t kSize>
  void one(std::bitset<kSize>& bits) {
    for (std::size_t i = 0; i < kSize; ++i) {
      bool bit = bits[i];
      one(bit);
      bits[i] = bit;
    }
  }
  template <typename T>
  void one(std::optional<T>& value) {
    bool there = value.has_value();
    one(there);
    if (there && !value) value.emplace();
    if (!there) value.reset();
    if (value) one(*value);
  }
  template <typename T>
  void one(RingBuffer<T>& ring) {
    std::uint64_t size = ring.size();
    one(size);
    require(size <= ring.capacity());
    if (!ok_) return;
    if (out_ == nullptr) {
      ring.clear();
      while (ring.size() < size) ring.push(T{});
    }
    for (std::size_t i = 0; i < ring.size(); ++i) one(ring[i]);
  }

  std::string* out_ = nullptr;  // null: reads
  std::string_view in_{};
  bool ok_ = true;
};

}  // namespace zerodrift::core
