// SPDX-License-Identifier: Apache-2.0
// Times on a command line, with their unit: 60, 60s, 5min, 5h, 200ms.
#pragma once

#include <CLI/CLI.hpp>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

namespace zerodrift::service {

// In seconds: a number, then nothing or s, ms, min, h or d, blanks between them allowed. Nullopt
// for anything else.
[[nodiscard]] inline std::optional<double> parse_time_s(std::string_view text) {
  constexpr std::array kUnits{std::pair{"", 1.0},     std::pair{"s", 1.0},
                              std::pair{"ms", 1e-3},  std::pair{"min", 60.0},
                              std::pair{"h", 3600.0}, std::pair{"d", 86400.0}};
  double value = 0.0;
  const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || !std::isfinite(value)) return std::nullopt;
  text.remove_prefix(static_cast<std::size_t>(stop - text.data()));
  const std::string unit = CLI::detail::to_lower(CLI::detail::trim_copy(std::string{text}));
  for (const auto& [name, seconds] : kUnits)
    if (unit == name) return value * seconds;
  return std::nullopt;
}

// For CLI::Option::transform() of an option whose value is in seconds.
[[nodiscard]] inline CLI::Validator in_seconds() {
  const auto replace = [](std::string& text) -> std::string {
    const std::optional<double> time_s = parse_time_s(text);
    if (!time_s) return "found '" + text + "', expected a time as 60, 60s, 5min, 5h or 200ms";
    std::array<char, 400> digits{};  // the longest double without an exponent has 327 of them
    const auto written = std::to_chars(digits.data(), digits.data() + digits.size(), *time_s,
                                       std::chars_format::fixed);
    text.assign(digits.data(), written.ptr);
    return "";
  };
  return {replace, "60s|5min|5h|200ms"};
}

}  // namespace zerodrift::service
