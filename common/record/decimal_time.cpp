// SPDX-License-Identifier: Apache-2.0
#include "common/record/decimal_time.h"

#include <cstdint>
#include <limits>

namespace zerodrift::record {
namespace {

constexpr std::uint64_t kNanosecondsPerSecond = 1'000'000'000;
constexpr std::uint64_t kLargest =
    static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max());

constexpr bool is_digit(char c) noexcept {
  return c >= '0' && c <= '9';
}

// value * 10 + digit; false on overflow of a signed 64-bit nanosecond count.
bool append_digit(std::uint64_t& value, unsigned digit) noexcept {
  if (value > (kLargest - digit) / 10) return false;
  value = value * 10 + digit;
  return true;
}

// Takes the digits at the front of `text`, at most `count` of them, onto `value`. Returns how many,
// or -1 on overflow.
int take_digits(std::string_view& text, std::uint64_t& value, int count) noexcept {
  int taken = 0;
  while (taken < count && !text.empty() && is_digit(text.front())) {
    if (!append_digit(value, static_cast<unsigned>(text.front() - '0'))) return -1;
    text.remove_prefix(1);
    ++taken;
  }
  return taken;
}

}  // namespace

std::string print_seconds(core::SensorTime time) {
  const std::int64_t count = time.count();
  std::uint64_t magnitude = static_cast<std::uint64_t>(count);
  std::string text;
  if (count < 0) {
    magnitude = 0 - magnitude;
    text += '-';
  }
  text += std::to_string(magnitude / kNanosecondsPerSecond);
  text += '.';
  const std::string fraction = std::to_string(magnitude % kNanosecondsPerSecond);
  text.append(9 - fraction.size(), '0');
  return text += fraction;
}

std::optional<core::SensorTime> parse_decimal_time(std::string_view text,
                                                   int nanosecond_exponent) noexcept {
  const bool negative = text.starts_with('-');
  if (negative || text.starts_with('+')) text.remove_prefix(1);

  std::uint64_t nanoseconds = 0;
  const int whole_digits = take_digits(text, nanoseconds, std::numeric_limits<int>::max());
  if (whole_digits < 0) return std::nullopt;
  int fraction_digits = 0;
  bool round_up = false;
  if (text.starts_with('.')) {
    text.remove_prefix(1);
    fraction_digits = take_digits(text, nanoseconds, nanosecond_exponent);
    if (fraction_digits < 0) return std::nullopt;
    round_up = !text.empty() && is_digit(text.front()) && text.front() >= '5';
    if (whole_digits + fraction_digits == 0 && (text.empty() || !is_digit(text.front())))
      return std::nullopt;
    while (!text.empty() && is_digit(text.front())) text.remove_prefix(1);
  } else if (whole_digits == 0) {
    return std::nullopt;
  }
  if (!text.empty()) return std::nullopt;

  for (int i = fraction_digits; i < nanosecond_exponent; ++i) {
    if (!append_digit(nanoseconds, 0)) return std::nullopt;
  }
  if (round_up && ++nanoseconds > kLargest) return std::nullopt;
  const auto count = static_cast<std::int64_t>(nanoseconds);
  return core::SensorTime{negative ? -count : count};
}

}  // namespace zerodrift::record
