// SPDX-License-Identifier: Apache-2.0
// What a report that can't be made throws: one line that says what is missing and what would help.
// Files that can't be written throw files::FileError.
#pragma once

#include <stdexcept>

namespace zerodrift::report {

struct ReportError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace zerodrift::report
