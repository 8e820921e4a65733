// SPDX-License-Identifier: Apache-2.0
#include "common/service/large_blocks.h"

#include <gtest/gtest.h>
#include <malloc.h>

#include <cstdlib>

#include "tests/support/sanitized.h"

namespace zerodrift::service {
namespace {

// The mappings that large blocks have to themselves.
std::size_t own_mappings() {
  return mallinfo2().hblks;
}

TEST(LargeBlocks, AreMappingsOfTheirOwnAlsoAfterALargerOneWasFreed) {
  if (kIsSanitized) GTEST_SKIP() << "a sanitizer's heap is not the C library's";
  const std::size_t before = own_mappings();
  return_large_blocks();
  // Several sizes, each freed before the next is taken: glibc's own threshold rises with each.
  for (const std::size_t size : {8 * kLargeBlock, 4 * kLargeBlock, 2 * kLargeBlock, kLargeBlock}) {
    void* volatile block = std::malloc(size);
    ASSERT_NE(block, nullptr);
    EXPECT_EQ(own_mappings(), before + 1) << size << " bytes";
    std::free(block);
    EXPECT_EQ(own_mappings(), before) << size << " bytes";
  }
}

TEST(LargeBlocks, SmallerOnesStayInTheCommonHeap) {
  if (kIsSanitized) GTEST_SKIP() << "a sanitizer's heap is not the C library's";
  return_large_blocks();
  const std::size_t before = own_mappings();
  void* volatile block = std::malloc(kLargeBlock / 2);
  ASSERT_NE(block, nullptr);
  EXPECT_EQ(own_mappings(), before);
  std::free(block);
}

}  // namespace
}  // namespace zerodrift::service
