// SPDX-License-Identifier: Apache-2.0
// A sway is never taken for drift, however still the gyro is where it turns round, and drift within
// its permitted slew is never taken for motion. Block means here are drawn directly.
#include "common/compensation/still_watch.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <string>
#include <utility>

#include "common/compensation/rest_gate.h"
#include "tests/unit/compensation/synthetic_gyro.h"

namespace zerodrift::compensation {
namespace {

using testing::kDegH;
using testing::Random;

constexpr double kSlew = 0.05;  // deg/h per s: RestGateOptions
constexpr int kLabelBlocks = 5;
constexpr int kConfirmBlocks = 5;
using Level = std::function<double(double time_s)>;  // deg/h, of axis x; the others are at rest

struct Noise {
  double sigma_deg_h = 0.0;
  std::uint64_t seed = 1;
  double step_deg_h = 0.0;  // of a coarse output
};

class Blocks {
 public:
  explicit Blocks(const Noise& noise) : noise_(noise), random_(noise.seed) {}

  DriftBlock next(double begin_s, double block_s, const Level& level_deg_h) {
    DriftBlock block;
    block.begin = from_seconds(begin_s);
    block.end = from_seconds(begin_s + block_s);
    for (const auto axis : kAxes) {
      double mean = noise_.sigma_deg_h * random_.gaussian();
      if (axis == Axis::kX) mean += level_deg_h(begin_s + 0.5 * block_s);
      if (noise_.step_deg_h > 0.0) mean = noise_.step_deg_h * std::round(mean / noise_.step_deg_h);
      block.mean_radps[index(axis)] = kDegH * mean;
      block.variance_radps2[index(axis)] = 50.0 * std::pow(noise_.sigma_deg_h * kDegH, 2);
      block.count[index(axis)] = 50;
    }
    return block;
  }

 private:
  Noise noise_;
  Random random_;
};

// What a label builder would have learned of axis x from the gate: the mean of each five blocks at
// rest that five others follow.
class Learned {
 public:
  void add(bool is_at_rest, double mean_deg_h) {
    still_ = is_at_rest ? still_ + 1 : 0;
    if (!is_at_rest) return;
    sum_ = (still_ - 1) % kLabelBlocks == 0 ? mean_deg_h : sum_ + mean_deg_h;
    if (still_ % kLabelBlocks != 0) return;
    if (still_ >= kLabelBlocks + kConfirmBlocks) level_deg_h_ = pending_deg_h_;
    pending_deg_h_ = sum_ / kLabelBlocks;
  }
  [[nodiscard]] double level_deg_h() const { return level_deg_h_; }

 private:
  int still_ = 0;
  double sum_ = 0.0;
  double pending_deg_h_ = 0.0;
  double level_deg_h_ = 0.0;
};

// Root mean square of what is learned, in the second of two hours.
double learned_of(const Noise& noise, const Level& level_deg_h) {
  RestGate gate{RestGateOptions{}};
  Blocks blocks(noise);
  Learned learned;
  double square = 0.0;
  for (int k = 0; k < 7200; ++k) {
    const DriftBlock block = blocks.next(k, 1.0, level_deg_h);
    learned.add(gate.add(block) == RestState::kRest, block.mean_radps[0] / kDegH);
    if (k >= 3600) square += std::pow(learned.level_deg_h(), 2) / 3600.0;
  }
  return std::sqrt(square);
}

// Part of the blocks of an hour that are at rest. Of each `every_s` the last `pause_s` are a pause.
double at_rest(const Noise& noise, const Level& level_deg_h, double block_s = 1.0,
               double every_s = 3600.0, double pause_s = 0.0) {
  RestGate gate{RestGateOptions{}};
  Blocks blocks(noise);
  int rest = 0;
  int all = 0;
  for (double time_s = 0.0; time_s < 3600.0 * block_s; time_s += block_s) {
    if (std::fmod(time_s, every_s) >= every_s - pause_s) continue;
    ++all;
    if (gate.add(blocks.next(time_s, block_s, level_deg_h)) == RestState::kRest) ++rest;
  }
  return static_cast<double>(rest) / all;
}

// Rule: a sway that is well above the noise and faster than drift is not learned, whatever its
// period. At its fastest it changes five times as fast as the gate lets a level move at rest, and a
// label's own error is 0.45 sigma: 2 sigma. Before: up to the whole amplitude.
TEST(StillWatchLaws, ASwayOfZeroMeanIsNotLearnedAtItsTurningPoints) {
  for (const double sigma : {0.12, 1.2, 3.6, 18.0}) {
    for (const double amplitude_sigmas : {17.0, 42.0, 100.0, 250.0}) {
      for (const double period_s : {20.0, 30.0, 60.0, 120.0, 300.0, 600.0, 1200.0}) {
        const double omega = 2.0 * std::numbers::pi / period_s;
        const double amplitude = amplitude_sigmas * sigma;
        if (amplitude * omega < 5.0 * std::max(kSlew, 0.2 * sigma)) continue;
        for (const std::uint64_t seed : {8U, 15U, 22U}) {
          const auto sway = [&](double time_s) {
            return time_s < 600.0 ? 0.0 : amplitude * std::sin(omega * (time_s - 600.0));
          };
          EXPECT_LT(learned_of({sigma, seed}, sway), 2.0 * sigma)
              << sigma << ' ' << amplitude << ' ' << period_s << ' ' << seed;
        }
      }
    }
  }
}

// Rule: the same of any amplitude, period, phase and noise, at seven times as fast. Before: a fifth
// of them was learned.
TEST(StillWatchLaws, NoSwayOfAnyKindIsLearned) {
  Random random(77);
  for (int sways = 0; sways < 300;) {
    const Noise noise{0.02 * std::pow(1000.0, random.uniform()), random.next()};
    const double sigma = noise.sigma_deg_h;
    const double amplitude = 17.0 * sigma * std::pow(60.0, random.uniform());
    const double period_s = 20.0 * std::pow(60.0, random.uniform());
    const double phase = 2.0 * std::numbers::pi * random.uniform();
    const double omega = 2.0 * std::numbers::pi / period_s;
    if (amplitude * omega < 7.0 * std::max(kSlew, 0.2 * sigma)) continue;
    const auto sway = [&](double time_s) {
      return time_s < 600.0 ? 0.0 : amplitude * std::sin(omega * (time_s - 600.0) + phase);
    };
    EXPECT_LT(learned_of(noise, sway), 2.0 * sigma)
        << sigma << ' ' << amplitude << ' ' << period_s << ' ' << phase;
    ++sways;
  }
}

// Rule: drift that is no faster than permitted is rest, ramping, turning round or approaching its
// end, in every noise, in blocks of 1 s and 10 s, and with pauses; nine of the first ten blocks are
// not. Before: down to a tenth of the blocks where the output is almost without noise or has
// pauses.
TEST(StillWatchLaws, PermittedDriftIsNeverTakenForMotion) {
  for (const double sigma : {1e-6, 1.4e-3, 0.01, 0.12, 1.0, 18.0}) {
    for (const double part : {0.0, 0.1, 0.4, 0.6, -0.6, 0.9, -0.9}) {
      for (const std::uint64_t seed : {1U, 2U, 3U}) {
        const double slew = part * kSlew;
        const Noise noise{sigma, seed};
        SCOPED_TRACE(std::to_string(sigma) + ' ' + std::to_string(slew) + ' ' +
                     std::to_string(seed));
        const auto ramp = [&](double time_s) { return slew * time_s; };
        const auto steps = [&](double time_s) { return slew * std::floor(time_s); };
        const auto turning = [&](double time_s) {
          return slew * std::abs(std::fmod(time_s, 1200.0) - 600.0);
        };
        const auto warming = [&](double time_s) {
          return 300.0 * slew * (1.0 - std::exp(-time_s / 300.0));
        };
        for (const auto& level : {Level(ramp), Level(steps), Level(turning), Level(warming)}) {
          EXPECT_GT(at_rest(noise, level), 0.98);
          EXPECT_GT(at_rest(noise, level, 10.0), 0.98);
          EXPECT_GT(at_rest(noise, level, 1.0, 300.0, 180.0), 0.98);
        }
      }
    }
  }
}

// Rule: where few steps of a coarse output make up the noise, drift is still rest. A step that is
// larger than drift may come to in a block is a jerk: after each, the dwell.
TEST(StillWatchLaws, PermittedDriftOfACoarseOutputIsNoMotion) {
  for (const double sigma : {1e-6, 0.01}) {
    for (const double slew : {0.005, 0.02, -0.045}) {
      const auto ramp = [&](double time_s) { return slew * time_s; };
      EXPECT_GT(at_rest({sigma, 1, 0.04}, ramp), 0.95) << sigma << ' ' << slew;
      const double between_s = 0.5 / std::abs(slew);
      EXPECT_GT(at_rest({sigma, 1, 0.5}, ramp), 0.9 - 12.0 / between_s) << sigma << ' ' << slew;
    }
  }
}

// Rule: a step of the bias came at once, so it is a level once drift could have come to it: 20
// sigma at 0.05 sigma a second, or 0.05 deg/h a second where that is more.
TEST(StillWatchLaws, AStepOfTheBiasIsLearnedAsSoonAsDriftCouldHaveComeToIt) {
  for (const double sigma : {0.12, 18.0}) {
    const auto step = [&](double time_s) { return time_s < 3100.0 ? 0.0 : 20.0 * sigma; };
    EXPECT_NEAR(learned_of({sigma}, step), 20.0 * sigma, 2.0 * sigma);
  }
}

// Rule: who drives with jerks has learned the drift anew at each stop of 30 s, though it went on by
// up to ten sigma in between.
TEST(StillWatchLaws, AfterAJerkyDriveTheLevelIsLearnedAtTheNextStop) {
  for (const double sigma : {0.12, 18.0}) {
    Random motion(3);
    const auto drive = [&](double time_s) {
      const bool drives = time_s > 300.0 && std::fmod(time_s, 600.0) < 570.0;
      return time_s * sigma / 60.0 + (drives ? 300.0 * sigma * motion.gaussian() : 0.0);
    };
    // The level rises to 120 sigma; in the second hour its mean square is 92 sigma squared, 10 less
    // where it is a stop behind.
    EXPECT_NEAR(learned_of({sigma}, drive), 87.0 * sigma, 7.0 * sigma);
  }
}

// Rule: after a sway the gate opens within its period, at a level that the drift came to meanwhile.
TEST(StillWatchLaws, AfterASwayTheGateOpensWithinItsPeriod) {
  for (const double sigma : {0.12, 1.2, 18.0}) {
    for (const double period_s : {20.0, 60.0, 300.0}) {
      const double end_s = 600.0 + 10.25 * period_s;  // at a turning point
      const double omega = 2.0 * std::numbers::pi / period_s;
      RestGate gate{RestGateOptions{}};
      Blocks blocks({sigma, 5});
      const auto sway = [&](double time_s) {
        const double drift = time_s * sigma / 200.0;
        const bool sways = time_s > 600.0 && time_s < end_s;
        return drift + (sways ? 100.0 * sigma * std::sin(omega * (time_s - 600.0)) : 0.0);
      };
      double time_s = 0.0;
      while (time_s < end_s || gate.state() != RestState::kRest)
        gate.add(blocks.next(std::exchange(time_s, time_s + 1.0), 1.0, sway));
      EXPECT_LT(time_s - end_s, period_s + 10.0) << sigma << ' ' << period_s;
    }
  }
}

}  // namespace
}  // namespace zerodrift::compensation
