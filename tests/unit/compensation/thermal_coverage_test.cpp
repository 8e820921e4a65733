// SPDX-License-Identifier: Apache-2.0
#include "common/compensation/thermal_coverage.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>
#include <set>

#include "tests/unit/compensation/synthetic_gyro.h"

namespace zerodrift::compensation {
namespace {

using Cells = ThermalCoverage::Labels;

TEST(ThermalCoverage, HasACellForEveryTemperatureAndChange) {
  const auto cell = [](double degc, double degc_per_min) {
    return ThermalCoverage::cell_of(degc, degc_per_min);
  };
  EXPECT_EQ(cell(-60.0, -1.0), 0U);
  EXPECT_EQ(cell(-55.0, -1.0), 1U);
  EXPECT_EQ(cell(-60.0, -0.5), 36U) << "an edge belongs to the cell above it";
  EXPECT_EQ(cell(22.0, 0.0), 2 * 36 + 16U);
  EXPECT_EQ(cell(22.0, 0.5), 4 * 36 + 16U);
  const double huge = std::numeric_limits<double>::max();
  EXPECT_EQ(cell(-huge, -huge), 0U);
  EXPECT_EQ(cell(huge, huge), std::tuple_size_v<Cells> - 1);
}

Cells coverage_of(const Compensator& compensator, core::Axis axis) {
  const ThermalCoverage* coverage = compensator.coverage(axis);
  return coverage == nullptr ? Cells{} : coverage->labels();
}

std::uint64_t sum(const Cells& cells) {
  return std::accumulate(cells.begin(), cells.end(), std::uint64_t{0});
}

testing::GyroSpec chamber() {
  testing::GyroSpec spec;
  spec.duration_s = 3600.0;
  spec.low_degc = 12.0;
  spec.high_degc = 38.0;
  return spec;
}

// Rule: each label that had features counts once, where the chamber was in its middle. Against the
// chamber itself: the label's means are over 10 s, in which it moves by at most 0.26 degC and
// 0.026 degC/min, and its rate is an estimate; so of two cells either may be meant near an edge.
TEST(ThermalCoverage, CountsEachLabelWhereTheChamberWas) {
  const testing::GyroSpec spec = chamber();
  const testing::Chamber truth(spec);
  Compensator compensator{testing::options()};
  std::uint64_t labels = 0;
  Cells fewest{};
  Cells most{};
  testing::run(compensator, testing::make_record(spec), [&](const core::CompensatedSample&) {
    const Label* label = compensator.confirmed_label();
    if (label == nullptr || !label->features_ready[0]) return;
    ++labels;
    const double middle_s = core::seconds(label->begin + (label->end - label->begin) / 2);
    const double degc = truth.temperature_degc(middle_s);
    const double rate = truth.rate_degc_per_min(middle_s);
    std::set<std::size_t> meant;
    for (const double off_degc : {-0.5, 0.5}) {
      for (const double off_rate : {-0.15, 0.15})
        meant.insert(ThermalCoverage::cell_of(degc + off_degc, rate + off_rate));
    }
    for (const std::size_t cell : meant) {
      ++most[cell];
      if (meant.size() == 1) ++fewest[cell];
    }
  });
  compensator.finish_learning();
  ASSERT_GT(labels, 100U);
  for (const auto axis : kAxes) {
    const Cells cells = coverage_of(compensator, axis);
    EXPECT_EQ(sum(cells), labels);
    for (std::size_t i = 0; i < cells.size(); ++i) {
      EXPECT_GE(cells[i], fewest[i]) << i;
      EXPECT_LE(cells[i], most[i]) << i;
    }
  }
  EXPECT_GT(sum(fewest), labels / 2) << "or the edges decide everything";
}

TEST(ThermalCoverage, StaysOverAPowerOnAndIsForgottenWithTheModel) {
  const testing::GyroSpec spec = chamber();
  Compensator before{testing::options()};
  testing::run(before, testing::make_record(spec));
  before.finish_learning();
  const Cells learned = coverage_of(before, core::Axis::kX);
  Compensator after{testing::options()};
  EXPECT_EQ(after.coverage(core::Axis::kX), nullptr);
  ASSERT_TRUE(after.restore_models(
      std::make_shared<RestoredLearner>(testing::options(), before.learner().export_state())));
  after.finish_learning();
  EXPECT_EQ(coverage_of(after, core::Axis::kX), learned);
  ASSERT_TRUE(after.reset_models());
  after.finish_learning();
  EXPECT_EQ(sum(coverage_of(after, core::Axis::kX)), 0U);
}

}  // namespace
}  // namespace zerodrift::compensation
