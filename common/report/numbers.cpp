// SPDX-License-Identifier: Apache-2.0
#include "common/report/numbers.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>

namespace zerodrift::report {
namespace {

constexpr int kSmallestPlainExponent = -3;
constexpr int kLargestPlainExponent = 5;

std::string printed(double value, std::chars_format format, int decimals) {
  std::array<char, 64> text{};  // only for magnitudes below 1e7 in fixed format
  const auto [end, error] =
      std::to_chars(text.data(), text.data() + text.size(), value, format, decimals);
  return {text.data(), end};
}

std::optional<std::string> not_a_number(double value) {
  if (std::isnan(value)) return "n/a";
  if (std::isinf(value)) return value > 0 ? "inf" : "-inf";
  return std::nullopt;
}

// "9.33e-04" -> {"9.33", -4}.
struct Scientific {
  std::string mantissa;
  int exponent = 0;
};

Scientific split(double value, int digits) {
  const std::string text = printed(value, std::chars_format::scientific, digits - 1);
  const std::size_t e = text.find('e');
  Scientific parts{text.substr(0, e)};
  const std::size_t sign = text[e + 1] == '+' ? 1 : 0;  // from_chars takes no plus
  std::from_chars(text.data() + e + 1 + sign, text.data() + text.size(), parts.exponent);
  return parts;
}

std::string join(const Scientific& parts) {
  return parts.mantissa + 'e' + std::to_string(parts.exponent);
}

}  // namespace

std::string significant(double value, int digits) {
  if (auto text = not_a_number(value)) return *text;
  const int wanted = std::clamp(digits, 1, 17);
  const Scientific parts = split(value, wanted);  // its exponent is the one after rounding
  if (parts.exponent < kSmallestPlainExponent || parts.exponent > kLargestPlainExponent)
    return join(parts);
  return printed(value, std::chars_format::fixed, std::max(0, wanted - 1 - parts.exponent));
}

std::string scientific(double value, int digits) {
  if (auto text = not_a_number(value)) return *text;
  return join(split(value, std::clamp(digits, 1, 17)));
}

}  // namespace zerodrift::report
