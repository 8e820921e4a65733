// SPDX-License-Identifier: Apache-2.0
// What targets demand of a parser.
#pragma once

#include <algorithm>
#include <string>
#include <string_view>

#include "tests/fuzz/targets.h"

namespace zerodrift::fuzz {

inline void demand(bool condition, const char* sentence) {
  if (!condition) throw Broken(sentence);
}

// An error is one line that can be shown: no line ends, no control characters.
inline void demand_one_line(std::string_view error) {
  const bool printable = std::none_of(error.begin(), error.end(), [](char c) {
    return static_cast<unsigned char>(c) < 0x20 || c == '\x7f';
  });
  if (!error.empty() && printable) return;
  throw Broken("an error is one printable line, found '" + std::string(error) + "'");
}

inline std::string_view as_text(Bytes input) {
  return {reinterpret_cast<const char*>(input.data()), input.size()};
}

// Takes the front of `text` up to a line end, which it drops.
inline std::string_view take_line(std::string_view& text) {
  const std::size_t end = text.find('\n');
  const std::string_view line = text.substr(0, end);
  text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  return line;
}

}  // namespace zerodrift::fuzz
