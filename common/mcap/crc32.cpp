// SPDX-License-Identifier: Apache-2.0
#include "common/mcap/crc32.h"

#include <array>
#include <cstddef>

#include "common/mcap/byte_order.h"

namespace zerodrift::mcap {
namespace {

constexpr std::size_t kSlices = 8;
using Tables = std::array<std::array<std::uint32_t, 256>, kSlices>;

constexpr Tables make_tables() {
  constexpr std::uint32_t kPolynomial = 0xEDB88320U;
  Tables tables{};
  for (std::uint32_t byte = 0; byte < 256; ++byte) {
    std::uint32_t crc = byte;
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1U) ^ ((crc & 1U) != 0 ? kPolynomial : 0U);
    tables[0][byte] = crc;
  }
  for (std::size_t slice = 1; slice < kSlices; ++slice) {
    for (std::size_t byte = 0; byte < 256; ++byte) {
      const std::uint32_t before = tables[slice - 1][byte];
      tables[slice][byte] = (before >> 8U) ^ tables[0][before & 0xFFU];
    }
  }
  return tables;
}

constexpr Tables kTables = make_tables();

}  // namespace

std::uint32_t crc32(std::string_view bytes, std::uint32_t before) noexcept {
  std::uint32_t crc = ~before;
  while (bytes.size() >= kSlices) {
    const std::uint64_t next = load<std::uint64_t>(bytes.data()) ^ crc;
    crc = 0;
    for (std::size_t slice = 0; slice < kSlices; ++slice)
      crc ^= kTables[kSlices - 1 - slice][(next >> (8U * slice)) & 0xFFU];
    bytes.remove_prefix(kSlices);
  }
  for (const char byte : bytes)
    crc = (crc >> 8U) ^ kTables[0][(crc ^ static_cast<unsigned char>(byte)) & 0xFFU];
  return ~crc;
}

}  // namespace zerodrift::mcap
