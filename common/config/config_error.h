// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>
#include <string>

#include "common/core/one_line.h"

namespace zerodrift::config {

// A configuration file that can't be used. what() is one line: file, line where there is one, key,
// what was found and what would be right.
class ConfigError : public std::runtime_error {
 public:
  explicit ConfigError(const std::string& line) : std::runtime_error(core::one_line(line)) {}
};

}  // namespace zerodrift::config
