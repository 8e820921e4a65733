// SPDX-License-Identifier: Apache-2.0
// Seeded noises with known Allan deviation, for tests.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>
#include <vector>

namespace zerodrift::allan::test {

// Angle random walk: white rate with sigma²(tau) = N²/tau.
class WhiteNoise {
 public:
  WhiteNoise(double n, double interval_s, std::uint64_t seed)
      : random_(seed), scale_(n / std::sqrt(interval_s)) {}
  double next() { return scale_ * normal_(random_); }

 private:
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  double scale_;
};

// Rate random walk: sigma²(tau) = K² tau / 3 (for tau well above the interval).
class RandomWalk {
 public:
  RandomWalk(double k, double interval_s, std::uint64_t seed)
      : step_(k * interval_s, interval_s, seed) {}
  double next() { return rate_ += step_.next(); }

 private:
  WhiteNoise step_;
  double rate_ = 0.0;
};

// Bias instability: first-order Markov noises of variance s² each, time constants T an octave
// apart; their spectrum is 1/f within 1 % inside the covered band. One has sigma²(tau) = s² (2/x)
// [1 - (3 - 4e^-x + e^-2x) / (2x)], x = tau/T; summed over all octaves that is 2 s² (within 1e-5,
// numerically), so s² = B² ln2/pi gives (2 ln2/pi) B².
class Flicker {
 public:
  Flicker(double b, double interval_s, double shortest_s, int octaves, std::uint64_t seed)
      : random_(seed) {
    const double s = b * std::sqrt(std::numbers::ln2 / std::numbers::pi);
    for (int i = 0; i < octaves; ++i) {
      const double time_constant = shortest_s * std::exp2(i);
      const double decay = std::exp(-interval_s / time_constant);
      decays_.push_back(decay);
      drives_.push_back(s * std::sqrt(1.0 - decay * decay));
      states_.push_back(s * normal_(random_));
    }
  }
  double next() {
    double sum = 0.0;
    for (std::size_t i = 0; i < states_.size(); ++i) {
      states_[i] = decays_[i] * states_[i] + drives_[i] * normal_(random_);
      sum += states_[i];
    }
    return sum;
  }

 private:
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  std::vector<double> decays_, drives_, states_;
};

}  // namespace zerodrift::allan::test
