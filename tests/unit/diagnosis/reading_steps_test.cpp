// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/reading_steps.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/unit/diagnosis/written_numbers.h"

namespace zerodrift::diagnosis {
namespace {

constexpr double kUnit = 4.84813681109536e-6;  // deg/h

// Written in deg/h, and read again.
template <typename Format, typename Draw>
ReadingSteps steps_of(Format format, int readings, Draw&& draw) {
  ReadingSteps steps(kUnit);
  for (int i = 0; i < readings; ++i) steps.add(test::written(draw(), format) * kUnit);
  return steps;
}

TEST(ReadingSteps, OfANumberOfDecimalsIsOneForAllSizes) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> exponents(-1.0, 4.5);
  const auto steps =
      steps_of(test::Decimals{2}, 400, [&] { return std::pow(10.0, exponents(random)); });
  for (const double size : {0.5, 3.0, 800.0, -20'000.0})
    EXPECT_NEAR(steps.step_at(size * kUnit), 0.01 * kUnit, 1e-9 * kUnit) << size;
  EXPECT_EQ(steps.step_at(0.0), 0.0);
}

TEST(ReadingSteps, OfANumberOfDigitsGrowsWithTheSize) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> exponents(0.0, 5.0);
  const auto steps =
      steps_of(test::Digits{5}, 60, [&] { return std::pow(10.0, exponents(random)); });
  EXPECT_NEAR(steps.step_at(5.0 * kUnit), 1e-4 * kUnit, 1e-9 * kUnit);
  EXPECT_NEAR(steps.step_at(500.0 * kUnit), 1e-2 * kUnit, 1e-9 * kUnit);
  EXPECT_NEAR(steps.step_at(50'000.0 * kUnit), kUnit, 1e-9 * kUnit);
}

TEST(ReadingSteps, OfCountsIsTheCount) {
  std::mt19937_64 random(3);
  std::uniform_int_distribution<int> counts(-900, 900);
  const auto steps = steps_of(test::Decimals{2}, 500, [&] { return 0.05 * counts(random); });
  EXPECT_NEAR(steps.step_at(20.0 * kUnit), 0.05 * kUnit, 1e-9 * kUnit);
}

TEST(ReadingSteps, OfWhatWasNotRoundedIsNone) {
  std::mt19937_64 random(4);
  std::normal_distribution<double> normal;
  ReadingSteps steps(kUnit);
  for (int i = 0; i < 200; ++i) steps.add(normal(random));
  for (const double value : {0.1, 1.0, 2.0}) EXPECT_EQ(steps.step_at(value), 0.0);
}

// A table that turns at `held`, with noise, both in a column of `unit`: read as it is, and written
// with so many decimals that noise carries it over twenty steps.
void expect_only_what_was_rounded(double unit, double held, double noise, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(held, noise);
  const int decimals = static_cast<int>(std::ceil(std::log10(20.0 / noise)));
  ReadingSteps exact(unit);
  ReadingSteps rounded(unit);
  for (int i = 0; i < 2000; ++i) {
    const double rate = normal(random);
    exact.add(rate * unit);
    rounded.add(test::written(rate, test::Decimals{decimals}) * unit);
  }
  const double step = std::pow(10.0, -decimals) * unit;
  for (const double at : {held - noise, held + noise}) {
    EXPECT_EQ(exact.step_at(at * unit), 0.0) << held << " with " << noise << " in " << unit;
    EXPECT_NEAR(rounded.step_at(at * unit), step, 1e-9 * step)
        << held << " with " << noise << " in " << unit;
  }
}

// Before: whatever differs by less than a thousandth from a power of ten was one step of it.
TEST(ReadingSteps, OfARateHeldNearARoundOneAreThoseOfItsDigits) {
  const double per_degree_a_second = 3600.0 * kUnit;
  std::uint64_t seed = 5;
  for (const double unit :
       {kUnit, per_degree_a_second, 1e-3 * per_degree_a_second, 1.0, 1e-3, 1e-6}) {
    for (const double held : {0.1, 1.0, 10.0, 100.0, 1e5, 3.0, 20.0, 314.0}) {
      for (const double of_it : {1e-6, 1e-5, 1e-4, 1e-3})
        expect_only_what_was_rounded(unit, held, of_it * held, seed++);
    }
  }
}

}  // namespace
}  // namespace zerodrift::diagnosis
