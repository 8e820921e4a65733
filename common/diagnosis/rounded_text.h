// SPDX-License-Identifier: Apache-2.0
// A number in a sentence.
#pragma once

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

}  // namespace zerodrift::diagnosis
