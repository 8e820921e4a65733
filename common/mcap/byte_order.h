// SPDX-License-Identifier: Apache-2.0
// Little-endian integers in bytes, on any host.
#pragma once

#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>

namespace zerodrift::mcap {

template <std::unsigned_integral Integer>
[[nodiscard]] inline Integer load(const char* bytes) noexcept {
  if constexpr (std::endian::native == std::endian::little) {
    Integer value;
    std::memcpy(&value, bytes, sizeof value);
    return value;
  }
  std::uint64_t value = 0;
  for (std::size_t i = sizeof(Integer); i-- > 0;)
    value = (value << 8U) | static_cast<unsigned char>(bytes[i]);
  return static_cast<Integer>(value);
}

template <std::unsigned_integral Integer>
inline void append(std::string& bytes, Integer value) {
  char encoded[sizeof(Integer)];
  for (std::size_t i = 0; i < sizeof(Integer); ++i)
    encoded[i] = static_cast<char>(static_cast<std::uint64_t>(value) >> (8U * i));
  bytes.append(encoded, sizeof encoded);
}

// A length of 32 bits, then the bytes.
inline void append_text(std::string& bytes, std::string_view text) {
  append(bytes, static_cast<std::uint32_t>(text.size()));
  bytes.append(text);
}

}  // namespace zerodrift::mcap
