// SPDX-License-Identifier: Apache-2.0
#include "common/report/plain_text.h"

namespace zerodrift::report {
namespace {

constexpr std::string_view kEllipsis = "\xE2\x80\xA6";  // U+2026

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

std::string shortened(std::string_view text, std::size_t longest) {
  std::string line = one_line(text);
  if (character_count(line) <= longest) return line;
  std::size_t end = 0;
  for (std::size_t kept = 0; kept + 1 < longest; ++kept) {
    do {
      ++end;
    } while (core::is_continuation(line[end]));
  }
  return line.substr(0, end).append(kEllipsis);
}

}  // namespace zerodrift::report
