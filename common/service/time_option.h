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

// Beyond them a time or a rate is a mistake, and wouldn't fit the sums that sensor times make.
inline constexpr double kLongestTimeS = 1e9;
inline constexpr double kHighestRateHz = 1e6;

// Of an option whose value is in seconds, of any sign and size: its own check says what it takes.
[[nodiscard]] inline CLI::Validator in_seconds() {
  return with_unit(core::parse_time_s, "a time as 60, 60s, 5min, 5h or 200ms", "60s|5min|5h|200ms");
}

// Of a duration.
[[nodiscard]] inline CLI::Validator in_seconds_above_0() {
  const auto parse = [](std::string_view text) {
    const auto time_s = core::parse_time_s(text);
    return time_s && *time_s > 0.0 && *time_s <= kLongestTimeS ? time_s : std::nullopt;
  };
  return with_unit(parse, "a time above 0 and up to 1e9 s, as 60, 60s, 5min, 5h or 200ms",
                   "60s|5min|5h|200ms");
}

// Of one that may be none.
[[nodiscard]] inline CLI::Validator in_seconds_from_0() {
  const auto parse = [](std::string_view text) {
    const auto time_s = core::parse_time_s(text);
    return time_s && *time_s >= 0.0 && *time_s <= kLongestTimeS ? time_s : std::nullopt;
  };
  return with_unit(parse, "a time from 0 to 1e9 s, as 60, 60s, 5min, 5h or 200ms",
                   "60s|5min|5h|200ms");
}

// Of a rate, in Hz.
[[nodiscard]] inline CLI::Validator in_hertz() {
  const auto parse = [](std::string_view text) {
    const auto rate_hz = core::parse_rate_hz(text);
    return rate_hz && *rate_hz > 0.0 && *rate_hz <= kHighestRateHz ? rate_hz : std::nullopt;
  };
  return with_unit(parse, "a rate above 0 and up to 1 MHz, as 20, 20Hz or 1kHz", "20Hz|1kHz");
}

// The help shows the option's default with its unit.
inline CLI::Option* show_default_in(const char* unit, CLI::Option* option) {
  option->capture_default_str();
  return option->default_str(option->get_default_str() + unit);
}

}  // namespace zerodrift::service
