// SPDX-License-Identifier: Apache-2.0
// Counts every allocation of the test program (allocation_counter.cpp replaces operator new).
#pragma once

#include <cstddef>

namespace zerodrift::allan::test {

[[nodiscard]] std::size_t allocation_count() noexcept;

}  // namespace zerodrift::allan::test
