// SPDX-License-Identifier: Apache-2.0
// What stands before a checkpoint's message, by a code of its own.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "common/checkpoint/checkpoint_bytes.h"

namespace zerodrift::checkpoint::testing {

// CRC-32 of ISO 3309, bit by bit; "123456789" gives 0xCBF43926.
inline std::uint32_t crc32(std::string_view bytes) {
  std::uint32_t crc = 0xFFFFFFFFU;
  for (const char byte : bytes) {
    crc ^= static_cast<unsigned char>(byte);
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1U) ^ ((crc & 1U) != 0 ? 0xEDB88320U : 0U);
  }
  return ~crc;
}

inline void put(std::string& bytes, std::size_t at, std::uint64_t value, std::size_t size) {
  for (std::size_t i = 0; i < size; ++i)
    bytes[at + i] = static_cast<char>((value >> (8 * i)) & 255U);
}

// The envelope as the schema's comment describes it.
inline std::string wrap(const std::string& message, std::uint32_t version = kFormatVersion) {
  std::string bytes = "ZDRIFTCP" + std::string(16, '\0') + message;
  put(bytes, 8, version, 4);
  put(bytes, 16, message.size(), 8);
  put(bytes, 12, crc32(bytes.substr(8, 4) + bytes.substr(16)), 4);
  return bytes;
}

}  // namespace zerodrift::checkpoint::testing
