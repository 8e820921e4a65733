// SPDX-License-Identifier: Apache-2.0
// The online model equals the batch optimum of the samples in its window.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <sstream>

#include "common/regression/online_svr.h"
#include "tests/unit/regression/qp_oracle.h"
#include "tests/unit/regression/test_records.h"

namespace zerodrift::regression::testing {
namespace {

constexpr std::uint64_t kSeed = 20220101;

// The oracle stops at a slope of 1e-12 and the targets' jitter is up to 1e-11 (1e-13 C, C = 100).
// Both move f by their own size times the condition of the margin set, here below 1e2. The promise
// is 1e-9.
constexpr double kTolerance = 1e-9;

struct Case {
  KernelKind kernel;
  RecordKind record;
  std::size_t dimension, capacity;
  double c;
};

void PrintTo(const Case& c, std::ostream* out) {
  *out << name(c.kernel) << " " << name(c.record) << " dimension " << c.dimension << " W "
       << c.capacity << " C " << c.c << " seed " << kSeed;
}

class OracleTest : public ::testing::TestWithParam<Case> {};

TEST_P(OracleTest, OnlineModelEqualsTheBatchOptimumOfItsWindow) {
  const Case& c = GetParam();
  const OnlineSvrOptions options = options_of(c.dimension, c.capacity, c.c, c.kernel);
  const auto record = RecordGenerator(c.record, c.dimension, kSeed).take(3 * c.capacity);
  OnlineSvr svr(options);
  for (const Sample& sample : record) {
    const UpdateOutcome outcome = svr.add(sample.x, sample.y).outcome;
    ASSERT_TRUE(outcome == UpdateOutcome::kLearned || outcome == UpdateOutcome::kFitsAlready);
  }

  const std::vector<Sample> window(record.end() - static_cast<std::ptrdiff_t>(c.capacity),
                                   record.end());
  const OracleModel oracle = solve_batch(options, window, 1e-12);
  ASSERT_TRUE(oracle.converged);
  EXPECT_GE(svr.bias(), oracle.lowest_bias - kTolerance);
  EXPECT_LE(svr.bias(), oracle.highest_bias + kTolerance);

  std::mt19937_64 engine(kSeed);
  std::uniform_real_distribution<double> uniform(-1.2, 1.2);
  double largest = 0.0;
  for (int i = 0; i < 300; ++i) {
    std::vector<double> x(c.dimension);
    for (double& feature : x) feature = uniform(engine);
    largest = std::max(largest, std::fabs(svr.predict(x) - svr.bias() - oracle.expansion(x)));
  }
  for (const Sample& sample : window) {
    const double expansion = svr.predict(sample.x) - svr.bias();
    largest = std::max(largest, std::fabs(expansion - oracle.expansion(sample.x)));
  }
  std::ostringstream text;
  text << largest;
  RecordProperty("largest_difference", text.str());
  EXPECT_LE(largest, kTolerance);
}

std::vector<Case> cases() {
  std::vector<Case> all;
  for (const KernelKind kernel : kAllKernelKinds) {
    for (const RecordKind record : kAllRecordKinds) {
      for (const std::size_t dimension : {1u, 2u, 5u})
        all.push_back({kernel, record, dimension, 40, 10.0});
    }
    all.push_back({kernel, RecordKind::kSmooth, 2, 120, 1.0});
    all.push_back({kernel, RecordKind::kQuantised, 2, 120, 1.0});
    all.push_back({kernel, RecordKind::kSmooth, 3, 60, 100.0});
    all.push_back({kernel, RecordKind::kStuck, 2, 60, 100.0});
  }
  return all;
}

INSTANTIATE_TEST_SUITE_P(KernelsAndRecords, OracleTest, ::testing::ValuesIn(cases()));

}  // namespace
}  // namespace zerodrift::regression::testing
