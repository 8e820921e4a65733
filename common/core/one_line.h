// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <string>

namespace zerodrift::core {

// The text as one line that a terminal shows as it is: each control character becomes '?'. Errors
// quote what they found, and what they found may be anything.
[[nodiscard]] inline std::string one_line(std::string text) {
  const auto is_control = [](char c) {
    return static_cast<unsigned char>(c) < 0x20 || c == '\x7f';
  };
  std::replace_if(text.begin(), text.end(), is_control, '?');
  return text;
}

}  // namespace zerodrift::core
