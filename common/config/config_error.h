// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>
#include <string>
#include <utility>

#include "common/core/one_line.h"

namespace zerodrift::config {

// A configuration file that can't be used. what() is one line: file, line where there is one, key,
// what was found and what would be right. It quotes the file: for whoever named the file on this
// computer, never for an answer over the network, which has place() alone.
class ConfigError : public std::runtime_error {
 public:
  explicit ConfigError(const std::string& line, std::string place = "")
      : std::runtime_error(core::one_line(line)), place_(std::move(place)) {}

  // "line 3", or empty where no line is to blame.
  [[nodiscard]] const std::string& place() const noexcept { return place_; }

 private:
  std::string place_;
};

}  // namespace zerodrift::config
