// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>

namespace zerodrift::checkpoint {

// A checkpoint that can't be used. what() is one line: what was found and what would be right, and
// the file where there is one.
class CheckpointError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace zerodrift::checkpoint
