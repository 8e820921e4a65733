// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>
#include <string>

#include "common/core/one_line.h"

namespace zerodrift::checkpoint {

// A checkpoint that can't be used. what() is one line: what was found and what would be right, and
// the file where there is one.
class CheckpointError : public std::runtime_error {
 public:
  explicit CheckpointError(const std::string& line) : std::runtime_error(core::one_line(line)) {}
};

}  // namespace zerodrift::checkpoint
