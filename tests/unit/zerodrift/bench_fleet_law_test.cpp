// SPDX-License-Identifier: Apache-2.0
#include "services/zerodrift/bench_fleet_law.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

namespace zerodrift::services {
namespace {

std::vector<FleetPoint> points_on(double constant, double per_vehicle, double per_pair,
                                  const std::vector<double>& vehicles) {
  std::vector<FleetPoint> points;
  for (const double n : vehicles)
    points.push_back({n, constant + per_vehicle * n + per_pair * n * n});
  return points;
}

// Counted by hand, writers × readers: angular_rate 1×2, temperature 2×3, rate_reference 2×4,
// compensated_rate 2×3 and each instance heard by the other 2, allan_report 1×1, service_status
// 7×1, event 7×1, command 1×3, command_reply 3×1, replay_progress 5×4, checkpoint 2×2, navigation
// 1×1, twin_report 0×1.
constexpr std::uint64_t kPairsOfAVehicle = 2 + 6 + 8 + 6 + 2 + 1 + 7 + 7 + 3 + 3 + 20 + 4 + 1;

TEST(FleetLaw, AVehiclesPairsAreTheProductOfItsWritersAndReadersTopicByTopic) {
  EXPECT_EQ(matching_pairs(1, Partitioning::kNone), kPairsOfAVehicle);
  EXPECT_EQ(matching_pairs(1, Partitioning::kByVehicle), kPairsOfAVehicle);
}

TEST(FleetLaw, PairsGrowWithTheSquareInOneDomainAndLinearlyWithPartitions) {
  for (const std::uint32_t n : {2U, 3U, 10U, 1000U}) {
    EXPECT_EQ(matching_pairs(n, Partitioning::kNone), kPairsOfAVehicle * n * n) << n;
    EXPECT_EQ(matching_pairs(n, Partitioning::kByVehicle), kPairsOfAVehicle * n) << n;
  }
  EXPECT_EQ(matching_pairs(0, Partitioning::kNone), 0u);
}

TEST(FleetLaw, ADiscoveryServerIsHeardByTheConsolesThatNameNoPartition) {
  EXPECT_EQ(pairs_with_server(5, Partitioning::kNone), 10u);  // status and events
  EXPECT_EQ(pairs_with_server(5, Partitioning::kByVehicle), 0u);
}

TEST(FleetLaw, NoEndpointOfOneVehicleSharesAPartitionWithAnother) {
  for (const auto& process : vehicle_processes()) {
    for (const auto& endpoint : process.endpoints) {
      const auto one = partitions_of(process, endpoint, 1, Partitioning::kByVehicle);
      const auto other = partitions_of(process, endpoint, 11, Partitioning::kByVehicle);
      ASSERT_FALSE(one.empty()) << endpoint.topic;
      for (const auto& name : one) {
        EXPECT_EQ(std::count(other.begin(), other.end(), name), 0) << endpoint.topic << ' ' << name;
        EXPECT_NE(name, "") << endpoint.topic << ": the partition of those that name none";
      }
    }
  }
}

TEST(FleetGrowth, FindsTheCurveThatThePointsLieOn) {
  const std::vector<double> sizes{1, 2, 3, 5, 8};
  // 1e-9: rounding of a QR solution of five rows, whose condition number is below 1e4.
  const Growth linear = fit_growth(points_on(0.0, 7.0, 0.0, sizes));
  EXPECT_NEAR(linear.per_vehicle, 7.0, 1e-9);
  EXPECT_NEAR(linear.at(1000.0), 7000.0, 1e-5);
  const Growth quadratic = fit_growth(points_on(0.0, 7.0, 0.5, sizes));
  EXPECT_NEAR(quadratic.per_vehicle, 7.0, 1e-9);
  EXPECT_NEAR(quadratic.per_pair, 0.5, 1e-9);
  EXPECT_LT(quadratic.residual, 1e-9);
  const Growth all = fit_growth(points_on(40.0, 7.0, 0.5, sizes));
  EXPECT_NEAR(all.constant, 40.0, 1e-8);
  EXPECT_NEAR(all.at(100.0), 40.0 + 700.0 + 5000.0, 1e-5);
}

TEST(FleetGrowth, NeverFallsWithAFurtherVehicle) {
  // Sublinear: the free curve would bend down and be negative at 1000.
  const std::vector<FleetPoint> points{{1, 10}, {2, 19}, {3, 27}, {4, 34}, {5, 40}};
  const Growth growth = fit_growth(points);
  EXPECT_GE(growth.constant, 0.0);
  EXPECT_GE(growth.per_vehicle, 0.0);
  EXPECT_GE(growth.per_pair, 0.0);
  EXPECT_GT(growth.at(1000.0), growth.at(5.0));
}

TEST(FleetGrowth, NoiseOfAFewPercentIsNoLargeErrorAtTheNextSize) {
  constexpr unsigned kSeed = 7;
  std::mt19937 random(kSeed);
  std::normal_distribution<double> noise(1.0, 0.02);
  auto points = points_on(0.0, 100.0, 30.0, {1, 2, 3, 4, 5, 8});
  for (auto& point : points) point.figure *= noise(random);
  // 5 sigma of 2 %: the curve's own error at the end of its range is no larger than a point's, and
  // it goes on for a quarter more.
  EXPECT_NEAR(fit_growth(points).at(10.0) / (100.0 * 10.0 + 30.0 * 100.0), 1.0, 0.1)
      << "seed " << kSeed;
}

TEST(FleetGrowth, TellsHowFarItMissesALargestFleetThatItDidNotSee) {
  auto points = points_on(0.0, 7.0, 0.5, {1, 2, 3, 5, 8});
  EXPECT_NEAR(held_out_error(points), 0.0, 1e-9);
  points.back().figure *= 2.0;
  EXPECT_NEAR(held_out_error(points), -0.5, 1e-9);
  EXPECT_TRUE(std::isnan(held_out_error(points_on(0.0, 7.0, 0.0, {1, 2}))));
}

TEST(FleetGrowth, TellsTheKindOfGrowthAtItsEnd) {
  EXPECT_NEAR(exponent_at_the_end(points_on(0.0, 7.0, 0.0, {8, 1, 5})), 1.0, 1e-12);
  EXPECT_NEAR(exponent_at_the_end(points_on(0.0, 0.0, 3.0, {1, 5, 8})), 2.0, 1e-12);
  EXPECT_TRUE(std::isnan(exponent_at_the_end(points_on(0.0, 7.0, 0.0, {1}))));
}

TEST(FleetGrowth, FiguresThatAreNotAboveZeroSayNothing) {
  EXPECT_EQ(fit_growth(std::vector<FleetPoint>{}).at(10.0), 0.0);
  EXPECT_EQ(fit_growth(std::vector<FleetPoint>{{1, 0.0}, {2, std::nan("")}}).at(10.0), 0.0);
  const Growth one = fit_growth(std::vector<FleetPoint>{{1, 0.0}, {2, 6.0}, {4, 12.0}});
  EXPECT_NEAR(one.at(10.0), 30.0, 1e-9);
}

TEST(FleetGrowth, TheMedianIsTheMiddleOne) {
  EXPECT_EQ(median_of({3.0, 1.0, 2.0}), 2.0);
  EXPECT_EQ(median_of({4.0, 1.0, 2.0, 3.0}), 2.5);
  EXPECT_EQ(median_of({5.0}), 5.0);
}

}  // namespace
}  // namespace zerodrift::services
