// SPDX-License-Identifier: Apache-2.0
// Times on a command line, with their unit (common/core/time_text.h).
#pragma once

#include <CLI/CLI.hpp>
#include <array>
#include <charconv>
#include <optional>
#include <string>

#include "common/core/time_text.h"

namespace zerodrift::service {

// For CLI::Option::transform() of an option whose value is in seconds.
[[nodiscard]] inline CLI::Validator in_seconds() {
  const auto replace = [](std::string& text) -> std::string {
    const std::optional<double> time_s = core::parse_time_s(text);
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
