// SPDX-License-Identifier: Apache-2.0
#include "common/core/wrapped_text.h"

#include <algorithm>

namespace zerodrift::core {

std::size_t character_count(std::string_view text) {
  return static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](char byte) { return !is_continuation(byte); }));
}

std::string wrapped(std::string_view text, std::size_t width, std::size_t indent) {
  std::string lines;
  std::size_t used = 0;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find(' ', begin), text.size());
    const std::string_view word = text.substr(begin, end - begin);
    const std::size_t length = character_count(word);
    if (begin > 0) {
      const bool fits = used + 1 + length <= width || used <= indent;
      lines += fits ? " " : '\n' + std::string(indent, ' ');
      used = fits ? used + 1 : indent;
    }
    lines += word;
    used += length;
    begin = end + 1;
  }
  return lines;
}

}  // namespace zerodrift::core
