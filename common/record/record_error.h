// SPDX-License-Identifier: Apache-2.0
// What a record that can't be read or written throws: one line that names file, line and column
// where they are known, what was found and what would be right.
#pragma once

#include <stdexcept>

namespace zerodrift::record {

class RecordError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace zerodrift::record
