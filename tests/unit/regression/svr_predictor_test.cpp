// SPDX-License-Identifier: Apache-2.0
#include "common/regression/svr_predictor.h"

#include <gtest/gtest.h>

#include <stdexcept>

#include "common/regression/online_svr.h"
#include "tests/unit/regression/test_records.h"

namespace zerodrift::regression::testing {
namespace {

TEST(PredictorLaws, EqualsTheLearnerToTheBitAtTheMomentOfAssign) {
  for (const KernelKind kernel : kAllKernelKinds) {
    // More support vectors than one block of the expansion.
    OnlineSvr svr(options_of(3, 300, 1.0, kernel));
    SvrPredictor predictor(3, 300);
    RecordGenerator record(RecordKind::kSmooth, 3, 4);
    std::size_t most_support = 0;
    for (int i = 0; i < 600; ++i) {
      const Sample sample = record.next();
      svr.add(sample.x, sample.y);
      predictor.assign(svr);
      most_support = std::max(most_support, predictor.support_size());
      for (const Sample& probe : record.take(3)) {
        ASSERT_EQ(predictor.predict(probe.x), svr.predict(probe.x))
            << name(kernel) << " step " << i;
      }
    }
    EXPECT_GT(most_support, 2 * kExpansionBlock) << name(kernel);
  }
}

TEST(PredictorLaws, KeepsItsModelWhileTheLearnerMovesOn) {
  OnlineSvr svr(options_of(2, 50, 10.0));
  SvrPredictor predictor(2, 50);
  RecordGenerator record(RecordKind::kJumps, 2, 4);
  for (const Sample& sample : record.take(50)) svr.add(sample.x, sample.y);
  predictor.assign(svr);
  const std::vector<double> probe{0.1, 0.2};
  const double before = predictor.predict(probe);
  for (const Sample& sample : record.take(50)) svr.add(sample.x, sample.y);
  EXPECT_NE(svr.predict(probe), before);
  EXPECT_EQ(predictor.predict(probe), before);
}

TEST(PredictorAbuse, PredictsZeroUntilAssignedAndRefusesImpossibleDimensions) {
  const SvrPredictor predictor(2, 10);
  EXPECT_EQ(predictor.predict(std::vector<double>{1.0, 2.0}), 0.0);
  EXPECT_THROW(SvrPredictor(0, 10), std::invalid_argument);
  EXPECT_THROW(SvrPredictor(kMaxDimension + 1, 10), std::invalid_argument);
}

TEST(PredictorAbuse, FeaturesOfAnotherDimensionEndTheProcessInEveryBuild) {
  const SvrPredictor predictor(2, 10);
  EXPECT_DEATH(static_cast<void>(predictor.predict(std::vector<double>{1.0})),
               "features are as many as the predictor learned");
  OnlineSvrOptions options;
  options.dimension = 2;
  options.capacity = 20;
  const OnlineSvr svr(options);
  EXPECT_DEATH(static_cast<void>(svr.predict(std::vector<double>{1.0})),
               "features are as many as the online SVR learns");
  SvrPredictor smaller(2, 4);
  EXPECT_DEATH(smaller.assign(svr), "a predictor is as large as the online SVR that it copies");
}

}  // namespace
}  // namespace zerodrift::regression::testing
