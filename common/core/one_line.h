// SPDX-License-Identifier: Apache-2.0
// Text that anybody may have written (files, records, the network, a command line), made safe for a
// log, a terminal and a page.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace zerodrift::core {

// The text as one line of valid UTF-8, never longer than it was: tabs and line ends become blanks;
// control characters (a terminal obeys them), characters that turn the direction of writing or
// begin another line, and each byte of broken UTF-8 become '?'. O(length).
[[nodiscard]] std::string one_line(std::string_view text);

// The whole characters of one_line(text) that fit into `most_bytes`.
[[nodiscard]] std::string one_line(std::string_view text, std::size_t most_bytes);

// one_line(text) where it fits; else whole words of it, as far as it has blanks, and "...". At
// least 3 bytes.
[[nodiscard]] std::string shortened(std::string_view text, std::size_t most_bytes);

// one_line(text) is `text` itself. Takes no memory.
[[nodiscard]] bool is_one_line(std::string_view text) noexcept;

}  // namespace zerodrift::core
