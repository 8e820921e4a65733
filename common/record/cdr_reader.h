// SPDX-License-Identifier: Apache-2.0
// Plain CDR behind an encapsulation header, either byte order (OMG DDSI-RTPS 2.3, 10.2), as it
// comes from a file that anybody may have written.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string_view>
#include <utility>

#include "common/core/axis.h"

namespace zerodrift::record {

// Takes values from the front, each at a multiple of its size behind the header. After the first
// that isn't there all are 0 and good() is false. Nothing is allocated, whatever a length says.
class CdrReader {
 public:
  explicit CdrReader(std::string_view payload) noexcept {
    constexpr std::size_t kHeader = 4;
    if (payload.size() < kHeader || payload[0] != 0 || (payload[1] != 0 && payload[1] != 1)) {
      good_ = false;
      return;
    }
    is_little_ = payload[1] == 1;
    body_ = payload.substr(kHeader);
  }

  template <typename Value>
  Value take() noexcept {
    const std::size_t at = (position_ + sizeof(Value) - 1) / sizeof(Value) * sizeof(Value);
    if (!good_ || body_.size() < sizeof(Value) || at > body_.size() - sizeof(Value)) {
      good_ = false;
      return Value{};
    }
    char bytes[sizeof(Value)];
    std::memcpy(bytes, body_.data() + at, sizeof bytes);
    if (is_little_ != (std::endian::native == std::endian::little)) {
      for (std::size_t i = 0; i < sizeof bytes / 2; ++i)
        std::swap(bytes[i], bytes[sizeof bytes - 1 - i]);
    }
    position_ = at + sizeof bytes;
    Value value;
    std::memcpy(&value, bytes, sizeof value);
    return value;
  }

  template <std::size_t kCount>
  std::array<double, kCount> take_doubles() noexcept {
    std::array<double, kCount> values{};
    for (double& value : values) value = take<double>();
    return values;
  }
  core::PerAxis<double> take_axes() noexcept { return take_doubles<core::kAxisCount>(); }

  // Up to the first 0, as the generated types give it out. At most `most` bytes before it.
  std::string_view take_text(std::size_t most) noexcept {
    const auto size = take<std::uint32_t>();
    if (!good_ || size > body_.size() - position_ || size > most + 1) {
      good_ = false;
      return {};
    }
    const std::string_view text = body_.substr(position_, size);
    position_ += size;
    return text.substr(0, text.find('\0'));
  }

  [[nodiscard]] bool good() const noexcept { return good_; }

 private:
  std::string_view body_;
  std::size_t position_ = 0;
  bool is_little_ = true;
  bool good_ = true;
};

}  // namespace zerodrift::record
