// SPDX-License-Identifier: Apache-2.0
#include "common/core/time_text.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <utility>

namespace zerodrift::core {
namespace {

using namespace std::string_view_literals;

constexpr std::array kUnits{std::pair{""sv, 1.0},     std::pair{"s"sv, 1.0},
                            std::pair{"ms"sv, 1e-3},  std::pair{"min"sv, 60.0},
                            std::pair{"h"sv, 3600.0}, std::pair{"d"sv, 86400.0}};
constexpr std::string_view kBlanks = " \t\r\n\v\f";

std::string_view trimmed(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(kBlanks);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(kBlanks) + 1 - begin);
}

bool is_same_but_for_case(std::string_view text, std::string_view lower) {
  return std::equal(text.begin(), text.end(), lower.begin(), lower.end(), [](char a, char b) {
    return (a >= 'A' && a <= 'Z' ? static_cast<char>(a - 'A' + 'a') : a) == b;
  });
}

}  // namespace

std::optional<double> parse_time_s(std::string_view text) noexcept {
  double value = 0.0;
  const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || !std::isfinite(value)) return std::nullopt;
  const std::string_view unit = trimmed(text.substr(static_cast<std::size_t>(stop - text.data())));
  for (const auto& [name, seconds] : kUnits)
    if (is_same_but_for_case(unit, name)) return value * seconds;
  return std::nullopt;
}

}  // namespace zerodrift::core
