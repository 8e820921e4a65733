// SPDX-License-Identifier: Apache-2.0
// What the cascade promises about its figures and about bad input. ZERODRIFT_ALLAN_RUNS=N simulates
// N runs for the coverage (and prints it), ZERODRIFT_ALLAN_SOAK_SAMPLES=N feeds N samples to the
// soak; both have small defaults.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <limits>
#include <map>
#include <numbers>
#include <random>
#include <vector>

#include "common/allan/rolling_allan.h"
#include "tests/unit/allan/noise_sources.h"

namespace zerodrift::allan {
namespace {

constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();

long long from_environment(const char* name, long long otherwise) {
  const char* value = std::getenv(name);
  return value == nullptr ? otherwise : std::atoll(value);
}

using Source = std::function<double()>;

// Share of runs whose 95 % interval holds the truth, for every tau from the shortest to T/5.
void expect_coverage(const char* what, const std::function<Source(std::uint64_t)>& source_of_run,
                     const std::function<double(double)>& truth, double shortest_tau_s) {
  constexpr int kSamples = 2048;
  const int runs = static_cast<int>(from_environment("ZERODRIFT_ALLAN_RUNS", 400));
  std::map<double, int> covered;
  for (int run = 0; run < runs; ++run) {
    const Source next = source_of_run(7700 + static_cast<std::uint64_t>(run));
    RollingAllan allan({.sample_interval_s = 1.0, .longest_tau_s = kSamples / 5.0});
    for (int i = 0; i < kSamples; ++i) allan.add(next());
    for (const AllanPoint& p : allan.points(Span::kSinceStart)) {
      if (p.tau_s < shortest_tau_s) continue;
      const double deviation = truth(p.tau_s);
      covered[p.tau_s] += p.lower_radps <= deviation && deviation <= p.upper_radps ? 1 : 0;
    }
  }
  double pooled = 0.0;
  for (const auto& [tau_s, count] : covered) {
    const double share = count / static_cast<double>(runs);
    pooled += share / static_cast<double>(covered.size());
    if (runs != 400) std::printf("%s, tau %g s: %.1f %%\n", what, tau_s, 100.0 * share);
    // 4 sigma of a binomial share of 0.95.
    EXPECT_NEAR(share, 0.95, 4.0 * std::sqrt(0.0475 / runs)) << what << ", tau = " << tau_s;
  }
  if (runs != 400) std::printf("%s, all: %.1f %%\n", what, 100.0 * pooled);
  // 93 to 97 %; eight taus of which every third is independent: sigma 0.007 of 400 runs.
  EXPECT_NEAR(pooled, 0.95, 0.02) << what;
}

TEST(CoveragePromise, WhiteNoise) {
  expect_coverage(
      "white",
      [](std::uint64_t seed) -> Source {
        return [noise = test::WhiteNoise(1e-3, 1.0, seed)]() mutable { return noise.next(); };
      },
      [](double tau_s) { return 1e-3 / std::sqrt(tau_s); }, 1.0);
}

constexpr int kFlickerOctaves = 18;  // to 128 times the record

// Exact Allan variance of what test::Flicker(b, 1 s, 1 s, octaves) gives: with V(m) the variance of
// a mean of m samples, sigma² = 2 V(m) - 2 V(2m), summed over its first-order Markov parts.
double flicker_deviation(double b, double tau_s) {
  const auto m = static_cast<int>(tau_s);
  double sum = 0.0;
  for (int octave = 0; octave < kFlickerOctaves; ++octave) {
    const double decay = std::exp(-1.0 / std::exp2(octave));
    const auto mean_variance = [decay](int n) {
      double v = 1.0;
      double power = 1.0;
      for (int k = 1; k < n; ++k) v += 2.0 * (power *= decay) * (1.0 - k / static_cast<double>(n));
      return v / n;
    };
    sum += 2.0 * mean_variance(m) - 2.0 * mean_variance(2 * m);
  }
  return b * std::sqrt(std::numbers::ln2 / std::numbers::pi * sum);
}

TEST(CoveragePromise, Flicker) {
  expect_coverage(
      "flicker",
      [](std::uint64_t seed) -> Source {
        return [noise = test::Flicker(1e-4, 1.0, 1.0, kFlickerOctaves, seed)]() mutable {
          return noise.next();
        };
      },
      [](double tau_s) { return flicker_deviation(1e-4, tau_s); }, 1.0);
}

TEST(CoveragePromise, RandomWalk) {
  // sigma² = K² tau / 3 (1 + 1 / (2 m²)) for a walk in steps.
  expect_coverage(
      "random walk",
      [](std::uint64_t seed) -> Source {
        return [noise = test::RandomWalk(1e-6, 1.0, seed)]() mutable { return noise.next(); };
      },
      [](double tau_s) { return 1e-6 * std::sqrt(tau_s / 3.0 * (1.0 + 0.5 / (tau_s * tau_s))); },
      2.0);
}

// White noise on a mean of 1 rad/s: nothing grows, and sums of 1e9 squares still have the digits.
TEST(SoakPromise, NothingGrowsAndTheFiguresStayRight) {
  const long long samples = from_environment("ZERODRIFT_ALLAN_SOAK_SAMPLES", 2'000'000);
  constexpr double kInterval = 0.005;
  constexpr double kNoise = 2.7e-7;
  RollingAllan allan({.sample_interval_s = kInterval, .longest_tau_s = 1e5, .window_s = 3600.0});
  test::WhiteNoise source(kNoise, kInterval, 41);
  const std::size_t memory = allan.memory_bytes();
  for (long long i = 0; i < samples; ++i) allan.add(1.0 + source.next());
  EXPECT_EQ(allan.memory_bytes(), memory);
  EXPECT_EQ(allan.samples(), static_cast<std::uint64_t>(samples));
  int judged = 0;
  for (const Span span : {Span::kSinceStart, Span::kRolling}) {
    for (const AllanPoint& p : allan.points(span)) {
      if (p.degrees_of_freedom < 50.0) continue;
      const double ratio = p.deviation_radps * std::sqrt(p.tau_s) / kNoise;
      if (samples > 2'000'000)
        std::printf("tau %g s: measured / true %.6f, edf %.3g\n", p.tau_s, ratio,
                    p.degrees_of_freedom);
      // 5 sigma of the estimate; one step of the angle, 2^-40 rad, is 1e-7 of the least variance.
      EXPECT_NEAR(ratio, 1.0, 5.0 / std::sqrt(2.0 * p.degrees_of_freedom) + 1e-6) << p.tau_s;
      ++judged;
    }
  }
  EXPECT_GT(judged, 20);
}

TEST(BadInput, ASpikeOfABillionSigmaLeavesTheWindowWholly) {
  constexpr double kSigma = 1e-8;
  const RollingAllanOptions options{.sample_interval_s = 0.01,
                                    .longest_tau_s = 2.56,
                                    .window_s = 20.0,
                                    .panes = 10,
                                    .angle_resolution_rad = 0x1.0p-50};
  RollingAllan hit(options);
  RollingAllan spared(options);
  ASSERT_GT(hit.largest_rate_radps(), 1e9 * kSigma);
  std::mt19937_64 random(8);
  std::normal_distribution<double> normal(0.0, kSigma);
  const auto feed = [&](int samples) {
    for (int i = 0; i < samples; ++i) {
      const double rate = normal(random);
      hit.add(rate);
      spared.add(rate);
    }
  };
  feed(3000);
  hit.add(1e9 * kSigma);
  spared.add(0.0);
  feed(10);
  EXPECT_GT(hit.point(0, Span::kRolling)->deviation_radps, 1e6 * kSigma);
  // Window, one pane, and twice the longest tau, which reaches back that far.
  feed(2000 + 200 + 2 * 256);
  for (std::size_t i = 0; i < hit.tau_count(); ++i) {
    const auto after = hit.point(i, Span::kRolling);
    const auto reference = spared.point(i, Span::kRolling);
    EXPECT_EQ(after->pairs, reference->pairs);
    // The angle's last step may be rounded otherwise: 2^-50 rad against 1e-10 rad of noise a
    // sample.
    EXPECT_NEAR(after->deviation_radps / reference->deviation_radps, 1.0, 1e-4) << after->tau_s;
    // Since start keeps it: what happened, happened.
    EXPECT_GT(hit.point(i, Span::kSinceStart)->deviation_radps, 1e4 * kSigma);
  }
}

// With the default resolution a billion sigma of a good gyro is 3800 rad/s, no rate at all.
TEST(BadInput, ASpikeBeyondTheLargestRateIsAMissingSample) {
  RollingAllan hit({.longest_tau_s = 1e5});
  RollingAllan gapped({.longest_tau_s = 1e5});
  test::WhiteNoise source(2.7e-7, 0.005, 9);
  for (int i = 0; i < 5000; ++i) {
    const double rate = source.next();
    hit.add(rate);
    gapped.add(rate);
    if (i != 2000) continue;
    hit.add(1e9 * 3.8e-6);
    gapped.gap(1);
  }
  EXPECT_EQ(hit.gaps(), 1u);
  for (std::size_t i = 0; i < 8; ++i) {
    EXPECT_EQ(hit.point(i, Span::kSinceStart)->deviation_radps,
              gapped.point(i, Span::kSinceStart)->deviation_radps);
  }
}

// A NaN costs the differences that would span it, 2m of them, and changes no other.
TEST(BadInput, ANanCostsTheDifferencesAcrossItAndNoMore) {
  RollingAllan allan({.sample_interval_s = 0.01, .longest_tau_s = 0.16});
  test::WhiteNoise source(1e-6, 0.01, 10);
  for (int i = 0; i < 1000; ++i) allan.add(i == 500 ? kMissing : source.next());
  for (std::size_t i = 0; i < allan.tau_count(); ++i) {
    const auto p = allan.point(i, Span::kSinceStart);
    const auto m = static_cast<std::uint64_t>(std::lround(p->tau_s / 0.01));
    EXPECT_EQ(p->pairs, (500 - 2 * m + 1) + (499 - 2 * m + 1));
    EXPECT_TRUE(std::isfinite(p->deviation_radps));
  }
}

// A frozen value that is no whole number of steps: the angle dithers by one step, nothing else is
// left in the window once the living past has gone.
TEST(BadInput, AStuckValueShowsAsNoNoiseInTheWindow) {
  const RollingAllanOptions options{
      .sample_interval_s = 0.01, .longest_tau_s = 1.0, .window_s = 10.0, .panes = 10};
  RollingAllan allan(options);
  test::WhiteNoise source(1e-6, 0.01, 11);
  for (int i = 0; i < 3000; ++i) allan.add(source.next());
  for (int i = 0; i < 1000 + 100 + 200; ++i) allan.add(1.2345678e-4);
  for (const AllanPoint& p : allan.points(Span::kRolling)) {
    // |d| <= 2 steps of rounding: sqrt(4 / 2) steps over tau.
    EXPECT_LE(p.deviation_radps, std::sqrt(2.0) * options.angle_resolution_rad / p.tau_s);
    EXPECT_TRUE(std::isfinite(p.upper_radps));
  }
  EXPECT_GT(allan.point(0, Span::kSinceStart)->deviation_radps, 5e-6);
}

// Where d needs 2m samples in a row, 0.99^2m of them are left: unbiased at short taus, nothing at
// long ones. Nothing is held or interpolated.
TEST(BadInput, OnePerCentOfRandomDropsBiasNothing) {
  constexpr int kSamples = 400000;
  constexpr double kNoise = 1e-6;
  RollingAllan allan({.sample_interval_s = 0.01, .longest_tau_s = 100.0});
  std::mt19937_64 random(12);
  std::bernoulli_distribution dropped(0.01);
  test::WhiteNoise source(kNoise, 0.01, 13);
  for (int i = 0; i < kSamples; ++i) {
    const double rate = source.next();
    allan.add(dropped(random) ? kMissing : rate);
  }
  for (const AllanPoint& p : allan.points(Span::kSinceStart)) {
    const double m = std::round(p.tau_s / 0.01);
    const double left = std::pow(0.99, 2.0 * m);
    const double per_sample = std::max(m / 16.0, 1.0);
    if (left * kSamples / m < 400.0) continue;  // m = 1 to 128
    EXPECT_NEAR(static_cast<double>(p.pairs) * per_sample / kSamples, left,
                6.0 * std::sqrt(2.0 * m * left / kSamples))  // runs of 2m and more are clusters
        << p.tau_s;
    // 5 sigma with 1 degree of freedom for 3 tau of differences that are left.
    EXPECT_NEAR(p.deviation_radps * std::sqrt(p.tau_s) / kNoise, 1.0,
                5.0 / std::sqrt(2.0 * left * kSamples / (3.0 * m)))
        << p.tau_s;
  }
  EXPECT_FALSE(allan.point(allan.tau_count() - 1, Span::kSinceStart));  // 20000 samples in a row
}

// Ten minutes without data: since start is what the two halves give together, the window forgets
// the first half on time, as if time had passed - which it has.
TEST(BadInput, ATenMinuteOutageLeavesTwoHalvesAndNoBridge) {
  constexpr int kHalf = 1 << 15;  // on every level's stride, so that the halves can be fed alone
  constexpr std::uint64_t kOutage = 600 * 64;
  const RollingAllanOptions options{.sample_interval_s = 1.0 / 64.0,
                                    .longest_tau_s = 64.0,
                                    .window_s = 700.0,
                                    .panes = 7,
                                    .angle_resolution_rad = 0x1.0p-50};
  RollingAllan whole(options), first(options), second(options);
  test::WhiteNoise source(1e-6, options.sample_interval_s, 14);
  const auto feed = [&](RollingAllan& half, int samples) {
    for (int i = 0; i < samples; ++i) {
      const double rate = 0.1 + source.next();
      whole.add(rate);
      half.add(rate);
    }
  };
  feed(first, kHalf);
  whole.gap(kOutage);
  feed(second, kHalf);
  EXPECT_EQ(whole.gaps(), 1u);
  for (std::size_t i = 0; i < whole.tau_count(); ++i) {
    const auto w = whole.point(i, Span::kSinceStart);
    const auto a = first.point(i, Span::kSinceStart);
    const auto b = second.point(i, Span::kSinceStart);
    EXPECT_EQ(w->pairs, a->pairs + b->pairs);
    const auto sum = [](const AllanPoint& p) {
      return static_cast<double>(p.pairs) * p.deviation_radps * p.deviation_radps;
    };
    // Rounded to other steps of 2^-50 rad: 1e-8 of the noise.
    EXPECT_NEAR(sum(*w) / (sum(*a) + sum(*b)), 1.0, 1e-5) << w->tau_s;
    // 512 s since the outage, 700 + 100 s of window: the end of the first half is out of it.
    EXPECT_EQ(whole.point(i, Span::kRolling)->pairs, b->pairs);
  }
}

// Memory for taus to 1e5 s at 200 Hz, whatever is fed.
TEST(MemoryPromise, AStreamNeedsLessThan128KilobytesAndNeverMore) {
  for (const TauGrid grid : {TauGrid::kOctave, TauGrid::kQuarterOctave}) {
    RollingAllan allan({.sample_interval_s = 0.005, .grid = grid, .longest_tau_s = 1e5});
    const std::size_t before = allan.memory_bytes();
    EXPECT_LE(before, 128'000u);
    test::WhiteNoise source(2.7e-7, 0.005, 15);
    for (int i = 0; i < 300000; ++i) allan.add(i % 1001 == 0 ? kMissing : source.next());
    allan.gap(1'000'000'000'000);
    for (int i = 0; i < 1000; ++i) allan.add(1e30);
    EXPECT_EQ(allan.memory_bytes(), before);
  }
}

}  // namespace
}  // namespace zerodrift::allan
