// SPDX-License-Identifier: Apache-2.0
#include "services/zerodrift/paragraph.h"

#include <algorithm>
#include <cstdio>

namespace zerodrift::services {

void print_paragraph(const std::string& text) {
  constexpr std::size_t kTextWidth = 110;
  std::size_t column = 0;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find(' ', begin), text.size());
    const std::size_t length = end - begin;
    if (column > 0) {
      const bool fits = column + 1 + length <= kTextWidth;
      std::putchar(fits ? ' ' : '\n');
      column = fits ? column + 1 : 0;
    }
    std::printf("%.*s", static_cast<int>(length), text.c_str() + begin);
    column += length;
    begin = end + 1;
  }
  std::printf("\n\n");
}

}  // namespace zerodrift::services
