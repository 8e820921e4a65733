// SPDX-License-Identifier: Apache-2.0
// When output may be taken for drift. Block means here are drawn directly; blocks last one second.
#include "common/compensation/rest_gate.h"

#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "tests/unit/compensation/synthetic_gyro.h"

namespace zerodrift::compensation {
namespace {

constexpr double kFogSigmaDegH = 0.056;
constexpr double kMemsSigmaDegH = 50.0;
constexpr std::size_t kSamples = 200;  // a block

// One-second blocks of a gyro whose level, per axis, is a function of time in deg/h.
class Blocks {
 public:
  using Level = std::function<double(double time_s, Axis axis)>;
  Blocks(std::uint64_t seed, double sigma_deg_h) : random_(seed), sigma_deg_h_(sigma_deg_h) {}

  // Block number k covers [k, k + 1) s.
  DriftBlock next(const Level& level_deg_h, double spread_factor = 1.0,
                  std::size_t samples = kSamples) {
    DriftBlock block;
    const double begin_s = static_cast<double>(k_++);
    block.begin = from_seconds(begin_s);
    block.end = from_seconds(begin_s + 1.0);
    const double sample_variance = sigma_deg_h_ * sigma_deg_h_ * kDegH * kDegH * kSamples;
    for (const auto axis : kAxes) {
      const std::size_t i = index(axis);
      block.mean_radps[i] =
          kDegH * (level_deg_h(begin_s, axis) + sigma_deg_h_ * random_.gaussian());
      // Sampling spread of a variance of 200 samples: sqrt(2 / 199) = 10 %.
      block.variance_radps2[i] =
          sample_variance * spread_factor * spread_factor * (1.0 + 0.1 * random_.gaussian());
      block.count[i] = samples;
    }
    return block;
  }
  [[nodiscard]] double now_s() const { return static_cast<double>(k_); }

 private:
  Random random_;
  double sigma_deg_h_;
  std::size_t k_ = 0;
};

double still(double, Axis) {
  return 2.0;
}

// Runs n blocks and returns how many were not at rest.
int not_at_rest(RestGate& gate, Blocks& blocks, int n, const Blocks::Level& level) {
  int count = 0;
  for (int i = 0; i < n; ++i) count += gate.add(blocks.next(level)) == RestState::kRest ? 0 : 1;
  return count;
}

// Brings a gate to rest on the level `still` and refines its noise.
void settle(RestGate& gate, Blocks& blocks, int n = 300, const Blocks::Level& level = still) {
  for (int i = 0; i < n; ++i) gate.add(blocks.next(level));
  ASSERT_EQ(gate.state(), RestState::kRest);
}

// Law: a start elsewhere than expected is told once rest is believed where it began: not of one
// that came to where it was expected meanwhile (it had turned), nor within what is expected, nor
// against a reference.
TEST(RestGateLaws, AStartThatStaysElsewhereThanExpectedIsToldOnce) {
  ExpectedLevels expected;
  expected.fill(ExpectedLevel{2.0 * kDegH, 2.0 * kDegH, 0.1 * kDegH});
  const auto told = [&](const Blocks::Level& level, bool has_reference = false) {
    RestGate gate{RestGateOptions{}};
    Blocks blocks(3, kFogSigmaDegH);
    for (int i = 0; i < 900; ++i) {
      DriftBlock block = blocks.next(level);
      block.has_reference = has_reference;
      gate.add(block, expected);
    }
    EXPECT_EQ(gate.state(), RestState::kRest);
    return gate.unforeseen_starts();
  };
  const auto away = [](double, Axis axis) { return axis == Axis::kY ? 7.0 : 2.0; };
  EXPECT_EQ(told(away), 1U);
  EXPECT_EQ(told(away, true), 0U);
  EXPECT_EQ(told(still), 0U);
  EXPECT_EQ(told([&](double t, Axis axis) { return t < 60.0 ? away(t, axis) : 2.3; }), 0U);
}

// Rule: sigma is the noise of a block mean. After 2000 blocks it averages about 100 of them:
// 20 % is more than 3 standard deviations (sd of sigma / sigma about 1 / sqrt(2 * 100) * 0.87).
TEST(RestGateLaws, BlockSigmaIsTheNoiseOfABlockMean) {
  for (const double sigma_deg_h : {kFogSigmaDegH, kMemsSigmaDegH}) {
    RestGate gate{RestGateOptions{}};
    Blocks blocks(11, sigma_deg_h);
    for (int i = 0; i < 2000; ++i) gate.add(blocks.next(still));
    for (const auto axis : kAxes) {
      EXPECT_NEAR(gate.block_sigma(axis), sigma_deg_h * kDegH, 0.2 * sigma_deg_h * kDegH);
      EXPECT_NEAR(
          gate.sample_variance(axis) / (sigma_deg_h * sigma_deg_h * kDegH * kDegH * kSamples), 1.0,
          0.1);
    }
  }
}

// Rule: white noise at rest is rest. Threshold 6 sigma plus slew against a deviation of 1.03 sigma
// (block, and level over ten blocks): past the first minutes, when sigma is known to 10 %, beyond
// 5 sigma: 6e-7 a block and axis, 0.02 in 10^4 blocks of 3 axes. Five false alarms of up to six
// blocks (one and the dwell) leave room for the first minutes, when sigma comes from ten blocks.
TEST(RestGateScenarios, FalseAlarmsOnWhiteNoiseAreRare) {
  for (const double sigma_deg_h : {kFogSigmaDegH, kMemsSigmaDegH}) {
    for (const std::uint64_t seed : {1U, 2U, 3U}) {
      SCOPED_TRACE("seed " + std::to_string(seed) + " sigma " + std::to_string(sigma_deg_h));
      RestGate gate{RestGateOptions{}};
      Blocks blocks(seed, sigma_deg_h);
      const int early = not_at_rest(gate, blocks, 300, still);
      EXPECT_LE(early, 10 + 5 * 7);
      EXPECT_LE(not_at_rest(gate, blocks, 10'000, still), 6);
    }
  }
}

// Rule: a turn is seen in its first whole block. 0.1 deg/s = 360 deg/h against a threshold of
// 6 * 0.056 + 0.05 deg/h.
TEST(RestGateScenarios, FastAndSlowTurnsAreSeenWithinOneBlock) {
  for (const double turn_deg_h : {360.0, 36'000.0, -360.0}) {
    RestGate gate{RestGateOptions{}};
    Blocks blocks(5, kFogSigmaDegH);
    settle(gate, blocks);
    const auto level = [&](double, Axis axis) {
      return 2.0 + (axis == Axis::kZ ? turn_deg_h : 0.0);
    };
    EXPECT_EQ(gate.add(blocks.next(level)), RestState::kMotion);
  }
}

// Rule: a slow turn of ten minutes never becomes rest: the level may slew 30 deg/h by then, the
// turn stays 360 deg/h away. After it the gate opens once the dwell (5 s, so 5 blocks) is over.
TEST(RestGateScenarios, ASlowTurnOverTenMinutesNeverBecomesRestAndRestReturnsAfterIt) {
  RestGate gate{RestGateOptions{}};
  Blocks blocks(6, kFogSigmaDegH);
  settle(gate, blocks);
  const auto turning = [](double, Axis axis) { return 2.0 + (axis == Axis::kX ? 360.0 : 0.0); };
  EXPECT_EQ(not_at_rest(gate, blocks, 600, turning), 600);
  for (int i = 0; i < 4; ++i) EXPECT_EQ(gate.add(blocks.next(still)), RestState::kSettling);
  EXPECT_EQ(gate.add(blocks.next(still)), RestState::kRest);
}

// Rule: drift goes on while the gyro turns; back at rest the level begins anew where the drift now
// is. 20 deg/h in 600 s is within the 30 deg/h the level may slew, and 50 thresholds away from it.
TEST(RestGateScenarios, AfterALongTurnTheLevelBeginsAnewWhereTheDriftIs) {
  RestGate gate{RestGateOptions{}};
  Blocks blocks(6, kFogSigmaDegH);
  settle(gate, blocks);
  EXPECT_EQ(not_at_rest(gate, blocks, 600, [](double, Axis) { return 360.0; }), 600);
  const auto drifted = [](double, Axis) { return 22.0; };
  EXPECT_EQ(not_at_rest(gate, blocks, 60, drifted), 4);
  EXPECT_NEAR(gate.level(Axis::kX), 22.0 * kDegH, 3.0 * kFogSigmaDegH * kDegH);
}

// Rule: a still block within the dwell that is followed by motion starts the dwell anew.
TEST(RestGateScenarios, MotionWithinTheDwellStartsItAnew) {
  RestGate gate{RestGateOptions{}};
  Blocks blocks(6, kFogSigmaDegH);
  settle(gate, blocks);
  const auto turning = [](double, Axis) { return 400.0; };
  gate.add(blocks.next(turning));
  for (int i = 0; i < 4; ++i) EXPECT_EQ(gate.add(blocks.next(still)), RestState::kSettling);
  EXPECT_EQ(gate.add(blocks.next(turning)), RestState::kMotion);
  for (int i = 0; i < 4; ++i) EXPECT_EQ(gate.add(blocks.next(still)), RestState::kSettling);
  EXPECT_EQ(gate.add(blocks.next(still)), RestState::kRest);
}

// Rule: thermal drift is not motion. 1 deg/h per minute leaves the level, nine blocks behind,
// 0.15 deg/h off; of the threshold 0.386 deg/h remain 4.1 standard deviations, 3.5 where sigma is
// 10 % low. One-sided 2e-4 at worst on 3 axes over 3600 blocks: 2.2 alarms of 6 blocks; 8 alarms
// would be 1 in 1000 at that worst, so 48 blocks (1.3 %) bound it.
TEST(RestGateScenarios, SlowThermalDriftIsNotMotion) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    RestGate gate{RestGateOptions{}};
    Blocks blocks(seed, kFogSigmaDegH);
    settle(gate, blocks);
    const double start_s = blocks.now_s();
    const auto drifting = [&](double time_s, Axis) { return 2.0 + (time_s - start_s) / 60.0; };
    EXPECT_LE(not_at_rest(gate, blocks, 3600, drifting), 48);
    EXPECT_NEAR(gate.level(Axis::kX), (2.0 + 60.0) * kDegH, 1.0 * kDegH);
  }
}

// Rule: samples spread more than twice as wide as at rest are vibration, whatever their mean. At
// three times, the variance is 9 against a bound of 4, its own sampling spread being 10 %.
TEST(RestGateScenarios, VibrationIsSeenInTheSpread) {
  RestGate gate{RestGateOptions{}};
  Blocks blocks(8, kFogSigmaDegH);
  settle(gate, blocks);
  EXPECT_EQ(gate.add(blocks.next(still, 3.0)), RestState::kMotion);
}

// Rule: a switch-on transient in one of the first blocks is left out of level, noise and spread.
// Before: a gyro at rest that began to send more than four times as fast was in motion for good.
TEST(RestGateScenarios, SamplesThatComeFasterOrSlowerAreNoMotion) {
  for (const double faster : {20.0, 5.0, 2.0, 0.5, 0.1}) {
    for (const double spread : {std::sqrt(faster), 1.0}) {  // of a density; filtered before
      for (std::uint64_t seed = 1; seed <= 5; ++seed) {
        Blocks blocks(seed, kFogSigmaDegH);
        RestGate gate{{}};
        not_at_rest(gate, blocks, 60, still);
        const double before = gate.sample_variance(Axis::kX);
        const auto samples = static_cast<std::size_t>(faster * kSamples);
        for (int i = 0; i < 30; ++i) {
          const bool is_lossy = i % 4 == 3;  // a third of the samples is lost: no other rate
          EXPECT_EQ(gate.add(blocks.next(still, spread, is_lossy ? samples * 2 / 3 : samples)),
                    RestState::kRest)
              << faster << ' ' << spread << ' ' << i;
        }
        EXPECT_NEAR(gate.sample_variance(Axis::kX) / before, spread * spread,
                    0.3 * spread * spread);
        EXPECT_EQ(gate.add(blocks.next(still, 2.5 * spread, samples)), RestState::kMotion)
            << "vibration at the new rate";
        EXPECT_EQ(gate.add(blocks.next([](double, Axis) { return 20.0; }, spread, samples)),
                  RestState::kMotion);
      }
    }
  }
}

TEST(RestGateScenarios, AStartUpOutlierIsTolerated) {
  RestGate gate{RestGateOptions{}};
  Blocks blocks(9, kFogSigmaDegH);
  DriftBlock transient = blocks.next(still);
  for (const auto axis : kAxes) {
    transient.mean_radps[index(axis)] = 1.0;
    transient.variance_radps2[index(axis)] = 1.0;
  }
  gate.add(transient);
  for (int i = 0; i < 9; ++i) gate.add(blocks.next(still));
  ASSERT_EQ(gate.state(), RestState::kRest);
  // Median of ten block means: within 3 sigma of the truth (its own sigma is 0.4). The median of
  // nine absolute differences is within a factor of 3 of its expectation.
  for (const auto axis : kAxes) {
    EXPECT_NEAR(gate.level(axis), 2.0 * kDegH, 3.0 * kFogSigmaDegH * kDegH);
    EXPECT_LT(gate.block_sigma(axis), 3.0 * kFogSigmaDegH * kDegH);
  }
  EXPECT_EQ(gate.add(blocks.next(still, 3.0)), RestState::kMotion);  // vibration is seen at once
}

// Rule: a noisy consumer MEMS works too. Noise 50 deg/h, thermal drift up to 3 deg/h/s (a sine of
// 286 deg/h, period 600 s), steps of 470 deg/h. The threshold grows 2.5 deg/h per s (0.05 sigma):
// worst distance from a level that stands still: 470 + 27 (lag) + 573 (peak to peak) deg/h, plus
// 3 sigma = 150 of the blocks themselves: 300 + 2.5 t >= 1220 after 368 s; then the dwell. Sigma
// known to 20 %: 460 s.
TEST(RestGateScenarios, AConsumerMemsRecoversFromEveryStep) {
  RestGate gate{RestGateOptions{}};
  Blocks blocks(10, kMemsSigmaDegH);
  const auto level = [](double time_s, Axis axis) {
    const double steps = axis == Axis::kY ? 470.0 * std::floor(time_s / 1500.0) : 0.0;
    return steps + 286.0 * std::sin(2.0 * std::numbers::pi * time_s / 600.0);
  };
  settle(gate, blocks, 1400, level);
  for (int step = 1; step <= 4; ++step) {
    while (blocks.now_s() < 1500.0 * step + 470.0) gate.add(blocks.next(level));
    int rest = 0;
    while (blocks.now_s() < 1500.0 * step + 1499.0)
      rest += gate.add(blocks.next(level)) == RestState::kRest ? 1 : 0;
    EXPECT_GT(rest, 900) << "step " << step;  // of 1029
  }
}

// Rule: started in motion, the gate waits for ten blocks that agree before it believes a level.
TEST(RestGateScenarios, StartedInMotionItWaitsForStillness) {
  RestGate gate{RestGateOptions{}};
  Blocks blocks(12, kFogSigmaDegH);
  const auto moving_until_60 = [](double time_s, Axis axis) {
    const bool moves = axis == Axis::kZ && time_s < 60.0;
    return 2.0 + (moves ? 3600.0 * std::sin(2.0 * std::numbers::pi * time_s / 20.0) : 0.0);
  };
  EXPECT_EQ(not_at_rest(gate, blocks, 60, moving_until_60), 60);
  settle(gate, blocks, 30, moving_until_60);
  EXPECT_NEAR(gate.level(Axis::kZ), 2.0 * kDegH, 3.0 * kFogSigmaDegH * kDegH);
}

// Rule: with a largest plausible drift, a steady turn at the start is never taken for the level,
// not even if it ends on the last of the first ten blocks.
TEST(RestGateScenarios, ASteadyTurnAtTheStartIsImplausibleForAsLongAsItLasts) {
  RestGateOptions options;
  options.max_level_radps = 20.0 * kDegH;
  RestGate gate{options};
  Blocks blocks(13, kFogSigmaDegH);
  const auto turning = [](double time_s, Axis axis) {
    return axis == Axis::kZ && time_s < 19.0 ? 36'000.0 : 2.0;
  };
  EXPECT_EQ(not_at_rest(gate, blocks, 18, turning), 18);
  EXPECT_EQ(gate.state(), RestState::kLevelImplausible);
  EXPECT_FALSE(gate.knows(Axis::kX));
  EXPECT_EQ(not_at_rest(gate, blocks, 10, turning), 10);
  EXPECT_EQ(gate.add(blocks.next(turning)), RestState::kRest);
  EXPECT_NEAR(gate.level(Axis::kZ), 2.0 * kDegH, 3.0 * kFogSigmaDegH * kDegH);
}

// Rule: a level above the plausible is named so; with a reference, it is what the reference leaves.
TEST(RestGateScenarios, AnImplausibleLevelIsNamedUnlessAReferenceStandsForIt) {
  RestGateOptions options;
  options.max_level_radps = 20.0 * kDegH;
  RestGate gate{options};
  Blocks blocks(14, kFogSigmaDegH);
  settle(gate, blocks);
  EXPECT_EQ(gate.add(blocks.next([](double, Axis) { return 25.0; })), RestState::kLevelImplausible);
  settle(gate, blocks, 10);
  DriftBlock referenced = blocks.next([](double, Axis) { return 25.0; });
  referenced.has_reference = true;
  EXPECT_EQ(gate.add(referenced), RestState::kMotion);  // a jump all the same
}

// Rule: an axis that is never measured keeps nobody from resting, and is not known.
TEST(RestGateScenarios, AMissingAxisDoesNotHoldUpTheOthers) {
  RestGate gate{RestGateOptions{}};
  Blocks blocks(15, kFogSigmaDegH);
  for (int i = 0; i < 100; ++i) {
    DriftBlock block = blocks.next(still);
    block.count[index(Axis::kY)] = 0;
    block.mean_radps[index(Axis::kY)] = std::numeric_limits<double>::quiet_NaN();
    gate.add(block);
  }
  EXPECT_EQ(gate.state(), RestState::kRest);
  EXPECT_TRUE(gate.knows(Axis::kX));
  EXPECT_FALSE(gate.knows(Axis::kY));
}

// Rule: an axis that appears later is known after ten blocks at rest, and from then on its motion
// is seen; its noise meanwhile alarms nobody.
TEST(RestGateScenarios, AnAxisThatAppearsLaterIsLearnedWithoutDisturbingTheOthers) {
  for (const double sigma_deg_h : {kFogSigmaDegH, kMemsSigmaDegH}) {
    RestGate gate{RestGateOptions{}};
    Blocks blocks(16, sigma_deg_h);
    for (int i = 0; i < 300; ++i) {
      DriftBlock block = blocks.next(still);
      block.count[index(Axis::kY)] = 0;
      gate.add(block);
    }
    ASSERT_EQ(gate.state(), RestState::kRest);
    EXPECT_EQ(not_at_rest(gate, blocks, 10, still), 0);
    EXPECT_TRUE(gate.knows(Axis::kY));
    // The mean of ten blocks is within 4 sigma / sqrt(10) of the truth.
    EXPECT_NEAR(gate.level(Axis::kY), 2.0 * kDegH, 1.3 * sigma_deg_h * kDegH);
    settle(gate, blocks);
    const auto turning = [](double, Axis axis) { return axis == Axis::kY ? 3600.0 : 2.0; };
    EXPECT_EQ(gate.add(blocks.next(turning)), RestState::kMotion);
  }
}

// Rule: blocks without any sample say nothing: ten of them are no initial rest.
TEST(RestGateAbuse, BlocksWithoutSamplesChangeNothing) {
  RestGate gate{RestGateOptions{}};
  for (int i = 0; i < 50; ++i) {
    DriftBlock empty;
    empty.begin = from_seconds(i);
    empty.end = from_seconds(i + 1);
    EXPECT_EQ(gate.add(empty), RestState::kInitial);
  }
}

// Rule: an input without noise has no zero threshold; a turn on it is still seen.
TEST(RestGateAbuse, ConstantInputIsRestAndATurnOnItIsSeen) {
  for (const double constant_deg_h : {0.0, 2.0}) {
    RestGate gate{RestGateOptions{}};
    Blocks blocks(17, 0.0);
    const auto constant = [&](double, Axis) { return constant_deg_h; };
    EXPECT_EQ(not_at_rest(gate, blocks, 1000, constant),
              9);  // the tenth block is the first at rest
    EXPECT_GT(gate.block_sigma(Axis::kX), 0.0);
    EXPECT_EQ(gate.add(blocks.next([](double, Axis) { return 360.0; })), RestState::kMotion);
  }
}

// Rule: a block mean that is not a number is never rest and never becomes the level.
TEST(RestGateAbuse, NotANumberIsNeverRest) {
  RestGate gate{RestGateOptions{}};
  Blocks blocks(18, kFogSigmaDegH);
  settle(gate, blocks);
  DriftBlock bad = blocks.next(still);
  bad.mean_radps[1] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(gate.add(bad), RestState::kMotion);
  settle(gate, blocks, 10);
  EXPECT_NEAR(gate.level(Axis::kY), 2.0 * kDegH, 2.0 * kFogSigmaDegH * kDegH);
}

// Rule: motion known from elsewhere closes the gate, or starts the initial blocks anew.
TEST(RestGateScenarios, MotionKnownFromElsewhereClosesTheGate) {
  RestGate gate{RestGateOptions{}};
  Blocks blocks(19, kFogSigmaDegH);
  for (int i = 0; i < 9; ++i) gate.add(blocks.next(still));
  EXPECT_EQ(gate.motion(), RestState::kInitial);
  EXPECT_EQ(not_at_rest(gate, blocks, 9, still), 9);
  settle(gate, blocks, 300);
  EXPECT_EQ(gate.motion(), RestState::kMotion);
  EXPECT_EQ(gate.add(blocks.next(still)), RestState::kSettling);
}

}  // namespace
}  // namespace zerodrift::compensation
