// SPDX-License-Identifier: Apache-2.0
// The compressions of an MCAP chunk: Zstandard, LZ4 in its *frame* format, or none.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace zerodrift::mcap {

enum class Compression : std::uint8_t { kNone, kLz4, kZstd };

// As written in a chunk: "", "lz4", "zstd".
[[nodiscard]] std::string_view name(Compression compression) noexcept;
[[nodiscard]] std::optional<Compression> compression_of(std::string_view name) noexcept;

// Appends to `to`. Throws McapError where the library fails, which takes lack of memory.
void compress(Compression compression, std::string_view bytes, std::string& to);

// False where the bytes are no such compression of exactly `size` bytes. `to` is replaced; at most
// `size` bytes are allocated for it. Throws std::bad_alloc where the library finds no memory.
[[nodiscard]] bool decompress(Compression compression, std::string_view bytes, std::size_t size,
                              std::string& to);

}  // namespace zerodrift::mcap
