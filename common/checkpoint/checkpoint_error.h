// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>
#include <string>
#include <utility>

#include "common/core/one_line.h"

namespace zerodrift::checkpoint {

// A checkpoint that can't be used. what() is one line: what was found and what would be right, and
// the file where there is one. It quotes the file: for whoever named it on this computer, never for
// an answer over the network, which has kind() alone.
class CheckpointError : public std::runtime_error {
 public:
  explicit CheckpointError(const std::string& line, std::string kind = "can't be used")
      : std::runtime_error(core::one_line(line)), kind_(std::move(kind)) {}

  // "is damaged": what a sentence says of the checkpoint.
  [[nodiscard]] const std::string& kind() const noexcept { return kind_; }

 private:
  std::string kind_;
};

}  // namespace zerodrift::checkpoint
