// SPDX-License-Identifier: Apache-2.0
// What an MCAP file that can't be read or written throws: one line that names the file, the byte
// where it is known, what was found and what would be right.
#pragma once

#include <stdexcept>
#include <string>

#include "common/core/one_line.h"

namespace zerodrift::mcap {

class McapError : public std::runtime_error {
 public:
  explicit McapError(const std::string& line) : std::runtime_error(core::one_line(line)) {}
};

}  // namespace zerodrift::mcap
