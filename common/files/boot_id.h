// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace zerodrift::files {

// Of this computer's kernel: the same in all its containers, another one each time that the
// computer is started. Empty where the system doesn't say it.
[[nodiscard]] std::string boot_id();

}  // namespace zerodrift::files
