// SPDX-License-Identifier: Apache-2.0
#include "common/report/thinning.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <random>

namespace zerodrift::report {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

struct Extent {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();

  void take(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
  bool operator==(const Extent&) const = default;
};

using Extents = std::map<std::size_t, Extent>;  // by column

class Noise {
 public:
  explicit Noise(std::uint64_t seed) : random_(seed) {}
  double next() { return static_cast<double>(random_() >> 11U) * 0x1p-52 - 1.0; }

 private:
  std::mt19937_64 random_;
};

AxisRange x_range_of(const Curve& curve, AxisScale scale) {
  return range_of(curve.x, scale, 0.0);
}

AxisRange y_range_of(const Curve& curve) {
  return range_of(curve.y, AxisScale::kLinear, 0.0);
}

Extents extents_of(const Curve& curve, const AxisRange& x) {
  Extents extents;
  for (std::size_t i = 0; i < curve.x.size(); ++i) {
    if (is_drawable(curve.x[i], x.scale) && std::isfinite(curve.y[i]))
      extents[column_of(curve.x[i], x)].take(curve.y[i]);
  }
  return extents;
}

Extents extents_of(const std::vector<PointRun>& runs, const AxisRange& x) {
  Extents extents;
  for (const PointRun& run : runs) {
    for (const DrawnPoint& point : run) extents[column_of(point.x, x)].take(point.y);
  }
  return extents;
}

std::size_t size_of(const std::vector<PointRun>& runs) {
  std::size_t size = 0;
  for (const PointRun& run : runs) size += run.size();
  return size;
}

Curve noisy_curve(std::size_t n, std::uint64_t seed, double missing_share) {
  Noise noise{seed};
  Curve curve{.name = "noise"};
  double walk = 0.0;
  for (std::size_t i = 0; i < n; ++i) {
    walk += 0.1 * noise.next();
    curve.x.push_back(0.005 * static_cast<double>(i));
    const bool spike = noise.next() > 0.9999;
    const bool missing = noise.next() * 0.5 + 0.5 < missing_share;
    curve.y.push_back(missing ? kNan : walk + noise.next() + (spike ? 1e3 : 0.0));
  }
  return curve;
}

TEST(ThinningLaws, EveryColumnKeepsItsLowestAndHighest) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    for (const AxisScale scale : {AxisScale::kLinear, AxisScale::kLogarithmic}) {
      for (const double missing : {0.0, 0.3, 0.99}) {
        const Curve curve = noisy_curve(100'000, seed, missing);
        const AxisRange x = x_range_of(curve, scale);
        const auto runs = thinned_points(curve, x, y_range_of(curve));
        ASSERT_EQ(extents_of(runs, x), extents_of(curve, x)) << "seed " << seed;
        ASSERT_LE(size_of(runs), kMostDrawnSamples);
      }
    }
  }
}

TEST(ThinningLaws, LoopsKeepThemTooAndEachBranchIsFollowed) {
  Noise noise{4};
  Curve curve{.name = "drift against temperature"};
  constexpr std::size_t kSamples = 100'000;
  constexpr double kLoops = 5.0;
  for (std::size_t i = 0; i < kSamples; ++i) {
    const double phase = 2.0 * M_PI * kLoops * static_cast<double>(i) / kSamples;
    curve.x.push_back(std::cos(phase));
    curve.y.push_back(std::sin(phase) + 0.01 * noise.next());
  }
  const AxisRange x = x_range_of(curve, AxisScale::kLinear);
  const auto runs = thinned_points(curve, x, y_range_of(curve));
  ASSERT_EQ(extents_of(runs, x), extents_of(curve, x));
  ASSERT_LE(size_of(runs), kMostDrawnSamples);
  ASSERT_EQ(runs.size(), 1U);
  // Each of 200 stretches spans 9 degrees and keeps both its ends, so no step is longer than the
  // chord of 9 degrees, 0.157, and the noise.
  for (std::size_t i = 1; i < runs[0].size(); ++i) {
    ASSERT_LT(std::hypot(runs[0][i].x - runs[0][i - 1].x, runs[0][i].y - runs[0][i - 1].y), 0.18);
  }
}

TEST(ThinningLaws, CloudsKeepTheirExtremesInEveryFourColumnsAndAreNoOutline) {
  Curve curve = noisy_curve(300'000, 5, 0.1);
  curve.style = CurveStyle::kPoints;
  const AxisRange x = x_range_of(curve, AxisScale::kLinear);
  const auto runs = thinned_points(curve, x, y_range_of(curve));
  const auto coarse = [](const Extents& fine) {
    Extents extents;
    for (const auto& [column, extent] : fine) {
      extents[column / kColumnsPerPointColumn].take(extent.low);
      extents[column / kColumnsPerPointColumn].take(extent.high);
    }
    return extents;
  };
  ASSERT_EQ(coarse(extents_of(runs, x)), coarse(extents_of(curve, x)));
  ASSERT_LE(size_of(runs), kMostDrawnSamples);
  // 200 columns have at most 400 extremes; the rest stands for the cloud.
  ASSERT_GT(size_of(runs), 3000U);
}

TEST(ThinningLaws, BandsKeepTheirEnvelope) {
  Noise noise{6};
  Curve curve{.name = "band"};
  std::map<std::size_t, Extent> right;
  for (std::size_t i = 0; i < 50'000; ++i) {
    curve.x.push_back(static_cast<double>(i));
    curve.y.push_back(0.0);
    curve.lower.push_back(-1.0 - std::abs(noise.next()));
    curve.upper.push_back(1.0 + std::abs(noise.next()));
  }
  const AxisRange x = x_range_of(curve, AxisScale::kLinear);
  for (std::size_t i = 0; i < curve.x.size(); ++i) {
    right[column_of(curve.x[i], x)].take(curve.lower[i]);
    right[column_of(curve.x[i], x)].take(curve.upper[i]);
  }
  const auto runs = thinned_band(curve, x, {-3.0, 3.0});
  ASSERT_EQ(runs.size(), 1U);
  ASSERT_EQ(runs[0].size(), right.size());
  for (const DrawnBand& band : runs[0]) {
    const Extent& extent = right.at(column_of(band.x, x));
    ASSERT_EQ(band.lower, extent.low);
    ASSERT_EQ(band.upper, extent.high);
  }
}

TEST(Thinning, ShortCurvesStayAsTheyAre) {
  const Curve curve = noisy_curve(kMostDrawnSamples, 7, 0.0);
  const auto runs = thinned_points(curve, x_range_of(curve, AxisScale::kLinear), y_range_of(curve));
  ASSERT_EQ(runs.size(), 1U);
  ASSERT_EQ(runs[0].size(), curve.x.size());
  for (std::size_t i = 0; i < curve.x.size(); ++i) {
    ASSERT_EQ(runs[0][i].x, curve.x[i]);
    ASSERT_EQ(runs[0][i].y, curve.y[i]);
  }
}

TEST(Thinning, TwoMillionSamplesBecomeAtMostFourThousandAndTheSpikeIsAmongThem) {
  Curve curve = noisy_curve(2'000'000, 8, 0.0);
  curve.y[1'234'567] = 1e6;
  const auto runs = thinned_points(curve, x_range_of(curve, AxisScale::kLinear), y_range_of(curve));
  EXPECT_LE(size_of(runs), kMostDrawnSamples);
  const bool found = std::any_of(runs[0].begin(), runs[0].end(), [&](const DrawnPoint& point) {
    return point.x == curve.x[1'234'567] && point.y == 1e6;
  });
  EXPECT_TRUE(found);
}

TEST(Thinning, InAShortCurveEveryMissingSampleIsAGap) {
  const Curve curve{
      .name = "a", .x = {kNan, 1.0, 2.0, 3.0, 4.0, 5.0}, .y = {0.0, 1.0, kNan, 3.0, INFINITY, 5.0}};
  EXPECT_EQ(thinned_points(curve, {1.0, 5.0}, {0.0, 5.0}).size(), 3U);
}

TEST(Thinning, InALongCurveOnlyGapsThatSpanAColumnAreGaps) {
  Curve curve = noisy_curve(80'000, 9, 0.0);  // 100 samples a column
  const AxisRange x = x_range_of(curve, AxisScale::kLinear);
  for (std::size_t i = 10'050; i < 10'060; ++i) curve.y[i] = kNan;
  EXPECT_EQ(thinned_points(curve, x, y_range_of(curve)).size(), 1U);
  for (std::size_t i = 20'000; i < 20'300; ++i) curve.y[i] = kNan;
  EXPECT_EQ(thinned_points(curve, x, y_range_of(curve)).size(), 2U);
}

TEST(Thinning, LowerEdgeOfABandThatALogarithmicAxisCannotShowLiesAtItsEnd) {
  const Curve curve{
      .name = "a", .x = {1.0, 2.0}, .y = {1.0, 1.0}, .lower = {-0.5, 0.2}, .upper = {2.0, 2.0}};
  const auto runs = thinned_band(curve, {1.0, 2.0}, {0.1, 10.0, AxisScale::kLogarithmic});
  ASSERT_EQ(runs.size(), 1U);
  EXPECT_EQ(runs[0][0].lower, 0.1);
  EXPECT_EQ(runs[0][1].lower, 0.2);
}

}  // namespace
}  // namespace zerodrift::report
