// SPDX-License-Identifier: Apache-2.0
// Learning, forgetting and predicting take no memory.
#include <gtest/gtest.h>

#include <cmath>

#include "common/regression/online_svr.h"
#include "common/regression/svr_predictor.h"
#include "tests/support/allocation_count.h"
#include "tests/unit/regression/test_records.h"

namespace zerodrift::regression::testing {
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

      const std::size_t before = allocation_count();
      double total = 0.0;
      for (const Sample& sample : record) {
        svr.add(sample.x, sample.y);
        predictor.assign(svr);
        total += predictor.predict(sample.x) + svr.predict(sample.x);
      }
      for (std::size_t slot = 0; slot < 20; ++slot) svr.forget(slot);
      svr.finish_pending();
      svr.clear();
      EXPECT_EQ(allocation_count() - before, 0u) << name(kind);
      EXPECT_TRUE(std::isfinite(total));
    }
  }
}

TEST(NoAllocation, TheCounterSeesAnAllocation) {
  const std::size_t before = allocation_count();
  const OnlineSvr svr(options_of(2, 60, 100.0));
  EXPECT_GT(allocation_count(), before);
}

}  // namespace
}  // namespace zerodrift::regression::testing
