// SPDX-License-Identifier: Apache-2.0
// A sway is never taken for drift, however still the gyro is where it turns round. Block means here
// are drawn directly; blocks last one second.
#include "common/compensation/still_watch.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "common/compensation/rest_gate.h"
#include "tests/unit/compensation/synthetic_gyro.h"

namespace zerodrift::compensation {
namespace {

using testing::kDegH;
using testing::Random;

constexpr int kLabelBlocks = 5;
constexpr int kConfirmBlocks = 5;

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

// Root mean square of what is learned of a gyro without drift, in the second of two hours.
double learned_of(double sigma_deg_h, std::uint64_t seed,
                  const std::function<double(double)>& rotation_deg_h) {
  RestGate gate{RestGateOptions{}};
  Random random(seed);
  Learned learned;
  double square = 0.0;
  for (int k = 0; k < 7200; ++k) {
    DriftBlock block;
    block.begin = from_seconds(k);
    block.end = from_seconds(k + 1);
    for (const auto axis : kAxes) {
      const double rotation = axis == Axis::kX ? rotation_deg_h(k + 0.5) : 0.0;
      block.mean_radps[index(axis)] = kDegH * (rotation + sigma_deg_h * random.gaussian());
      block.variance_radps2[index(axis)] = 50.0 * std::pow(sigma_deg_h * kDegH, 2);
      block.count[index(axis)] = 50;
    }
    learned.add(gate.add(block) == RestState::kRest, block.mean_radps[0] / kDegH);
    if (k >= 3600) square += std::pow(learned.level_deg_h(), 2) / 3600.0;
  }
  return std::sqrt(square);
}

// Rule: a sway that is well above the noise and faster than drift is not learned, whatever its
// period. At its fastest it changes five times as fast as the gate lets a level move, and a label's
// own error is 0.45 sigma: 2 sigma. Before: up to the whole amplitude.
TEST(StillWatchLaws, ASwayOfZeroMeanIsNotLearnedAtItsTurningPoints) {
  for (const double sigma : {0.12, 1.2, 3.6, 18.0}) {
    for (const double amplitude_sigmas : {17.0, 42.0, 100.0, 250.0}) {
      for (const double period_s : {20.0, 30.0, 60.0, 120.0, 300.0, 600.0}) {
        const double omega = 2.0 * std::numbers::pi / period_s;
        const double amplitude = amplitude_sigmas * sigma;
        if (amplitude * omega < 5.0 * std::max(0.05, 0.2 * sigma)) continue;
        for (const std::uint64_t seed : {8U, 15U, 22U}) {
          const auto sway = [&](double time_s) {
            return time_s < 600.0 ? 0.0 : amplitude * std::sin(omega * (time_s - 600.0));
          };
          EXPECT_LT(learned_of(sigma, seed, sway), 2.0 * sigma)
              << sigma << ' ' << amplitude << ' ' << period_s << ' ' << seed;
        }
      }
    }
  }
}

// Rule: a step of the bias came at once, so it is a level once drift could have come to it: 20
// sigma at 0.05 sigma a second, or 0.05 deg/h a second where that is more.
TEST(StillWatchLaws, AStepOfTheBiasIsLearnedAsSoonAsDriftCouldHaveComeToIt) {
  for (const double sigma : {0.12, 18.0}) {
    const auto step = [&](double time_s) { return time_s < 3100.0 ? 0.0 : 20.0 * sigma; };
    EXPECT_NEAR(learned_of(sigma, 1, step), 20.0 * sigma, 2.0 * sigma);
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
    EXPECT_NEAR(learned_of(sigma, 1, drive), 87.0 * sigma, 7.0 * sigma);
  }
}

}  // namespace
}  // namespace zerodrift::compensation
