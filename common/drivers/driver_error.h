// SPDX-License-Identifier: Apache-2.0
// What a device that can't be used throws at start-up: one line that names the device, what was
// found and what would be right. While running nothing throws: a device that fails then says so in
// its status.
#pragma once

#include <stdexcept>

namespace zerodrift::drivers {

struct DriverError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace zerodrift::drivers
