// SPDX-License-Identifier: Apache-2.0
#include "common/report/plain_text.h"

#include <algorithm>

namespace zerodrift::report {
namespace {

constexpr std::string_view kReplacement = "\xEF\xBF\xBD";  // U+FFFD
constexpr std::string_view kEllipsis = "\xE2\x80\xA6";     // U+2026

unsigned byte_at(std::string_view text, std::size_t at) {
  return static_cast<unsigned char>(text[at]);
}

bool is_continuation(unsigned byte) {
  return (byte & 0xC0U) == 0x80U;
}

// Bytes that the character at the front of `text` says it has; 0 where none begins so.
std::size_t announced_length(unsigned first) {
  if (first < 0x80U) return 1;
  if (first >= 0xC2U && first <= 0xDFU) return 2;
  if ((first & 0xF0U) == 0xE0U) return 3;
  if (first >= 0xF0U && first <= 0xF4U) return 4;
  return 0;
}

// The second byte rules out overlong forms, surrogates and what lies above U+10FFFF.
bool is_second_byte_allowed(unsigned first, unsigned second) {
  if (first == 0xE0U) return second >= 0xA0U;
  if (first == 0xEDU) return second < 0xA0U;
  if (first == 0xF0U) return second >= 0x90U;
  if (first == 0xF4U) return second < 0x90U;
  return true;
}

// Bytes of the valid character at the front of `text`, or 0 (RFC 3629, section 4).
std::size_t character_length(std::string_view text) {
  const unsigned first = byte_at(text, 0);
  const std::size_t length = announced_length(first);
  if (length == 0 || length > text.size()) return 0;
  for (std::size_t i = 1; i < length; ++i) {
    if (!is_continuation(byte_at(text, i))) return 0;
  }
  return length < 2 || is_second_byte_allowed(first, byte_at(text, 1)) ? length : 0;
}

// C0, DEL and C1.
bool is_control(std::string_view character) {
  const unsigned first = byte_at(character, 0);
  if (character.size() == 1) return first < 0x20U || first == 0x7FU;
  return first == 0xC2U && byte_at(character, 1) < 0xA0U;
}

bool is_blank(std::string_view character) {
  return character == "\t" || character == "\n" || character == "\r";
}

std::string_view entity(char symbol) {
  switch (symbol) {
    case '&':
      return "&amp;";
    case '<':
      return "&lt;";
    case '>':
      return "&gt;";
    case '"':
      return "&quot;";
    case '\'':
      return "&#39;";
    default:
      return {};
  }
}

}  // namespace

std::string one_line(std::string_view text) {
  std::string line;
  line.reserve(text.size());
  while (!text.empty()) {
    const std::size_t length = character_length(text);
    const std::string_view character = text.substr(0, std::max<std::size_t>(length, 1));
    text.remove_prefix(character.size());
    if (is_blank(character)) {
      line += ' ';
    } else if (length == 0 || is_control(character)) {
      line += kReplacement;
    } else {
      line += character;
    }
  }
  return line;
}

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
  return static_cast<std::size_t>(std::count_if(text.begin(), text.end(), [](char byte) {
    return !is_continuation(static_cast<unsigned char>(byte));
  }));
}

std::string shortened(std::string_view text, std::size_t longest) {
  std::string line = one_line(text);
  if (character_count(line) <= longest) return line;
  std::size_t end = 0;
  for (std::size_t kept = 0; kept + 1 < longest; ++kept) {
    end += character_length(std::string_view{line}.substr(end));
  }
  return line.substr(0, end).append(kEllipsis);
}

}  // namespace zerodrift::report
