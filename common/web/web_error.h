// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>

namespace zerodrift::web {

// Start-up trouble with an address, a file or a connection: one clear line.
struct WebError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace zerodrift::web
