// SPDX-License-Identifier: Apache-2.0
// What a file that can't be read or written throws: one line that names file, line and column
// where they are known, what was found and what would be right.
#pragma once

#include <stdexcept>
#include <string>

#include "common/core/one_line.h"

namespace zerodrift::files {

class FileError : public std::runtime_error {
 public:
  explicit FileError(const std::string& line) : std::runtime_error(core::one_line(line)) {}
};

}  // namespace zerodrift::files
