// SPDX-License-Identifier: Apache-2.0
#include "common/config/yaml_place.h"

#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string_view>
#include <utility>

#include "common/core/one_line.h"

namespace zerodrift::config {
namespace {

// What stands there, for error messages.
std::string described(const YAML::Node& node) {
  if (node.IsMap()) return "a mapping";
  if (node.IsSequence()) return "a list";
  if (node.IsNull()) return "nothing";
  return node.Tag() == "!" ? "the text \"" + node.Scalar() + '"' : "'" + node.Scalar() + "'";
}

// " in Hz" where the key's suffix tells the unit.
std::string unit_hint(const std::string& path) {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 9> kUnits{{
      {"_deg_h", "deg/h"},
      {"_deg_s", "deg/s"},
      {"_degc", "°C"},
      {"_deg", "degrees"},
      {"_hz", "Hz"},
      {"_ms", "ms"},
      {"_ppm", "ppm"},
      {"_w", "W"},
      {"_s", "s"},
  }};
  for (const auto& [suffix, unit] : kUnits) {
    if (path.ends_with(suffix)) return " in " + std::string(unit);
  }
  return "";
}

template <typename T>
std::optional<T> parsed(const YAML::Node& node) {
  if (!node.IsScalar() || node.Tag() == "!") return std::nullopt;
  const std::string& text = node.Scalar();
  const char* end = text.data() + text.size();
  T value{};
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  if (error != std::errc{} || stop != end) return std::nullopt;
  return value;
}

}  // namespace

std::string joined(const std::string& path, const std::string& key) {
  return path.empty() ? key : path + '.' + key;
}

std::string element(const std::string& path, std::size_t i) {
  return path + '[' + std::to_string(i) + ']';
}

std::string place_of(const YAML::Mark& mark) {
  return "line " + std::to_string(mark.line + 1);
}

std::optional<double> finite_number(const YAML::Node& node) {
  const auto value = parsed<double>(node);
  return value && std::isfinite(*value) ? value : std::nullopt;
}

std::string YamlPlace::line(const std::string& what) const {
  return core::one_line(file + ':' + std::to_string(node.Mark().line + 1) + ": " + path + ": " +
                        what);
}

void YamlPlace::refuse(const std::string& what) const {
  throw ConfigError(line(what), place_of(node.Mark()));
}

void YamlPlace::fail(const std::string& expected) const {
  refuse("expected " + expected + ", found " + described(node));
}

double YamlPlace::number() const {
  if (const auto value = finite_number(node)) return *value;
  fail("a plain number" + unit_hint(path));
}

template <typename Whole>
Whole YamlPlace::whole_number() const {
  if (const auto value = parsed<Whole>(node)) return *value;
  fail("a whole number from " + std::to_string(std::numeric_limits<Whole>::min()) + " to " +
       std::to_string(std::numeric_limits<Whole>::max()));
}
template std::int32_t YamlPlace::whole_number() const;
template std::int64_t YamlPlace::whole_number() const;
template std::uint32_t YamlPlace::whole_number() const;
template std::uint64_t YamlPlace::whole_number() const;

bool YamlPlace::flag() const {
  const bool plain = node.IsScalar() && node.Tag() != "!";
  if (plain && node.Scalar() == "true") return true;
  if (plain && node.Scalar() == "false") return false;
  fail("true or false");
}

std::string YamlPlace::text() const {
  if (!node.IsScalar()) fail("a text");
  return node.Scalar();
}

std::string YamlPlace::key(std::set<std::string>& seen) const {
  if (!node.IsScalar()) {
    const std::string top = "top level";
    YamlPlace{file, node, path.empty() ? top : path}.fail("a key");
  }
  const std::string& key = node.Scalar();
  if (key.size() > kLongestKey) {
    const std::string cut = joined(path, key.substr(0, kLongestKey) + "...");
    YamlPlace{file, node, cut}.refuse("expected a key of at most " + std::to_string(kLongestKey) +
                                      " characters, found " + std::to_string(key.size()));
  }
  if (!seen.insert(key).second) {
    const std::string whole = joined(path, key);
    YamlPlace{file, node, whole}.refuse("this key stands twice");
  }
  return key;
}

}  // namespace zerodrift::config
