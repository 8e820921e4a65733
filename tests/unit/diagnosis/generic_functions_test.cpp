// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/generic_functions.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <random>

namespace zerodrift::diagnosis {
namespace {

std::vector<double> spread(std::size_t n, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(-3.0, 5.0);
  std::vector<double> values(n);
  for (double& value : values) value = uniform(random);
  return values;
}

TEST(SplineBasisLaws, SumsToOneIsNotNegativeAndHoldsEveryCubic) {
  const auto x = spread(500, 1);
  const auto basis = spline_basis(x, 6);
  ASSERT_EQ(basis.size(), 9U);
  Eigen::MatrixXd a(500, 9);
  Eigen::VectorXd cubic(500);
  for (Eigen::Index i = 0; i < 500; ++i) {
    const double at = x[static_cast<std::size_t>(i)];
    for (Eigen::Index j = 0; j < 9; ++j)
      a(i, j) = basis[static_cast<std::size_t>(j)][static_cast<std::size_t>(i)];
    EXPECT_NEAR(a.row(i).sum(), 1.0, 1e-12);
    EXPECT_GE(a.row(i).minCoeff(), 0.0);
    cubic(i) = 1.0 - 2.0 * at + 0.3 * at * at - 0.1 * at * at * at;
  }
  const Eigen::VectorXd fit = a * a.colPivHouseholderQr().solve(cubic);
  EXPECT_LT((fit - cubic).norm(), 1e-10 * cubic.norm());
}

TEST(SplineBasisAbuse, AChannelOfTwoValuesHasNoBadNumber) {
  std::vector<double> x(100, 0.0);
  for (std::size_t i = 50; i < 100; ++i) x[i] = 1.0;
  for (const auto& column : spline_basis(x, 6)) {
    for (const double value : column) EXPECT_TRUE(std::isfinite(value));
  }
}

TEST(GenericFunctions, OnlyWhatMovesCompetes) {
  MeasuredSeries series;
  series.size = 100;
  series.interval_s = 1.0;
  series.probes.push_back({.name = "coil",
                           .temperature_degc = spread(100, 2),
                           .rate_degc_per_s = std::vector<double>(100, 0.0)});
  for (auto& reference : series.reference_radps) reference.assign(100, 0.0);
  series.valid[0].assign(100, 1);
  series.valid[0][0] = 0;
  series.vibration_g = spread(100, 3);
  series.supply_v.assign(100, 5.0);
  series.supply_v[0] = 0.0;  // not switched on yet
  series.since_power_on_s.assign(100, 7.0);
  const auto channels = moving_inputs(series, core::Axis::kX);
  ASSERT_EQ(channels.size(), 2U);
  EXPECT_EQ(channels[0].name, "temperature_coil");
  EXPECT_EQ(channels[1].name, "vibration");
  const auto functions = generic_functions(channels);
  ASSERT_EQ(functions.size(), 3U);
  EXPECT_EQ(functions[2].depends_on, (std::vector<std::string>{"temperature_coil", "vibration"}));
  EXPECT_EQ(functions[2].columns.size(), 3U);
}

}  // namespace
}  // namespace zerodrift::diagnosis
