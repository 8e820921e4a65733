// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>

namespace zerodrift::config {

// A configuration file that can't be used. what() is one line: file, line where there is one, key,
// what was found and what would be right.
class ConfigError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace zerodrift::config
