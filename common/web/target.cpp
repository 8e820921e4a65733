// SPDX-License-Identifier: Apache-2.0
#include "common/web/target.h"

#include <algorithm>

namespace zerodrift::web {
namespace {

int hexadecimal_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

bool is_refused(char c) {
  return static_cast<unsigned char>(c) < 0x20 || c == '\x7f' || c == '\\';
}

std::optional<std::string> decoded(std::string_view text) {
  std::string result;
  for (std::size_t i = 0; i < text.size(); ++i) {
    char c = text[i];
    if (c == '%') {
      if (i + 2 >= text.size()) return std::nullopt;
      const int high = hexadecimal_digit(text[i + 1]);
      const int low = hexadecimal_digit(text[i + 2]);
      if (high < 0 || low < 0) return std::nullopt;
      c = static_cast<char>(high * 16 + low);
      i += 2;
    }
    if (is_refused(c)) return std::nullopt;
    result += c;
  }
  return result;
}

bool stays_below_root(std::string_view path) {
  if (path.empty() || path.front() != '/') return false;
  for (std::size_t begin = 1; begin < path.size();) {
    const std::size_t slash = std::min(path.find('/', begin), path.size());
    const std::string_view segment = path.substr(begin, slash - begin);
    if (segment.empty() || segment == "." || segment == "..") return false;
    begin = slash + 1;
  }
  return true;
}

}  // namespace

std::optional<Target> parse_target(std::string_view target) {
  target = target.substr(0, target.find('#'));
  const std::size_t question = target.find('?');
  auto path = decoded(target.substr(0, question));
  if (!path || !stays_below_root(*path)) return std::nullopt;
  Target result{.path = std::move(*path), .query = {}};
  if (question == std::string_view::npos) return result;
  std::string_view query = target.substr(question + 1);
  while (!query.empty()) {
    const std::string_view pair = query.substr(0, query.find('&'));
    query.remove_prefix(std::min(pair.size() + 1, query.size()));
    const std::size_t equals = pair.find('=');
    auto name = decoded(pair.substr(0, equals));
    auto value =
        decoded(equals == std::string_view::npos ? std::string_view() : pair.substr(equals + 1));
    if (!name || !value) return std::nullopt;
    result.query.emplace(std::move(*name), std::move(*value));
  }
  return result;
}

}  // namespace zerodrift::web
