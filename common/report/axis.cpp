// SPDX-License-Identifier: Apache-2.0
#include "common/report/axis.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <string_view>

namespace zerodrift::report {
namespace {

// Below this, relative to the values, rounding shows as steps.
constexpr double kShortestRelativeSpan = 1e-9;
constexpr double kMostLabelledDecades = 9.0;

double log_or_self(double value, AxisScale scale) {
  return scale == AxisScale::kLogarithmic ? std::log10(value) : value;
}

double power_or_self(double value, AxisScale scale) {
  return scale == AxisScale::kLogarithmic ? std::pow(10.0, value) : value;
}

double half_length_for(double middle, AxisScale scale) {
  if (scale == AxisScale::kLogarithmic) return 0.5;  // a decade
  return std::abs(middle) < kSmallestDrawnOnLog ? 1.0 : std::abs(middle) * 0.5;
}

std::string superscript(int number) {
  constexpr std::array<std::string_view, 10> kDigits{"⁰", "¹", "²", "³", "⁴",
                                                     "⁵", "⁶", "⁷", "⁸", "⁹"};
  std::string text;
  for (const char c : std::to_string(number)) {
    text += c == '-' ? std::string_view{"⁻"} : kDigits[static_cast<std::size_t>(c - '0')];
  }
  return text;
}

std::string fixed(double value, int decimals) {
  std::array<char, 400> text{};
  const auto [end, error] = std::to_chars(text.data(), text.data() + text.size(), value,
                                          std::chars_format::fixed, decimals);
  return {text.data(), end};
}

// 2.5e-07 -> "2.5e-7".
std::string with_exponent(double value, int decimals) {
  std::array<char, 64> buffer{};
  const auto [end, error] = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value,
                                          std::chars_format::scientific, decimals);
  std::string text{buffer.data(), end};
  std::size_t digits = text.find('e') + 1;
  if (text[digits] == '+') text.erase(digits, 1);
  if (text[digits] == '-') ++digits;
  while (digits + 1 < text.size() && text[digits] == '0') text.erase(digits, 1);
  return text;
}

// Exact for the label: a multiple of a power of ten, `exponent` that of the step.
std::string linear_label(double value, int exponent, double largest) {
  if (exponent >= -6 && largest < 1e6) return fixed(value, std::max(0, -exponent));
  if (value == 0.0) return "0";
  const int own = static_cast<int>(std::floor(std::log10(std::abs(value)) + 1e-9));
  return with_exponent(value, std::clamp(own - exponent, 0, 15));
}

std::vector<Tick> linear_ticks(const AxisRange& range, int wanted) {
  const double rough = (range.high - range.low) / wanted;
  int exponent = static_cast<int>(std::floor(std::log10(rough)));
  const double fraction = rough / std::pow(10.0, exponent);
  double multiple = fraction < 1.5 ? 1.0 : fraction < 3.5 ? 2.0 : fraction < 7.5 ? 5.0 : 10.0;
  if (multiple == 10.0) {
    multiple = 1.0;
    ++exponent;
  }
  const double step = multiple * std::pow(10.0, exponent);
  const double slack = step * 1e-6;  // ends that rounding put just outside
  const double largest = std::max(std::abs(range.low), std::abs(range.high));
  std::vector<Tick> found;
  const double first = std::ceil((range.low - slack) / step);
  for (int i = 0; i <= 4 * wanted; ++i) {
    const double at = (first + i) * step;
    if (at > range.high + slack) break;
    found.push_back({std::clamp(at, range.low, range.high), linear_label(at, exponent, largest)});
  }
  return found;
}

std::string decade_label(int exponent, bool plain) {
  if (plain) return fixed(std::pow(10.0, exponent), std::max(0, -exponent));
  return "10" + superscript(exponent);
}

std::string decade_part_label(int multiple, int exponent, bool plain) {
  if (plain) return fixed(multiple * std::pow(10.0, exponent), std::max(0, -exponent));
  return std::to_string(multiple) + "·10" + superscript(exponent);
}

std::vector<Tick> logarithmic_ticks(const AxisRange& range) {
  const double low = std::log10(range.low);
  const double high = std::log10(range.high);
  const int first = static_cast<int>(std::floor(low));
  const int last = static_cast<int>(std::ceil(high));
  const int stride = static_cast<int>(std::ceil((high - low) / kMostLabelledDecades));
  const bool plain = low >= -4.0 && high < 4.0;  // labels from 0.001 to 1000
  const bool few = high - low < 2.0;
  std::vector<Tick> found;
  for (int decade = first; decade <= last; ++decade) {
    for (int multiple = 1; multiple <= (stride > 1 ? 1 : 9); ++multiple) {
      const double at = multiple * std::pow(10.0, decade);
      if (at < range.low * (1.0 - 1e-9) || at > range.high * (1.0 + 1e-9)) continue;
      Tick tick{std::clamp(at, range.low, range.high), {}};
      if (multiple == 1 && decade % stride == 0) tick.label = decade_label(decade, plain);
      if (few && (multiple == 2 || multiple == 5))
        tick.label = decade_part_label(multiple, decade, plain);
      found.push_back(std::move(tick));
    }
  }
  return found;
}

}  // namespace

bool is_drawable(double value, AxisScale scale) {
  if (!(std::abs(value) <= kLargestDrawn)) return false;  // also NaN
  return scale == AxisScale::kLinear || value >= kSmallestDrawnOnLog;
}

double AxisRange::position(double value) const {
  const double from = log_or_self(low, scale);
  return (log_or_self(value, scale) - from) / (log_or_self(high, scale) - from);
}

AxisRange range_of(std::span<const double> values, AxisScale scale, double margin) {
  double low = 0.0;
  double high = 0.0;
  bool any = false;
  for (const double value : values) {
    if (!is_drawable(value, scale)) continue;
    low = any ? std::min(low, value) : value;
    high = any ? std::max(high, value) : value;
    any = true;
  }
  if (!any)
    return scale == AxisScale::kLinear ? AxisRange{0.0, 1.0, scale} : AxisRange{0.1, 10.0, scale};
  double from = log_or_self(low, scale);
  double to = log_or_self(high, scale);
  const double shortest =
      std::max(kSmallestDrawnOnLog, kShortestRelativeSpan * std::max(std::abs(from), std::abs(to)));
  if (to - from <= shortest) {
    const double middle = 0.5 * (from + to);
    const double half = half_length_for(middle, scale);
    return {power_or_self(middle - half, scale), power_or_self(middle + half, scale), scale};
  }
  const double added = margin * (to - from);
  return {power_or_self(from - added, scale), power_or_self(to + added, scale), scale};
}

std::vector<Tick> ticks(const AxisRange& range, int wanted) {
  const bool linear = range.scale == AxisScale::kLinear || range.high < 2.0 * range.low;
  return linear ? linear_ticks(range, wanted) : logarithmic_ticks(range);
}

}  // namespace zerodrift::report
