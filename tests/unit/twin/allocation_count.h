// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

namespace zerodrift::twin {

// Allocations this program has made so far.
[[nodiscard]] std::size_t allocation_count() noexcept;

}  // namespace zerodrift::twin
