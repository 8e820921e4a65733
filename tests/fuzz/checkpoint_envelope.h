// SPDX-License-Identifier: Apache-2.0
// What stands around a checkpoint's message (idl/proto/checkpoint.proto), made for any message, so
// that a fuzzer gets past length and CRC.
#pragma once

#include <boost/crc.hpp>
#include <cstdint>
#include <string>

#include "common/checkpoint/checkpoint_bytes.h"

namespace zerodrift::fuzz {

inline std::string little_endian(std::uint64_t value, int size) {
  std::string bytes;
  for (int i = 0; i < size; ++i) bytes += static_cast<char>(value >> (8 * i) & 255U);
  return bytes;
}

inline std::string in_envelope(const std::string& message) {
  const std::string version = little_endian(zerodrift::checkpoint::kFormatVersion, 4);
  const std::string rest = little_endian(message.size(), 8) + message;
  boost::crc_32_type crc;
  crc.process_bytes(version.data(), version.size());
  crc.process_bytes(rest.data(), rest.size());
  return "ZDRIFTCP" + version + little_endian(crc.checksum(), 4) + rest;
}

}  // namespace zerodrift::fuzz
