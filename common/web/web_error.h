// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>

namespace zerodrift::web {

// Start-up trouble with an address, a file or a connection: one clear line.
class WebError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace zerodrift::web
