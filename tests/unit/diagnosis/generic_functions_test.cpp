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
  const auto functions = generic_functions(channels, 1.0);
  ASSERT_EQ(functions.size(), 3U);
  EXPECT_EQ(functions[2].depends_on, (std::vector<std::string>{"temperature_coil", "vibration"}));
  EXPECT_EQ(functions[2].resolutions.front().size(), 3U);
}

// What a least-squares fit of the columns leaves of the waveform's variance.
double left_of(const std::vector<double>& waveform,
               const std::vector<std::vector<double>>& columns) {
  const auto n = static_cast<Eigen::Index>(waveform.size());
  Eigen::MatrixXd a(n, static_cast<Eigen::Index>(columns.size()) + 1);
  for (std::size_t j = 0; j < columns.size(); ++j)
    a.col(static_cast<Eigen::Index>(j)) = Eigen::Map<const Eigen::VectorXd>(columns[j].data(), n);
  a.rightCols(1).setOnes();
  const Eigen::Map<const Eigen::VectorXd> y(waveform.data(), n);
  const Eigen::VectorXd rest = y - a * a.colPivHouseholderQr().solve(y);
  return rest.squaredNorm() / (y.array() - y.mean()).matrix().squaredNorm();
}

TEST(GenericFunctions, ANarrowBumpBetweenLongSoaksIsSeen) {
  MeasuredSeries series;
  series.interval_s = 1.0;
  series.size = 4000;
  ProbeSeries outer{.name = "coil_outer"};
  std::vector<double> bump;
  for (std::size_t i = 0; i < series.size; ++i) {  // soaks at -20 and 50 °C, ramps of 7 °C/min
    const std::size_t t = i % 2000;
    const double share = t < 600    ? static_cast<double>(t) / 600.0
                         : t < 1000 ? 1.0
                         : t < 1600 ? static_cast<double>(1600 - t) / 600.0
                                    : 0.0;
    const double temperature = -20.0 + 70.0 * share;
    outer.temperature_degc.push_back(temperature);
    bump.push_back(std::exp(-std::pow((temperature - 17.0) / 2.5, 2)));
  }
  outer.rate_degc_per_s.assign(series.size, 0.0);
  series.probes = {outer};
  for (auto& reference : series.reference_radps) reference.assign(series.size, 0.0);
  series.valid[0].assign(series.size, 1);
  series.since_power_on_s.assign(series.size, 1.0);
  const auto channels = moving_inputs(series, core::Axis::kX);
  ASSERT_EQ(channels.size(), 1U);
  const auto functions = generic_functions(channels, series.interval_s);
  ASSERT_EQ(functions[0].resolutions.size(), 2U);
  EXPECT_GT(left_of(bump, functions[0].resolutions[0]), 0.2);  // knots gather at the soaks
  EXPECT_LT(left_of(bump, functions[0].resolutions[1]), 0.02);
}

TEST(GenericFunctions, ThePlaceWithinACoilIsLookedForBetweenItsFaces) {
  MeasuredSeries series;
  series.interval_s = 1.0;
  series.size = 200;
  series.probes = {{.name = "coil_outer", .temperature_degc = spread(200, 5)},
                   {.name = "coil_inner", .temperature_degc = spread(200, 6)}};
  for (ProbeSeries& probe : series.probes) probe.rate_degc_per_s.assign(200, 0.0);
  for (auto& reference : series.reference_radps) reference.assign(200, 0.0);
  series.valid[0].assign(200, 1);
  series.since_power_on_s.assign(200, 1.0);
  const auto channels = moving_inputs(series, core::Axis::kX);
  ASSERT_EQ(channels.size(), 3U);
  EXPECT_EQ(channels[2].name, "temperature_coil");
  const double middle =
      0.5 * (series.probes[0].temperature_degc[7] + series.probes[1].temperature_degc[7]);
  EXPECT_EQ(channels[2].values[7], middle);
  const auto functions = generic_functions(channels, series.interval_s);
  ASSERT_EQ(functions.size(), 4U);  // three of one channel, one product: of the faces
  EXPECT_GT(functions[2].resolutions.size(), 2U);
  series.probes.push_back(series.probes[0]);
  series.probes.back().name = "coil";
  EXPECT_EQ(moving_inputs(series, core::Axis::kX).size(), 3U);  // measured: not made again
}

}  // namespace
}  // namespace zerodrift::diagnosis
