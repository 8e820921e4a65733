// SPDX-License-Identifier: Apache-2.0
// Text from records, model files and the command line, made safe for a page or a terminal. All
// O(length).
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "common/core/one_line.h"

namespace zerodrift::report {

using core::one_line;

// one_line(), with & < > " ' replaced: safe in HTML and SVG text and in quoted attributes.
[[nodiscard]] std::string escaped(std::string_view text);

// Characters (code points) of valid UTF-8: the columns it takes on a terminal, for the scripts that
// names and units are written in.
[[nodiscard]] std::size_t character_count(std::string_view text);

// The first characters of one_line(text), at most `longest` (>= 1); what was cut off shows as "…".
[[nodiscard]] std::string shortened(std::string_view text, std::size_t longest);

// Columns of a terminal that everything is set for.
inline constexpr std::size_t kTextWidth = 80;

// Lines of at most `width` characters, broken at blanks; a longer word has a line of its own.
[[nodiscard]] std::string wrapped(std::string_view text, std::size_t width);

}  // namespace zerodrift::report
