// SPDX-License-Identifier: Apache-2.0
// State as bytes: a running compensator's for another process, a learner's for a later one. Every
// value in its own width, little-endian, nothing between them. A class lists its state once, for
// both ways:
//
//   void carry(core::StateArchive& archive) { archive(level_, noise_, blocks_); }
//
// What follows from options alone is not carried. The bytes don't say what they are: whoever keeps
// them keeps the number of their layout beside them. Bytes to be read may come from anybody:
// nothing is read beyond them, and ok() says so where something was refused: counts beyond what the
// receiver has room for, flags that are neither 0 nor 1, numbers that are not finite or beyond
// 1e30, times that are neither usable (integer_time.h; here with some room) nor kNever, signed
// integers beyond theirs. What holds between several values, the class requires itself.
#pragma once

#include <array>
#include <bit>
#include <bitset>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "common/core/integer_time.h"
#include "common/core/ring_buffer.h"

namespace zerodrift::core {

static_assert(std::endian::native == std::endian::little && sizeof(std::size_t) == 8,
              "a state is written as a little-endian machine of 64 bits holds it");

class StateArchive {
 public:
  // Most of a number, and of a sum: products of two sums stay finite.
  static constexpr double kLargestNumber = 1e30;
  static constexpr double kLargestSum = 1e100;
  static constexpr std::size_t kLargestCount = std::size_t{1} << 31;

  // Writes: appends to `out`, and allocates where its capacity doesn't suffice.
  explicit StateArchive(std::string& out) : out_(&out) {}
  // Reads. What was read by then is in place even where ok() is false in the end: read into
  // something that can be thrown away.
  explicit StateArchive(std::string_view in) : in_(in) {}

  template <typename... Values>
  void operator()(Values&... values) {
    (one(values), ...);
  }

  // `count` numbers in a row of magnitudes up to `largest`.
  void numbers(double* first, std::size_t count, double largest = kLargestNumber) {
    bytes(first, count * sizeof *first);
    for (std::size_t i = 0; i < count; ++i) require(std::abs(first[i]) <= largest);  // false: NaN
  }
  // Numbers of magnitudes up to kLargestSum.
  template <typename... Values>
  void sums(Values&... values) {
    (numbers(&values, 1, kLargestSum), ...);
  }
  // What is counted once a second or less often: no more than in 68 years, so that one more, and
  // the square, are numbers as well.
  template <typename... Counts>
  void counts(Counts&... values) {
    (one(values), ...);
    (require(values <= kLargestCount), ...);
  }
  // As many values as there are, `most` at most.
  template <typename T>
  void list(std::vector<T>& values, std::size_t most) {
    std::uint64_t size = values.size();
    one(size);
    require(size <= most);
    if (reads()) values.resize(ok_ ? size : 0);
    for (T& value : values) one(value);
  }

  [[nodiscard]] bool reads() const noexcept { return out_ == nullptr; }
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
  // What is computed from a usable time may lie a little beyond. Differences of two still don't
  // overflow.
  static constexpr std::int64_t kLargestTicks = kLatestUsableTime.count() / 8 * 9;

  void bytes(void* value, std::size_t size) {
    if (!reads()) {
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
    } else if constexpr (std::is_same_v<T, double>) {
      numbers(&value, 1);
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
    if (reads()) {
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
