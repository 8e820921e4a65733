// SPDX-License-Identifier: Apache-2.0
#include "common/allan/stuck_detector.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>

#include "tests/support/allocation_count.h"

namespace zerodrift::allan {
namespace {

using Output = StuckDetector::Output;

// White noise of `sigma_steps` quantisation steps, rounded to whole steps.
class QuantisedGyro {
 public:
  QuantisedGyro(double sigma_steps, std::uint64_t seed)
      : random_(seed), normal_(0.3, sigma_steps) {}
  double next() { return 0.05 * std::round(normal_(random_)); }

 private:
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
};

std::uint64_t samples_until_stuck(StuckDetector& detector, double value, std::uint64_t limit) {
  for (std::uint64_t n = 1; n <= limit; ++n) {
    if (detector.add(value) == Output::kStuck) return n;
  }
  return 0;
}

TEST(StuckDetectorLaws, ALivingGyroThatFreezesIsFoundAfterTheShortestRun) {
  StuckDetector detector({.min_run = 200});
  QuantisedGyro gyro(5.0, 1);
  for (int i = 0; i < 100000; ++i) ASSERT_EQ(detector.add(gyro.next()), Output::kAlive);
  // Neighbours are equal with 1 / (2 sqrt(pi) 5) = 5.64 %; 4 sigma of 1e5.
  EXPECT_NEAR(detector.repeat_probability(), 0.0564, 0.003);
  EXPECT_EQ(samples_until_stuck(detector, 1e3, 10000), 200u);
  EXPECT_EQ(detector.add(1e3), Output::kStuck);
  EXPECT_EQ(detector.add(1e3 + 1e-9), Output::kAlive);
}

// Repeats of 95 %: with p^(n-1) = 1e-12 a run of 540 is what chance must be granted.
TEST(StuckDetectorLaws, AStreamThatRepeatsByNatureIsGrantedLongerRuns) {
  StuckDetector detector({.min_run = 2, .longest_run_factor = 1.0});
  std::mt19937_64 random(2);
  std::bernoulli_distribution changes(0.05);
  double value = 0.0;
  for (int i = 0; i < 200000; ++i) {
    if (changes(random)) value += 1.0;
    const Output output = detector.add(value);
    if (i > 200) {
      ASSERT_EQ(output, Output::kAlive) << i;
    }
  }
  const double p = detector.repeat_probability();
  EXPECT_NEAR(p, 0.95, 0.002);  // 4 sigma
  EXPECT_EQ(detector.stuck_run(),
            1 + static_cast<std::uint64_t>(std::ceil(std::log(1e-12) / std::log(p))));
  EXPECT_EQ(samples_until_stuck(detector, -1.0, 10000), detector.stuck_run());
}

// A slow quantised signal: repeats are not independent, the longest run seen tells.
TEST(StuckDetectorLaws, ClusteredRepeatsAreJudgedByTheLongestRunSeen) {
  StuckDetector detector({.min_run = 10, .max_run = 100000, .longest_run_factor = 4.0});
  for (int i = 0; i < 200000; ++i) {
    // 1000 quick values, then 200 equal ones.
    const double value = i % 1200 < 1000 ? i : -1.0;
    const Output output = detector.add(value);
    if (i >= 1200) {
      ASSERT_EQ(output, Output::kAlive) << i;
    }
    if (i == 1199)
      detector = [] {
        StuckDetector taught({.min_run = 201, .max_run = 100000, .longest_run_factor = 4.0});
        for (int k = 0; k < 1000; ++k) taught.add(k);
        for (int k = 0; k < 200; ++k) taught.add(-1.0);
        return taught;
      }();
  }
  EXPECT_EQ(detector.stuck_run(), 801u);
}

TEST(StuckDetectorLaws, ARunThatWasStuckTeachesNothing) {
  StuckDetector detector({.min_run = 50});
  QuantisedGyro gyro(5.0, 3);
  for (int i = 0; i < 1000; ++i) detector.add(gyro.next());
  const double before = detector.repeat_probability();
  for (int i = 0; i < 5000; ++i) detector.add(7.0);
  EXPECT_EQ(detector.output(), Output::kStuck);
  detector.add(8.0);
  detector.add(9.0);
  EXPECT_NEAR(detector.repeat_probability(), before, 2e-3);
  EXPECT_EQ(detector.stuck_run(), 50u);
}

TEST(StuckDetectorScenario, AnOutputThatIsZeroFromTheStartIsStuck) {
  StuckDetector detector;
  EXPECT_EQ(samples_until_stuck(detector, 0.0, 1000), 200u);
  // Both zeros are one value.
  EXPECT_EQ(detector.add(-0.0), Output::kStuck);
}

// Pulses at rest: one count in a hundred samples. A minute without any is the end of patience.
TEST(StuckDetectorScenario, PatienceWithACoarseGyroEnds) {
  StuckDetector detector;
  std::mt19937_64 random(4);
  std::bernoulli_distribution pulse(0.01);
  int false_alarms = 0;
  for (int i = 0; i < 2000000; ++i) {
    const Output output = detector.add(pulse(random) ? 1.0 : 0.0);
    // Until it has seen some 20 pulses it cannot know.
    if (i > 2000 && output == Output::kStuck) ++false_alarms;
  }
  EXPECT_EQ(false_alarms, 0);
  EXPECT_GT(detector.stuck_run(), 2000u);
  EXPECT_LE(samples_until_stuck(detector, 0.0, 20000), 12000u);
  EXPECT_EQ(detector.output(), Output::kStuck);
}

TEST(StuckDetectorAbuse, ValuesThatAreNoNumbersAreMissing) {
  StuckDetector detector({.min_run = 100});
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (int i = 0; i < 1000; ++i) EXPECT_EQ(detector.add(nan), Output::kAlive);
  EXPECT_EQ(detector.run(), 0u);
  for (int i = 0; i < 99; ++i) {
    EXPECT_EQ(detector.add(1.0), Output::kAlive);
    EXPECT_EQ(detector.add(nan), Output::kAlive);
  }
  EXPECT_EQ(detector.add(1.0), Output::kStuck);
  EXPECT_EQ(detector.add(nan), Output::kStuck);
}

TEST(StuckDetectorAbuse, WrongOptionsAreNamed) {
  const auto names = [](const StuckDetectorOptions& options, const char* key) {
    const auto error = options.validate();
    return error && error->find(key) == 0;
  };
  EXPECT_TRUE(names({.min_run = 1}, "min_run"));
  EXPECT_TRUE(names({.min_run = 10, .max_run = 9}, "max_run"));
  EXPECT_TRUE(names({.false_alarm_probability = 0.0}, "false_alarm_probability"));
  EXPECT_TRUE(names({.false_alarm_probability = std::nan("")}, "false_alarm_probability"));
  EXPECT_TRUE(names({.longest_run_factor = 0.5}, "longest_run_factor"));
  EXPECT_FALSE(StuckDetectorOptions{}.validate());
  EXPECT_THROW(StuckDetector({.min_run = 0}), std::invalid_argument);
}

TEST(StuckDetectorResources, AddDoesNotAllocate) {
  StuckDetector detector;
  const std::size_t before = allocation_count();
  for (int i = 0; i < 10000; ++i) detector.add(i < 5000 ? i : 1.0);
  EXPECT_EQ(allocation_count(), before);
}

}  // namespace
}  // namespace zerodrift::allan
