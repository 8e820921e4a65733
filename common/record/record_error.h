// SPDX-License-Identifier: Apache-2.0
// What a record that can't be read or written throws: one line that names file, line and column
// where they are known, what was found and what would be right.
#pragma once

#include <stdexcept>
#include <string>

#include "common/core/one_line.h"

namespace zerodrift::record {

class RecordError : public std::runtime_error {
 public:
  explicit RecordError(const std::string& line) : std::runtime_error(core::one_line(line)) {}
};

}  // namespace zerodrift::record
