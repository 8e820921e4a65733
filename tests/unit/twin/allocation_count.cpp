// SPDX-License-Identifier: Apache-2.0
// In a file of its own, so that the compiler doesn't see malloc behind a caller's new.
#include "tests/unit/twin/allocation_count.h"

#include <atomic>
#include <cstdlib>
#include <new>

namespace {

std::atomic<std::size_t> allocations{0};

}  // namespace

void* operator new(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t /*size*/) noexcept {
  std::free(memory);
}

namespace zerodrift::twin {

std::size_t allocation_count() noexcept {
  return allocations;
}

}  // namespace zerodrift::twin
