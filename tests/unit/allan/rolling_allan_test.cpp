// SPDX-License-Identifier: Apache-2.0
#include "common/allan/rolling_allan.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <random>
#include <stdexcept>
#include <vector>

#include "common/allan/confidence.h"
#include "common/allan/deviations.h"
#include "common/allan/noise_units.h"
#include "tests/support/allocation_count.h"
#include "tests/unit/allan/noise_sources.h"

namespace zerodrift::allan {
namespace {

constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();

struct Expected {
  std::uint64_t pairs = 0;
  double deviation = 0.0;
};

// Straight from the definition: angles at sample boundaries, a pair at every multiple of the stride
// whose 2m samples are all there and whose last sample is not before `first_sample`.
Expected brute_force(const std::vector<double>& rate, double interval_s, Cluster cluster,
                     std::size_t first_sample) {
  const std::size_t m = cluster.size();
  const std::size_t stride = std::size_t{1} << cluster.level;
  std::vector<long double> angle(rate.size() + 1, 0.0L);
  std::vector<std::size_t> missing(rate.size() + 1, 0);
  for (std::size_t i = 0; i < rate.size(); ++i) {
    const bool absent = std::isnan(rate[i]);
    missing[i + 1] = missing[i] + (absent ? 1 : 0);
    angle[i + 1] =
        angle[i] +
        (absent ? 0.0L : static_cast<long double>(rate[i]) * static_cast<long double>(interval_s));
  }
  Expected e;
  long double sum = 0.0L;
  for (std::size_t k = 2 * m; k < angle.size(); ++k) {
    if (k % stride != 0 || k < first_sample + 1 || missing[k] != missing[k - 2 * m]) continue;
    const long double d = angle[k] - 2.0L * angle[k - m] + angle[k - 2 * m];
    sum += d * d;
    ++e.pairs;
  }
  const double tau = static_cast<double>(m) * interval_s;
  if (e.pairs > 0)
    e.deviation =
        std::sqrt(static_cast<double>(sum) / (2.0 * tau * tau * static_cast<double>(e.pairs)));
  return e;
}

void expect_point(const std::optional<AllanPoint>& got, const Expected& expected) {
  ASSERT_EQ(got.has_value(), expected.pairs > 0);
  if (!got) return;
  EXPECT_EQ(got->pairs, expected.pairs);
  EXPECT_NEAR(got->deviation_radps, expected.deviation, 1e-6 * expected.deviation);
}

// White noise of 1 rad a sample in steps of q: too large by q²/8 at tau0, which is half of the six
// twelfths q² that three rounded angles add to a variance of 2 rad². What chance leaves beside
// that: twice the mean product of d with its rounding, of 0.7 q / sqrt(n), n differences. Rounding
// toward zero would be off by 0.6 q, 75 times what is allowed.
TEST(RollingAllanLaws, RoundingTheAngleCostsTheSquareOfTheStep) {
  constexpr int kSamples = 200000;
  for (const double step : {0.5, 0.1, 0.02, 4.4e-4}) {
    test::WhiteNoise source(1.0, 1.0, 51);
    RollingAllan allan(
        {.sample_interval_s = 1.0, .longest_tau_s = 1.0, .angle_resolution_rad = step});
    std::vector<double> rate;
    for (int i = 0; i < kSamples; ++i) {
      rate.push_back(source.next());
      allan.add(rate.back());
    }
    const auto expected = brute_force(rate, 1.0, {.level = 0, .lag = 1}, 0);
    const double error =
        allan.point(0, Span::kSinceStart)->deviation_radps / expected.deviation - 1.0;
    EXPECT_NEAR(error, 0.125 * step * step, 5.0 * 0.7 * step / std::sqrt(kSamples)) << step;
  }
}

// 1e-4 deg/√h, quieter than any, at 200 Hz: 1.5e-9 rad a sample beside the default step of 9e-13.
TEST(RollingAllanLaws, TheDefaultStepIsFineForTheQuietestGyro) {
  constexpr double kInterval = 0.005;
  test::WhiteNoise source(angle_random_walk_rad_rts(1e-4), kInterval, 52);
  RollingAllan allan({.sample_interval_s = kInterval, .longest_tau_s = 0.08});
  std::vector<double> rate;
  for (int i = 0; i < 200000; ++i) {
    rate.push_back(source.next());
    allan.add(rate.back());
  }
  for (std::size_t i = 0; i < allan.tau_count(); ++i) {
    const auto point = allan.point(i, Span::kSinceStart);
    const auto m = static_cast<std::uint32_t>(std::lround(point->tau_s / kInterval));
    const auto expected = brute_force(rate, kInterval, {.level = 0, .lag = m}, 0);
    // The law above: 5 sigma of chance are 5e-6.
    EXPECT_NEAR(point->deviation_radps / expected.deviation, 1.0, 5e-6) << point->tau_s;
  }
}

TEST(RollingAllanLaws, EqualsBruteForceOverRandomWindowsTausAndGaps) {
  for (std::uint64_t seed = 1; seed <= 24; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937_64 random(seed);
    RollingAllanOptions options;
    options.sample_interval_s = 0.01;
    options.angle_resolution_rad =
        0x1.0p-52;  // of no account even where a lone pair happens to be small
    options.grid = seed % 2 == 0 ? TauGrid::kOctave : TauGrid::kQuarterOctave;
    options.longest_tau_s = 0.01 * static_cast<double>(1 + random() % 600);
    options.panes = 1 + random() % 12;
    const std::size_t pane = 1 + random() % 300;
    options.window_s = 0.01 * static_cast<double>(pane * options.panes);
    RollingAllan allan(options);
    const auto taus = clusters(
        options.grid, static_cast<std::uint64_t>(std::llround(options.longest_tau_s / 0.01)));
    ASSERT_EQ(allan.tau_count(), taus.size());

    std::vector<double> rate;
    std::normal_distribution<double> noise(1e-3, 1e-4);
    const std::size_t gap_every = 2 + random() % 2000;
    while (rate.size() < 6000) {
      const std::size_t before = rate.size();
      if (random() % gap_every == 0) {
        const std::size_t missing = 1 + random() % (random() % 4 == 0 ? 3000 : 5);
        allan.gap(missing);
        rate.insert(rate.end(), missing, kMissing);
      } else if (random() % gap_every == 0) {
        rate.push_back(kMissing);
        allan.add(kMissing);
      } else {
        rate.push_back(noise(random));
        allan.add(rate.back());
      }
      if (rate.size() / 1500 == before / 1500) continue;
      const std::size_t open_pane = rate.size() / pane;
      const std::size_t first = open_pane > options.panes ? (open_pane - options.panes) * pane : 0;
      for (std::size_t i = 0; i < taus.size(); ++i) {
        SCOPED_TRACE("m = " + std::to_string(taus[i].size()));
        expect_point(allan.point(i, Span::kSinceStart), brute_force(rate, 0.01, taus[i], 0));
        expect_point(allan.point(i, Span::kRolling), brute_force(rate, 0.01, taus[i], first));
      }
    }
  }
}

// The stride of tau/16 is all that tells them apart; at m <= 16 nothing does.
TEST(RollingAllanLaws, SmallClustersEqualTheBatchDeviation) {
  test::WhiteNoise source(1e-6, 0.005, 3);
  RollingAllan allan({.longest_tau_s = 0.2, .window_s = 10.0});
  std::vector<double> rate(5000);
  for (double& y : rate) allan.add(y = source.next() + 7.3e-5);
  const auto batch = overlapping_allan(angle_from_rate(rate, 0.005), 0.005, TauGrid::kOctave);
  for (std::size_t i = 0; i < 5; ++i) {
    const auto p = allan.point(i, Span::kSinceStart);
    EXPECT_EQ(p->pairs, batch[i].pairs);
    // One fixed-point step against the smallest deviation, 1.4e-5 rad/s * 5 ms: 1e-5 of its square,
    // averaged out.
    EXPECT_NEAR(p->deviation_radps, batch[i].deviation_radps, 1e-6 * batch[i].deviation_radps);
    EXPECT_EQ(p->noise, batch[i].noise);
    EXPECT_NEAR(p->degrees_of_freedom, batch[i].degrees_of_freedom,
                1e-6 * batch[i].degrees_of_freedom);
  }
}

double slope(const RollingAllan& allan, std::size_t from, std::size_t to) {
  const auto a = allan.point(from, Span::kSinceStart);
  const auto b = allan.point(to, Span::kSinceStart);
  return std::log(b->deviation_radps / a->deviation_radps) / std::log(b->tau_s / a->tau_s);
}

TEST(RollingAllanLaws, WhiteNoiseHasSlopeMinusOneHalf) {
  constexpr std::uint64_t kSeed = 21;
  test::WhiteNoise source(2.7e-7, 0.005, kSeed);
  RollingAllan allan({.longest_tau_s = 100.0});
  for (int i = 0; i < 1 << 20; ++i) allan.add(source.next());
  // m = 1 to 1024: 5 sigma of the estimate at 1024 (edf about 1500) over the log distance.
  EXPECT_NEAR(slope(allan, 0, 10), -0.5, 5.0 / std::sqrt(3000.0) / std::log(1024.0))
      << "seed " << kSeed;
  for (std::size_t i = 0; i <= 10; ++i) {
    EXPECT_EQ(allan.point(i, Span::kSinceStart)->noise, NoiseType::kAngleRandomWalk)
        << "tau " << allan.tau_s(i);
  }
}

TEST(RollingAllanLaws, RandomWalkHasSlopePlusOneHalf) {
  constexpr std::uint64_t kSeed = 22;
  test::RandomWalk source(1e-7, 0.005, kSeed);
  RollingAllan allan({.longest_tau_s = 100.0});
  for (int i = 0; i < 1 << 20; ++i) allan.add(source.next());
  // m = 16 to 1024: 5 sigma at 1024 (edf about 950); the discrete walk's 1/(4 m²) is below 1e-3.
  EXPECT_NEAR(slope(allan, 4, 10), 0.5, 5.0 / std::sqrt(1900.0) / std::log(64.0))
      << "seed " << kSeed;
  EXPECT_EQ(allan.point(10, Span::kSinceStart)->noise, NoiseType::kRateRandomWalk);
}

// Rates that are whole steps: the same alternating stream with and without a mean of 1 rad/s gives
// the same sums to the bit, long after a double angle would have lost the alternation, and through
// wrap-around of the 64 bits.
TEST(RollingAllanLaws, ALargeMeanChangesNoBitHoweverLongItRuns) {
  RollingAllanOptions options{
      .sample_interval_s = 1.0, .longest_tau_s = 1000.0, .window_s = 3200.0};
  options.angle_resolution_rad = 0x1.0p-48;  // wraps after 65536 rad
  RollingAllan small(options);
  RollingAllan large(options);
  ASSERT_GT(large.largest_rate_radps(), 10.0);
  std::uint64_t state = 1;
  for (int i = 0; i < 300000; ++i) {
    state = state * 6364136223846793005u + 1442695040888963407u;
    const double y = static_cast<double>(state >> 54) * 0x1.0p-48;
    small.add(y);
    large.add(y + 8.0);  // 2.4e6 rad in all: wraps 36 times
  }
  for (const Span span : {Span::kSinceStart, Span::kRolling}) {
    for (std::size_t i = 0; i < small.tau_count(); ++i) {
      EXPECT_EQ(small.point(i, span)->deviation_radps, large.point(i, span)->deviation_radps)
          << small.tau_s(i);
    }
  }
}

// Steps far coarser than the increments: the carried remainder keeps the angle within one step, so
// long taus are right and only the quantization of one step is added, sigma = sqrt(3) Q / tau with
// Q <= 1 step.
TEST(RollingAllanLaws, RemaindersAreCarriedNotLost) {
  RollingAllanOptions options{.sample_interval_s = 0.01, .longest_tau_s = 10.0};
  options.angle_resolution_rad = 1e-3;
  RollingAllan allan(options);
  for (int i = 0; i < 100000; ++i)
    allan.add(i < 50000 ? 0.0101 : 0.0202);  // a tenth of a step a sample
  for (std::size_t i = 0; i < allan.tau_count(); ++i) {
    const auto p = allan.point(i, Span::kSinceStart);
    const Expected step = brute_force(
        [] {
          std::vector<double> r(100000, 0.0101);
          std::fill(r.begin() + 50000, r.end(), 0.0202);
          return r;
        }(),
        0.01, clusters(TauGrid::kOctave, 1000)[i], 0);
    EXPECT_NEAR(p->deviation_radps, step.deviation, std::sqrt(3.0) * 1e-3 / p->tau_s) << p->tau_s;
  }
}

TEST(RollingAllanLaws, RollingForgetsASpikeThatSinceStartKeeps) {
  test::WhiteNoise source(2.7e-7, 0.005, 9);
  RollingAllan allan({.longest_tau_s = 1.0, .window_s = 20.0});
  for (int i = 0; i < 2000; ++i) allan.add(source.next());
  const double clean = allan.point(0, Span::kRolling)->deviation_radps;
  allan.add(1e6 * clean);
  EXPECT_GT(allan.point(0, Span::kRolling)->deviation_radps, 1e3 * clean);
  for (int i = 0; i < 4000 + 125 + 400; ++i) allan.add(source.next());  // window, one pane, 2 tau
  // Two estimates of one noise, 5 sigma of each with 2/3 * 4000 degrees of freedom.
  EXPECT_NEAR(allan.point(0, Span::kRolling)->deviation_radps / clean, 1.0,
              2.0 * 5.0 / std::sqrt(2.0 * 1300.0));
  EXPECT_GT(allan.point(0, Span::kSinceStart)->deviation_radps, 1e3 * clean);
}

TEST(RollingAllanAbuse, RatesThatAreNoRatesAreMissingSamples) {
  RollingAllan allan({.longest_tau_s = 1.0});
  RollingAllan reference({.longest_tau_s = 1.0});
  test::WhiteNoise source(2.7e-7, 0.005, 4);
  for (int i = 0; i < 3000; ++i) {
    const double y = source.next();
    allan.add(y);
    reference.add(y);
    if (i % 700 != 699) continue;
    allan.add(std::numeric_limits<double>::quiet_NaN());
    allan.add(std::numeric_limits<double>::infinity());
    allan.add(-std::numeric_limits<double>::infinity());
    allan.add(1e300);
    allan.add(-1.01 * allan.largest_rate_radps());
    reference.gap(5);
  }
  EXPECT_EQ(allan.gaps(), 4u);
  EXPECT_EQ(allan.samples(), 3000u);
  for (std::size_t i = 0; i < allan.tau_count(); ++i) {
    EXPECT_EQ(allan.point(i, Span::kSinceStart)->deviation_radps,
              reference.point(i, Span::kSinceStart)->deviation_radps);
    EXPECT_EQ(allan.point(i, Span::kSinceStart)->pairs,
              reference.point(i, Span::kSinceStart)->pairs);
  }
}

// The largest rate, switched in sign at the worst moment, at the longest tau: |d| = 2 tau rate,
// still within 63 bits.
TEST(RollingAllanAbuse, TheLargestRateDoesNotOverflow) {
  RollingAllan allan({.sample_interval_s = 1.0, .longest_tau_s = 1024.0, .window_s = 1e4});
  const double rate = allan.largest_rate_radps();
  for (int i = 0; i < 1024; ++i) allan.add(rate);
  for (int i = 0; i < 1024; ++i) allan.add(-rate);
  const auto p = allan.point(allan.tau_count() - 1, Span::kSinceStart);
  EXPECT_EQ(p->pairs, 1u);
  EXPECT_NEAR(p->deviation_radps, std::sqrt(2.0) * rate, 1e-12 * rate);  // (2 rate)² / 2
}

TEST(RollingAllanAbuse, HugeGapsEmptyTheWindowAndNothingElse) {
  for (const std::uint64_t missing :
       {std::uint64_t{1} << 20, std::uint64_t{1} << 60, ~std::uint64_t{0}}) {
    RollingAllan allan({.sample_interval_s = 1.0, .longest_tau_s = 64.0, .window_s = 320.0});
    for (int i = 0; i < 1000; ++i) allan.add(1e-6 * (i % 2));
    const auto before = allan.point(0, Span::kSinceStart);
    allan.gap(missing);
    EXPECT_FALSE(allan.point(0, Span::kRolling));
    EXPECT_EQ(allan.point(0, Span::kSinceStart)->pairs, before->pairs);
    for (int i = 0; i < 200; ++i) allan.add(1e-6 * (i % 2));
    EXPECT_EQ(allan.point(0, Span::kRolling)->pairs, 199u);
  }
}

TEST(RollingAllanAbuse, AStuckOutputHasZeroDeviationAndNoNan) {
  RollingAllan allan({.longest_tau_s = 1.0, .angle_resolution_rad = 0x1.0p-40});
  for (int i = 0; i < 5000; ++i) allan.add(0.0);
  for (const AllanPoint& p : allan.points(Span::kSinceStart)) {
    EXPECT_EQ(p.deviation_radps, 0.0);
    EXPECT_EQ(p.upper_radps, 0.0);
    EXPECT_GT(p.degrees_of_freedom, 0.0);
  }
}

TEST(RollingAllanAbuse, NothingIsSaidBeforeTheFirstPair) {
  RollingAllan allan({.longest_tau_s = 1.0});
  EXPECT_TRUE(allan.points(Span::kRolling).empty());
  allan.add(1.0);
  EXPECT_TRUE(allan.points(Span::kSinceStart).empty());
  allan.add(2.0);
  EXPECT_EQ(allan.points(Span::kSinceStart).size(), 1u);
}

TEST(RollingAllanAbuse, ATauThatItLacksEndsTheProcessInEveryBuild) {
  const RollingAllan rolling{RollingAllanOptions{}};
  const std::size_t beyond = rolling.tau_count();
  EXPECT_DEATH(static_cast<void>(rolling.tau_s(beyond)), "is asked for one of its taus");
  EXPECT_DEATH(static_cast<void>(rolling.point(beyond, Span::kSinceStart, 0.95)),
               "is asked for one of its taus");
}

TEST(RollingAllanAbuse, WrongOptionsAreNamed) {
  const auto names = [](const RollingAllanOptions& options, const char* key) {
    const auto error = options.validate();
    return error && error->find(key) == 0;
  };
  EXPECT_TRUE(names({.sample_interval_s = -1.0}, "sample_interval_s"));
  EXPECT_TRUE(names({.sample_interval_s = std::nan("")}, "sample_interval_s"));
  EXPECT_TRUE(names({.longest_tau_s = 0.001}, "longest_tau_s"));
  EXPECT_TRUE(names({.longest_tau_s = 1e300}, "longest_tau_s"));
  EXPECT_TRUE(names({.window_s = 0.0}, "window_s"));
  EXPECT_TRUE(names({.panes = 0}, "panes"));
  EXPECT_TRUE(names({.angle_resolution_rad = 0.0}, "angle_resolution_rad"));
  EXPECT_FALSE(RollingAllanOptions{}.validate());
  EXPECT_THROW(RollingAllan({.panes = 0}), std::invalid_argument);
}

TEST(RollingAllanResources, NeitherAddNorGapNorPointAllocates) {
  RollingAllan allan({.grid = TauGrid::kQuarterOctave, .longest_tau_s = 100.0, .window_s = 50.0});
  const std::size_t before = allocation_count();
  double sum = 0.0;
  for (int i = 0; i < 100000; ++i) {
    allan.add(1e-6 * (i % 7));
    if (i % 9973 == 0) allan.gap(17);
    if (i % 9973 == 0) allan.add(kMissing);
    if (i % 5000 == 4999) sum += allan.point(3, Span::kRolling)->deviation_radps;
  }
  EXPECT_EQ(allocation_count(), before);
  EXPECT_GT(sum, 0.0);
}

// The budget for taus to 1e5 s at 200 Hz is 128 kB a stream.
TEST(RollingAllanResources, FitsItsMemoryBudget) {
  for (const TauGrid grid : {TauGrid::kOctave, TauGrid::kQuarterOctave}) {
    EXPECT_LE(RollingAllan({.grid = grid, .longest_tau_s = 1e5}).memory_bytes(), 128000u);
  }
}

}  // namespace
}  // namespace zerodrift::allan
