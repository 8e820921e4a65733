// SPDX-License-Identifier: Apache-2.0
// The sentences of the schemes' validate() functions.
#pragma once

#include <cmath>
#include <optional>
#include <stdexcept>
#include <string>

namespace zerodrift::regression {

[[nodiscard]] inline std::string wrong_option(const std::string& key, const std::string& found,
                                              const std::string& expected) {
  return key + ": found " + found + ", expected " + expected;
}

[[nodiscard]] inline bool is_positive(double value) noexcept {
  return std::isfinite(value) && value > 0.0;
}

// The options themselves. Throws std::invalid_argument with the scheme's name and validate()'s
// sentence.
template <typename Options>
[[nodiscard]] const Options& checked_options(const char* scheme, const Options& options) {
  if (const auto error = options.validate()) {
    throw std::invalid_argument(std::string(scheme) + ": " + *error);
  }
  return options;
}

}  // namespace zerodrift::regression
