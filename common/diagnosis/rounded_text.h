// SPDX-License-Identifier: Apache-2.0
// Numbers and lists in a sentence.
#pragma once

#include <span>
#include <sstream>
#include <string>

namespace zerodrift::diagnosis {

// Three significant digits unless said otherwise: "0.0123", "1.5e-07".
[[nodiscard]] inline std::string rounded(double value, int digits = 3) {
  std::ostringstream text;
  text.precision(digits);
  text << value;
  return text.str();
}

// "a", "a and b", "a, b and c".
[[nodiscard]] inline std::string joined(std::span<const std::string> words) {
  std::string text;
  for (std::size_t i = 0; i < words.size(); ++i)
    text += (i == 0 ? "" : i + 1 == words.size() ? " and " : ", ") + words[i];
  return text;
}

}  // namespace zerodrift::diagnosis
