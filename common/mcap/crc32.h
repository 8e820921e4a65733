// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string_view>

namespace zerodrift::mcap {

// CRC-32 of IEEE 802.3 (reflected polynomial 0xEDB88320, start and end inverted), as MCAP wants it.
// `before`: the CRC of what precedes `bytes`. About 2 GB/s: eight tables, Intel's slicing by 8.
[[nodiscard]] std::uint32_t crc32(std::string_view bytes, std::uint32_t before = 0) noexcept;

}  // namespace zerodrift::mcap
