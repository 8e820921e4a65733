// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>

namespace zerodrift::dds {

// Start-up trouble with the middleware: one clear line.
struct DdsError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace zerodrift::dds
