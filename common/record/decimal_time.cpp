// SPDX-License-Identifier: Apache-2.0
#include "common/record/decimal_time.h"

#include <chrono>
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

bool take_character(std::string_view& text, std::string_view any_of) noexcept {
  if (text.empty() || any_of.find(text.front()) == std::string_view::npos) return false;
  text.remove_prefix(1);
  return true;
}

// Exactly `count` digits.
std::optional<unsigned> take_field(std::string_view& text, int count) noexcept {
  std::uint64_t value = 0;
  if (take_digits(text, value, count) != count) return std::nullopt;
  return static_cast<unsigned>(value);
}

std::optional<std::chrono::sys_days> take_date(std::string_view& text) noexcept {
  const auto year = take_field(text, 4);
  if (!year || !take_character(text, "-")) return std::nullopt;
  const auto month = take_field(text, 2);
  if (!month || !take_character(text, "-")) return std::nullopt;
  const auto day = take_field(text, 2);
  if (!day || *year < 1678 || *year > 2261) return std::nullopt;
  const std::chrono::year_month_day date{std::chrono::year{static_cast<int>(*year)},
                                         std::chrono::month{*month}, std::chrono::day{*day}};
  if (!date.ok()) return std::nullopt;
  return std::chrono::sys_days{date};
}

// 'hh:mm' or 'hh:mm:ss'. A leap second is none of a time scale without them.
std::optional<std::chrono::seconds> take_time_of_day(std::string_view& text) noexcept {
  const auto hour = take_field(text, 2);
  if (!hour || *hour > 23 || !take_character(text, ":")) return std::nullopt;
  const auto minute = take_field(text, 2);
  if (!minute || *minute > 59) return std::nullopt;
  std::optional<unsigned> second = 0;
  if (take_character(text, ":")) second = take_field(text, 2);
  if (!second || *second > 59) return std::nullopt;
  return std::chrono::hours{*hour} + std::chrono::minutes{*minute} + std::chrono::seconds{*second};
}

std::optional<std::chrono::nanoseconds> take_fraction(std::string_view& text) noexcept {
  if (!take_character(text, ".,")) return std::chrono::nanoseconds{0};
  std::uint64_t nanoseconds = 0;
  int digits = take_digits(text, nanoseconds, 9);
  if (digits == 0) return std::nullopt;
  for (; digits < 9; ++digits) nanoseconds *= 10;
  if (!text.empty() && is_digit(text.front()) && text.front() >= '5') ++nanoseconds;
  while (!text.empty() && is_digit(text.front())) text.remove_prefix(1);
  return std::chrono::nanoseconds{nanoseconds};
}

// How much later than UTC the clock is.
std::optional<std::chrono::minutes> take_offset(std::string_view& text) noexcept {
  if (text.empty() || take_character(text, "Zz")) return std::chrono::minutes{0};
  const bool behind = text.front() == '-';
  if (!take_character(text, "+-")) return std::nullopt;
  const auto hours = take_field(text, 2);
  if (!hours || *hours > 23) return std::nullopt;
  std::optional<unsigned> minutes = 0;
  if (take_character(text, ":") || !text.empty()) minutes = take_field(text, 2);
  if (!minutes || *minutes > 59) return std::nullopt;
  const std::chrono::minutes offset = std::chrono::hours{*hours} + std::chrono::minutes{*minutes};
  return behind ? -offset : offset;
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

std::optional<core::SensorTime> parse_iso8601(std::string_view text) noexcept {
  const auto date = take_date(text);
  if (!date || !take_character(text, "Tt ")) return std::nullopt;
  const auto time_of_day = take_time_of_day(text);
  if (!time_of_day) return std::nullopt;
  const auto fraction = take_fraction(text);
  if (!fraction) return std::nullopt;
  const auto offset = take_offset(text);
  if (!offset || !text.empty()) return std::nullopt;
  return core::SensorTime{date->time_since_epoch()} + *time_of_day + *fraction - *offset;
}

}  // namespace zerodrift::record
