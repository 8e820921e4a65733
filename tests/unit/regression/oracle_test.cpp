// SPDX-License-Identifier: Apache-2.0
// The online model equals the batch optimum of the samples in its window.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <sstream>

#include "common/regression/online_svr.h"
#include "tests/bench/synthetic_drift.h"
#include "tests/unit/regression/qp_oracle.h"
#include "tests/unit/regression/test_records.h"

namespace zerodrift::regression::testing {
namespace {

constexpr std::uint64_t kSeed = 20220101;

// The oracle stops at a slope of 1e-12 and the targets' jitter is up to 1e-11 (1e-13 C, C = 100).
// Both move f by their own size times the condition of the margin set, here below 1e2. The promise
// is 1e-9.
constexpr double kTolerance = 1e-9;

// The model is the oracle's, in its bias and at each of these points.
void expect_model(const OnlineSvr& svr, const OracleModel& oracle,
                  const std::vector<std::vector<double>>& points) {
  ASSERT_TRUE(oracle.converged);
  EXPECT_GE(svr.bias(), oracle.lowest_bias - kTolerance);
  EXPECT_LE(svr.bias(), oracle.highest_bias + kTolerance);
  double largest = 0.0;
  for (const std::vector<double>& x : points) {
    const double expansion = svr.predict(x) - svr.bias();
    largest = std::max(largest, std::fabs(expansion - oracle.expansion(x)));
  }
  std::ostringstream text;
  text << largest;
  ::testing::Test::RecordProperty("largest_difference", text.str());
  EXPECT_LE(largest, kTolerance);
}

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
  std::vector<std::vector<double>> points;
  for (const Sample& sample : window) points.push_back(sample.x);
  std::mt19937_64 engine(kSeed);
  std::uniform_real_distribution<double> uniform(-1.2, 1.2);
  for (int i = 0; i < 300; ++i) {
    points.emplace_back(c.dimension);
    for (double& feature : points.back()) feature = uniform(engine);
  }
  expect_model(svr, solve_batch(options, window, 1e-12), points);
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

// ---- The drifts that the benchmarks run on ----

enum class Resolution { kFull, kSixteenthDegree };

struct DriftCase {
  KernelKind kernel;
  bench::DriftRecord record;
  Resolution resolution;
  std::size_t point_count;  // of the whole record: how near to each other its samples are
  WindowPolicy window;
  double c;
};

void PrintTo(const DriftCase& c, std::ostream* out) {
  *out << name(c.kernel) << " " << bench::name(c.record) << " of " << c.point_count << " points"
       << (c.resolution == Resolution::kFull ? "" : ", temperatures of 1/16 degC")
       << (c.window == WindowPolicy::kFifo ? ", FIFO" : ", two tiers") << ", C " << c.c << ", seed "
       << kSeed;
}

// A probe that reads 0.0625 °C on a record of 60 °C, which is scaled to [-1, 1].
double as_read(double feature) {
  return quantised(feature, 0.0625 / 30.0);
}

// 240 samples from the middle of the record.
std::vector<Sample> drift_samples(const DriftCase& c) {
  const auto points = bench::synthetic_drift(c.record, c.point_count);
  std::vector<Sample> samples;
  for (std::size_t i = c.point_count / 3; i < c.point_count / 3 + 240; ++i) {
    const auto [temperature, rate] = points[i].x;
    if (c.resolution == Resolution::kFull) {
      samples.push_back({{temperature, rate}, points[i].label});
    } else {
      samples.push_back({{as_read(temperature), as_read(rate)}, points[i].label});
    }
  }
  return samples;
}

std::vector<Sample> held_samples(const OnlineSvr& svr) {
  std::vector<Sample> samples;
  for (std::size_t slot = 0; slot < svr.slot_count(); ++slot) {
    if (svr.set_of(slot) == SampleSet::kVacant) continue;
    samples.push_back({{svr.feature(slot, 0), svr.feature(slot, 1)}, svr.target(slot)});
  }
  return samples;
}

void expect_finished_optimum(const OnlineSvr& svr, UpdateOutcome outcome) {
  ASSERT_NE(outcome, UpdateOutcome::kUnfinished);
  ASSERT_NE(outcome, UpdateOutcome::kBusy);
  ASSERT_LE(svr.max_kkt_violation(), svr.options().kkt_bound());
  ASSERT_LE(std::fabs(svr.theta_sum()), theta_sum_bound(svr));
}

class DriftOracleTest : public ::testing::TestWithParam<DriftCase> {};

TEST_P(DriftOracleTest, LearningAndForgettingInAnyOrderKeepTheBatchOptimum) {
  const DriftCase& c = GetParam();
  OnlineSvrOptions options = options_of(2, 60, c.c, c.kernel);
  options.window = c.window;
  OnlineSvr svr(options);
  std::mt19937_64 engine(kSeed);
  for (const Sample& sample : drift_samples(c)) {
    ASSERT_NO_FATAL_FAILURE(expect_finished_optimum(svr, svr.add(sample.x, sample.y).outcome));
    if (engine() % 4 != 0) continue;
    const UpdateReport report = svr.forget(engine() % svr.slot_count());  // refused if vacant
    ASSERT_NO_FATAL_FAILURE(expect_finished_optimum(svr, report.outcome));
  }
  if (c.c > 100.0) return;  // the promise of 1e-9 ends there
  const std::vector<Sample> held = held_samples(svr);
  std::vector<std::vector<double>> points;
  for (const Sample& sample : held) points.push_back(sample.x);
  expect_model(svr, solve_batch(options, held, 1e-12), points);
}

std::vector<DriftCase> drift_cases() {
  std::vector<DriftCase> all;
  for (const KernelKind kernel : kAllKernelKinds) {
    for (const auto record : {bench::DriftRecord::kRamp, bench::DriftRecord::kCycle}) {
      for (const Resolution resolution : {Resolution::kFull, Resolution::kSixteenthDegree}) {
        for (const double c : {1.0, 10.0, 100.0, 1000.0}) {
          all.push_back({kernel, record, resolution, 1000, WindowPolicy::kTwoTier, c});
          all.push_back({kernel, record, resolution, 15000, WindowPolicy::kFifo, c});
        }
      }
    }
  }
  return all;
}

INSTANTIATE_TEST_SUITE_P(KernelsAndDrifts, DriftOracleTest, ::testing::ValuesIn(drift_cases()));

}  // namespace
}  // namespace zerodrift::regression::testing
