// SPDX-License-Identifier: Apache-2.0
#include "common/core/one_line.h"

#include <algorithm>

namespace zerodrift::core {
namespace {

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

// C0, DEL and C1; U+2028 and U+2029 (other lines); U+202A to U+202E and U+2066 to U+2069 (the
// direction of writing).
bool is_obeyed(std::string_view character) {
  const unsigned first = byte_at(character, 0);
  if (character.size() == 1) return first < 0x20U || first == 0x7FU;
  const unsigned second = byte_at(character, 1);
  if (first == 0xC2U) return second < 0xA0U;
  if (first != 0xE2U) return false;
  const unsigned third = byte_at(character, 2);
  return (second == 0x80U && third >= 0xA8U && third <= 0xAEU) ||
         (second == 0x81U && third >= 0xA6U && third <= 0xA9U);
}

bool is_blank(std::string_view character) {
  return character == "\t" || character == "\n" || character == "\r";
}

// What stands at the front of `text`, and what stands for it.
struct Shown {
  std::size_t length = 0;
  std::string_view as{};
};

Shown front(std::string_view text) {
  const std::size_t length = character_length(text);
  const std::string_view character = text.substr(0, std::max<std::size_t>(length, 1));
  if (is_blank(character)) return {character.size(), " "};
  if (length == 0 || is_obeyed(character)) return {character.size(), "?"};
  return {length, character};
}

}  // namespace

std::string one_line(std::string_view text) {
  return one_line(text, text.size());
}

std::string one_line(std::string_view text, std::size_t most_bytes) {
  std::string line;
  line.reserve(std::min(text.size(), most_bytes));
  while (!text.empty()) {
    const Shown shown = front(text);
    if (line.size() + shown.as.size() > most_bytes) break;
    line += shown.as;
    text.remove_prefix(shown.length);
  }
  return line;
}

std::string shortened(std::string_view text, std::size_t most_bytes) {
  constexpr std::string_view kMore = "...";
  std::string whole = one_line(text);
  if (whole.size() <= most_bytes) return whole;
  std::string line = one_line(whole, most_bytes - kMore.size());
  // A word that ends here is whole.
  const std::size_t blank = whole[line.size()] == ' ' ? line.size() : line.rfind(' ');
  if (blank != std::string::npos) line.resize(blank);
  return line.append(kMore);
}

bool is_one_line(std::string_view text) noexcept {
  while (!text.empty()) {
    const Shown shown = front(text);
    if (shown.as != text.substr(0, shown.length)) return false;
    text.remove_prefix(shown.length);
  }
  return true;
}

}  // namespace zerodrift::core
