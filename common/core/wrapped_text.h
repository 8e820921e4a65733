// SPDX-License-Identifier: Apache-2.0
// Text set for a terminal. All O(length).
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace zerodrift::core {

// Columns of a terminal that everything is set for.
inline constexpr std::size_t kTextWidth = 80;

// `byte` goes on with a character of UTF-8 that an earlier one began.
[[nodiscard]] constexpr bool is_continuation(char byte) noexcept {
  return (static_cast<unsigned char>(byte) & 0xC0U) == 0x80U;
}

// Characters (code points) of valid UTF-8: the columns it takes on a terminal, for the scripts that
// names and units are written in.
[[nodiscard]] std::size_t character_count(std::string_view text);

// Lines of at most `width` characters, broken at blanks right of `indent`, by which all lines but
// the first begin; a longer word has a line of its own. `text` is one line.
[[nodiscard]] std::string wrapped(std::string_view text, std::size_t width, std::size_t indent = 0);

}  // namespace zerodrift::core
