// SPDX-License-Identifier: Apache-2.0
#include "common/core/time_text.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <utility>

namespace zerodrift::core {
namespace {

using Unit = std::pair<std::string_view, double>;

constexpr std::array kTimes{Unit{"", 1.0},     Unit{"s", 1.0},    Unit{"ms", 1e-3},
                            Unit{"min", 60.0}, Unit{"h", 3600.0}, Unit{"d", 86400.0}};
constexpr std::array kRates{Unit{"", 1.0}, Unit{"hz", 1.0}, Unit{"khz", 1e3}};
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

template <std::size_t N>
std::optional<double> parse(std::string_view text, const std::array<Unit, N>& units) noexcept {
  double value = 0.0;
  const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || !std::isfinite(value)) return std::nullopt;
  const std::string_view unit = trimmed(text.substr(static_cast<std::size_t>(stop - text.data())));
  for (const auto& [name, factor] : units)
    if (is_same_but_for_case(unit, name)) return value * factor;
  return std::nullopt;
}

}  // namespace

std::optional<double> parse_time_s(std::string_view text) noexcept {
  return parse(text, kTimes);
}

std::optional<double> parse_rate_hz(std::string_view text) noexcept {
  return parse(text, kRates);
}

}  // namespace zerodrift::core
