// SPDX-License-Identifier: Apache-2.0
// Counts every operator new of this program: learning, forgetting and predicting must not call it.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>

#include "common/regression/online_svr.h"
#include "common/regression/svr_predictor.h"
#include "tests/unit/regression/test_records.h"

namespace {

std::atomic<std::size_t> allocation_count{0};

}  // namespace

[[gnu::noinline]] void* operator new(std::size_t size) {
  ++allocation_count;
  if (void* memory = std::malloc(size == 0 ? 1 : size)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void* operator new[](std::size_t size) {
  return ::operator new(size);
}
[[gnu::noinline]] void* operator new(std::size_t size, std::align_val_t alignment) {
  ++allocation_count;
  const auto boundary = static_cast<std::size_t>(alignment);
  if (void* memory = std::aligned_alloc(boundary, (size + boundary - 1) / boundary * boundary)) {
    return memory;
  }
  throw std::bad_alloc();
}
[[gnu::noinline]] void* operator new[](std::size_t size, std::align_val_t alignment) {
  return ::operator new(size, alignment);
}
[[gnu::noinline]] void operator delete(void* memory, std::align_val_t) noexcept {
  std::free(memory);
}
[[gnu::noinline]] void operator delete[](void* memory, std::align_val_t) noexcept {
  std::free(memory);
}
[[gnu::noinline]] void operator delete(void* memory, std::size_t, std::align_val_t) noexcept {
  std::free(memory);
}
[[gnu::noinline]] void operator delete[](void* memory, std::size_t, std::align_val_t) noexcept {
  std::free(memory);
}
[[gnu::noinline]] void operator delete(void* memory) noexcept {
  std::free(memory);
}
[[gnu::noinline]] void operator delete[](void* memory) noexcept {
  std::free(memory);
}
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}
[[gnu::noinline]] void operator delete[](void* memory, std::size_t) noexcept {
  std::free(memory);
}

namespace zerodrift::regression::testing {

std::size_t allocations_so_far() {
  return allocation_count;
}

namespace {

TEST(NoAllocation, LearningForgettingAndPredictingAllocateNothing) {
  for (const RecordKind kind : kAllRecordKinds) {
    for (const WindowPolicy window : {WindowPolicy::kFifo, WindowPolicy::kTwoTier}) {
      OnlineSvrOptions options = options_of(2, 60, 100.0);
      options.window = window;
      options.epsilon = 0.001;  // a large margin set
      const auto record = RecordGenerator(kind, 2, 8).take(600);
      OnlineSvr svr(options);
      SvrPredictor predictor(2, options.capacity);

      const std::size_t before = allocation_count;
      double total = 0.0;
      for (const Sample& sample : record) {
        svr.add(sample.x, sample.y);
        predictor.assign(svr);
        total += predictor.predict(sample.x) + svr.predict(sample.x);
      }
      for (std::size_t slot = 0; slot < 20; ++slot) svr.forget(slot);
      svr.settle();
      svr.clear();
      EXPECT_EQ(allocation_count - before, 0u) << name(kind);
      EXPECT_TRUE(std::isfinite(total));
    }
  }
}

TEST(NoAllocation, TheCounterSeesAnAllocation) {
  const std::size_t before = allocation_count;
  const OnlineSvr svr(options_of(2, 60, 100.0));
  EXPECT_GT(allocation_count, before);
}

}  // namespace
}  // namespace zerodrift::regression::testing
