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
#include <utility>
#include <vector>

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

// Appends these, in turn: integers, texts, and pairs behind the length of all.
class Appender {
 public:
  explicit Appender(std::string& bytes) noexcept : bytes_(bytes) {}

  template <typename... Values>
  void operator()(const Values&... values) {
    (one(values), ...);
  }

 private:
  template <std::unsigned_integral Integer>
  void one(Integer value) {
    append(bytes_, value);
  }
  void one(std::string_view text) { append_text(bytes_, text); }
  template <typename First, typename Second>
  void one(const std::vector<std::pair<First, Second>>& pairs) {
    std::string content;
    Appender to(content);
    for (const auto& [first, second] : pairs) to(first, second);
    append_text(bytes_, content);
  }

  std::string& bytes_;
};

}  // namespace zerodrift::mcap
