// SPDX-License-Identifier: Apache-2.0
// Times and sample rates on a command line, with their unit (common/core/time_text.h).
#pragma once

#include <CLI/CLI.hpp>
#include <array>
#include <charconv>
#include <optional>
#include <string>
#include <string_view>

#include "common/core/time_text.h"

namespace zerodrift::service {

// For CLI::Option::transform(): what `parse` reads, as a number without a unit.
[[nodiscard]] inline CLI::Validator with_unit(std::optional<double> (*parse)(std::string_view),
                                              const std::string& expected,
                                              const std::string& shown) {
  const auto replace = [parse, expected](std::string& text) -> std::string {
    const std::optional<double> value = parse(text);
    if (!value) return "found '" + text + "', expected " + expected;
    std::array<char, 400> digits{};  // the longest double without an exponent has 327 of them
    const auto written = std::to_chars(digits.data(), digits.data() + digits.size(), *value,
                                       std::chars_format::fixed);
    text.assign(digits.data(), written.ptr);
    return "";
  };
  return {replace, shown};
}

// Of an option whose value is in seconds.
[[nodiscard]] inline CLI::Validator in_seconds() {
  return with_unit(core::parse_time_s, "a time as 60, 60s, 5min, 5h or 200ms", "60s|5min|5h|200ms");
}

// Of one whose value is in Hz.
[[nodiscard]] inline CLI::Validator in_hertz() {
  return with_unit(core::parse_rate_hz, "a rate as 20, 20Hz or 1kHz", "20Hz|1kHz");
}

// The help shows the option's default with its unit.
inline CLI::Option* show_default_in(const char* unit, CLI::Option* option) {
  option->capture_default_str();
  return option->default_str(option->get_default_str() + unit);
}

}  // namespace zerodrift::service
