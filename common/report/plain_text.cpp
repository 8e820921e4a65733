// SPDX-License-Identifier: Apache-2.0
#include "common/report/plain_text.h"

#include <algorithm>

namespace zerodrift::report {
namespace {

constexpr std::string_view kEllipsis = "\xE2\x80\xA6";  // U+2026

bool is_continuation(char byte) {
  return (static_cast<unsigned char>(byte) & 0xC0U) == 0x80U;
}

std::string_view entity(char symbol) {
  switch (symbol) {
    case '&': return "&amp;";
    case '<': return "&lt;";
    case '>': return "&gt;";
    case '"': return "&quot;";
    case '\'': return "&#39;";
    default: return {};
  }
}

}  // namespace

std::string escaped(std::string_view text) {
  std::string safe;
  for (const char symbol : one_line(text)) {
    if (const std::string_view replacement = entity(symbol); !replacement.empty()) {
      safe += replacement;
    } else {
      safe += symbol;
    }
  }
  return safe;
}

std::size_t character_count(std::string_view text) {
  return static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](char byte) { return !is_continuation(byte); }));
}

std::string shortened(std::string_view text, std::size_t longest) {
  std::string line = one_line(text);
  if (character_count(line) <= longest) return line;
  std::size_t end = 0;
  for (std::size_t kept = 0; kept + 1 < longest; ++kept) {
    do {
      ++end;
    } while (is_continuation(line[end]));
  }
  return line.substr(0, end).append(kEllipsis);
}

std::string wrapped(std::string_view text, std::size_t width) {
  std::string lines;
  std::size_t used = 0;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find(' ', begin), text.size());
    const std::string_view word = text.substr(begin, end - begin);
    const std::size_t length = character_count(word);
    const bool fits = used + 1 + length <= width;
    if (used > 0) lines += fits ? ' ' : '\n';
    used = used > 0 && fits ? used + 1 + length : length;
    lines += word;
    begin = end + 1;
  }
  return lines;
}

}  // namespace zerodrift::report
