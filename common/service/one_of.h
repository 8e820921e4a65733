// SPDX-License-Identifier: Apache-2.0
// Values of an option that go by name. CLI11's own transformer puts the enumerators' bytes into the
// help and into what it says of a wrong name.
#pragma once

#include <CLI/CLI.hpp>
#include <map>
#include <string>
#include <type_traits>
#include <vector>

#include "common/core/closest_name.h"

namespace zerodrift::service {

// For CLI::Option::transform(): one of `values`, by its name.
template <typename Enum>
[[nodiscard]] CLI::Validator one_of(const std::map<std::string, Enum>& values) {
  std::vector<std::string> names;
  for (const auto& [name, value] : values) names.push_back(name);
  const auto replace = [values, names](std::string& word) -> std::string {
    const auto found = values.find(word);
    if (found == values.end()) return "found '" + word + "'" + core::suggestion(word, names);
    word = std::to_string(static_cast<std::underlying_type_t<Enum>>(found->second));
    return "";
  };
  return {replace, CLI::detail::join(names, "|")};
}

// The name that one_of() takes a value by; empty where it has none.
template <typename Enum>
[[nodiscard]] std::string name_in(const std::map<std::string, Enum>& values, Enum value) {
  for (const auto& [name, named] : values) {
    if (named == value) return name;
  }
  return "";
}

}  // namespace zerodrift::service
