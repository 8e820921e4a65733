// SPDX-License-Identifier: Apache-2.0
// Text from records, model files and the command line, made safe for a page or a terminal. All
// O(length).
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "common/core/one_line.h"
#include "common/core/wrapped_text.h"

namespace zerodrift::report {

using core::character_count;
using core::kTextWidth;
using core::one_line;
using core::wrapped;

// one_line(), with & < > " ' replaced: safe in HTML and SVG text and in quoted attributes.
[[nodiscard]] std::string escaped(std::string_view text);

// The first characters of one_line(text), at most `longest` (>= 1); what was cut off shows as "…".
[[nodiscard]] std::string shortened(std::string_view text, std::size_t longest);

}  // namespace zerodrift::report
