// SPDX-License-Identifier: Apache-2.0
// Numbers as text with so many decimals or significant digits, read again.
#pragma once

#include <cstdio>
#include <cstdlib>

namespace zerodrift::diagnosis::test {

struct Decimals {
  int count;
};

struct Digits {
  int count;
};

inline double written(double value, Decimals decimals) {
  char text[64];
  std::snprintf(text, sizeof text, "%.*f", decimals.count, value);
  return std::strtod(text, nullptr);
}

inline double written(double value, Digits digits) {
  char text[64];
  std::snprintf(text, sizeof text, "%.*g", digits.count, value);
  return std::strtod(text, nullptr);
}

}  // namespace zerodrift::diagnosis::test
