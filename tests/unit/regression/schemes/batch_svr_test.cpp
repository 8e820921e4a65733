// SPDX-License-Identifier: Apache-2.0
#include "common/regression/schemes/batch_svr.h"

#include <gtest/gtest.h>
#include <libsvm/svm.h>

#include <stdexcept>
#include <vector>

#include "common/core/require.h"
#include "tests/support/wrong_key.h"
#include "tests/unit/regression/schemes/drift_records.h"

namespace zerodrift::regression::testing {
namespace {

constexpr std::uint64_t kSeed = 7;

// LIBSVM used directly, on targets scaled by hand.
TEST(BatchSvrLaws, EqualsSvmPredictToTheBit) {
  constexpr std::size_t kCount = 400;
  const Record record = heat_cool_record(kCount, 0.0, kSeed);
  const BatchSvrOptions options{
      .initial = {.labels = kCount}, .box_constraint = 5.0, .gamma = 2.0, .epsilon = 0.07};
  BatchSvr scheme(options);
  for (std::size_t i = 0; i < kCount; ++i) scheme.learn(record.label(i));
  ASSERT_TRUE(scheme.is_trained());
  EXPECT_GT(scheme.support_size(), 10u);

  double mean = 0.0, square = 0.0;
  for (const double label : record.labels) mean += label;
  mean /= kCount;
  for (const double label : record.labels) square += (label - mean) * (label - mean);
  const double scale = std::sqrt(square / kCount);

  const auto nodes_of = [](const Features& x) {
    return std::array<svm_node, 3>{svm_node{1, x[0]}, svm_node{2, x[1]}, svm_node{-1, 0.0}};
  };
  std::vector<std::array<svm_node, 3>> nodes;
  std::vector<svm_node*> rows;
  std::vector<double> targets;
  for (std::size_t i = 0; i < kCount; ++i) {
    nodes.push_back(nodes_of(record.features[i]));
    targets.push_back((record.labels[i] - mean) / scale);
  }
  for (auto& row : nodes) rows.push_back(row.data());
  const svm_problem problem{static_cast<int>(kCount), targets.data(), rows.data()};
  svm_parameter parameter{};
  parameter.svm_type = EPSILON_SVR;
  parameter.kernel_type = RBF;
  parameter.gamma = 2.0;
  parameter.cache_size = 100.0;
  parameter.eps = 1e-3;
  parameter.C = 5.0;
  parameter.p = 0.07;
  parameter.shrinking = 1;
  svm_model* model = svm_train(&problem, &parameter);
  for (std::size_t i = 0; i < 3000; i += 7) {
    const Features x = features_at(i);
    EXPECT_EQ(scheme.predict(1e4, x).drift, mean + scale * svm_predict(model, nodes_of(x).data()));
  }
  svm_free_and_destroy_model(&model);
}

TEST(BatchSvrLaws, PredictsTheMeanUntilTrainedAndIsFrozenAfterwards) {
  const Record record = heat_cool_record(600, 0.0, kSeed);
  BatchSvr scheme({.initial = {.labels = 10000, .until_s = 300.0}});
  const Features probe{0.3, 0.9};
  EXPECT_EQ(scheme.predict(0.0, probe).drift, 0.0);
  scheme.learn(record.label(0));
  EXPECT_EQ(scheme.predict(2.0, probe).drift, record.labels[0]);
  for (std::size_t i = 1; i < 299; ++i) scheme.learn(record.label(i));
  EXPECT_FALSE(scheme.is_trained());
  scheme.learn(record.label(299));  // ends at 300 s
  ASSERT_TRUE(scheme.is_trained());
  const double trained = scheme.predict(301.0, probe).drift;
  for (std::size_t i = 300; i < 600; ++i) scheme.learn(record.label(i));
  EXPECT_EQ(scheme.predict(601.0, probe).drift, trained);
}

TEST(BatchSvrScenario, TwoCyclesTeachItTheHeatCoolRecord) {
  const Record record = heat_cool_record(9000, 0.0, kSeed);
  BatchSvr scheme({.initial = {.labels = 6000}});
  // As for the RBF network.
  EXPECT_LT(rms_error(record, predict_all(scheme, record, 1), 6001), 0.065);
}

TEST(BatchSvrAbuse, IdenticalLabelsGiveThatLabel) {
  BatchSvr scheme({.initial = {.labels = 50}});
  const Features x{0.1, 0.2};
  for (int i = 0; i < 50; ++i) {
    scheme.learn(
        {.time_s = i + 1.0, .duration_s = 1.0, .features = x, .drift = 1e-5, .variance = 1e-14});
  }
  ASSERT_TRUE(scheme.is_trained());
  EXPECT_NEAR(scheme.predict(100.0, x).drift, 1e-5, 1e-15);
}

TEST(BatchSvrAbuse, FeaturesOfAnotherDimensionAreRefusedInEveryBuild) {
  BatchSvr scheme({.initial = {.labels = 2}});
  const auto learn = [&](double time_s, const std::vector<double>& x) {
    scheme.learn({.time_s = time_s,
                  .duration_s = 1.0,
                  .features = x,
                  .drift = 1e-5 * time_s,
                  .variance = 1e-14});
  };
  learn(1.0, {0.1, 0.2});
  EXPECT_THROW(learn(2.0, {0.1}), core::BrokenPromise);
  learn(2.0, {0.2, 0.1});
  ASSERT_TRUE(scheme.is_trained());
  EXPECT_THROW(static_cast<void>(scheme.predict(3.0, std::vector<double>(kMaxDimension + 1, 0.1))),
               core::BrokenPromise);
}

TEST(BatchSvrAbuse, NothingIsPrinted) {
  ::testing::internal::CaptureStdout();
  const Record record = heat_cool_record(100, 0.0, kSeed);
  BatchSvr scheme({.initial = {.labels = 100}});
  for (std::size_t i = 0; i < 100; ++i) scheme.learn(record.label(i));
  EXPECT_TRUE(scheme.is_trained());
  EXPECT_EQ(::testing::internal::GetCapturedStdout(), "");
}

TEST(BatchSvrAbuse, ValidateNamesTheWrongKey) {
  const auto key_of = zerodrift::testing::wrong_key<BatchSvr, BatchSvrOptions>;
  EXPECT_FALSE(BatchSvrOptions{}.validate());
  EXPECT_EQ(key_of({.initial = {.labels = 0}}), "initial.labels");
  EXPECT_EQ(key_of({.box_constraint = 0.0}), "box_constraint");
  EXPECT_EQ(key_of({.gamma = -1.0}), "gamma");
  EXPECT_EQ(key_of({.epsilon = -0.1}), "epsilon");
}

}  // namespace
}  // namespace zerodrift::regression::testing
