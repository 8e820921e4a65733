// SPDX-License-Identifier: Apache-2.0
// Counts allocations, in programs that link zerodrift_allocation_count: it replaces operator new.
#pragma once

#include <cstddef>

namespace zerodrift {

// How often the calling thread has taken memory so far.
[[nodiscard]] std::size_t allocation_count() noexcept;

// How often `work` takes memory, in the calling thread.
template <typename Work>
std::size_t allocated_by(Work&& work) {
  const std::size_t before = allocation_count();
  work();
  return allocation_count() - before;
}

}  // namespace zerodrift
