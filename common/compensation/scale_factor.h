// SPDX-License-Identifier: Apache-2.0
// The scale-factor error of each axis, learned in motion against a true rate, and what is taken off
// the rate for it.
//
// With s(T) the error, the mean m of what was measured over a block of about a second and its mean
// difference z to the reference obey
//
//   z = b + c(T) m + noise,   c(T) = c0 + c1 (T - 25 °C) = s / (1 + s)
//
// so that c m, with m less the drift, is what the scale factor adds. m stands where the true rate
// is expected since the reference's noise in it would pull c towards 0 (Fuller, Measurement Error
// Models, 1987, section 1.1). b takes in drift and whatever the reference is constantly off: a
// constant bias is no scale factor. A Kalman filter holds [b, c0, c1]: b walks as fast as the rest
// gate lets a level move, c0 by 1 ppm in a minute (ageing). The noise of z is the gyro's at rest,
// the reference's stated variance, which is taken to last for the block, and 50 ppm of m for what
// is not linear (nonlinearity, misalignment).
//
// A reference has to agree with itself: 32 blocks in motion are a window, each was foretold by
// those before it, and what they taught comes into force only where no more than a quarter of them
// lay beyond 4 sigmas, the others' mean normalised square is at most 2, and c is within kLargest.
// Else the window's knowledge is dropped, its forerunner stays in force, and its variance grows
// fourfold (at most to what it was at first), so that a reference that was wrong for long can be
// unlearned. What a reference is off in proportion to the rate can't be distinguished from the
// gyro's own error: it is learned, within kLargest.
//
// O(1) a sample, some 100 products a block; no allocation.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "common/compensation/rest_gate.h"
#include "common/core/axis.h"
#include "common/core/state_archive.h"
#include "common/core/time.h"
#include "common/core/units.h"

namespace zerodrift::compensation {

// Above this true rate a scale-factor error of 100 ppm passes for .036 deg/h of drift: drift isn't
// learned from it, the scale factor is.
inline constexpr double kLeastMotionRadps = 0.1 * core::kRadPerDeg;

// What is known of an axis's scale factor, at a temperature.
struct ScaleFactorState {
  bool is_known = false;  // a window has come into force
  double error = 0.0;     // s: measured rate = (1 + s) true rate + drift
  double sigma = 0.0;     // of it
  double per_degc = 0.0;  // change of s with temperature, per °C
  double per_degc_sigma = 0.0;
  std::uint64_t windows = 0;  // came into force
  std::uint64_t refused = 0;  // did not: the reference disagreed with itself
};

class ScaleFactor {
 public:
  // Most of the rate that is ever taken off.
  static constexpr double kLargest = 0.01;

  // How an axis stands when a block ends.
  struct Noise {
    double block_sigma_radps = 0.0;  // of a block's mean at rest; 0: unknown, nothing is learned
    double sample_variance = 0.0;    // of samples about it, (rad/s)²
  };

  explicit ScaleFactor(const RestGateOptions& rest);

  // Of a sample: what was measured, and the true rate over the same interval with its variance.
  void add(core::Axis axis, double measured_radps, double known_radps,
           double known_variance_radps2) noexcept;
  // The block of about a second is over. `temperature_degc`: nothing where there is no thermometer;
  // `may_learn`: else the block is dropped.
  void close(core::SensorTime now, std::optional<double> temperature_degc,
             const core::PerAxis<Noise>& noise, bool may_learn) noexcept;
  // The time began anew; what came into force stays.
  void restart() noexcept;

  // What the scale factor adds to a true rate: `rate_radps` is what was measured less the drift.
  [[nodiscard]] double error_radps(core::Axis axis, double rate_radps,
                                   std::optional<double> temperature_degc) const noexcept;
  // Variance of that, (rad/s)²; 0 where nothing has come into force.
  [[nodiscard]] double variance_radps2(core::Axis axis, double rate_radps,
                                       std::optional<double> temperature_degc) const noexcept;
  // A true rate as the axis shows it.
  [[nodiscard]] double as_measured(core::Axis axis, double true_rate_radps,
                                   std::optional<double> temperature_degc) const noexcept;
  [[nodiscard]] ScaleFactorState state(core::Axis axis,
                                       std::optional<double> temperature_degc) const noexcept;

  // Its state (core/state_archive.h).
  void carry(core::StateArchive& archive) { archive(axes_); }

 private:
  // Of [b, c0, c1], in rad/s, 1, 1/°C.
  struct Estimate {
    Estimate() noexcept;

    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    Eigen::Matrix3d covariance;

    // Finite, with variances and correlations that there are.
    [[nodiscard]] bool makes_sense() const noexcept;
    void carry(core::StateArchive& archive);
  };
  struct Window {
    std::uint64_t blocks = 0;  // in motion
    std::uint64_t outliers = 0;
    double squares = 0.0;  // normalised, of the others

    void carry(core::StateArchive& archive) { archive(blocks, outliers, squares); }
  };
  struct Axis {
    std::uint64_t samples = 0;  // of the block, with sums of them
    double measured = 0.0;
    double difference = 0.0;
    double known_variance = 0.0;  // largest
    Estimate learning{};          // by the window that lasts
    Estimate in_force{};
    core::SensorTime learned_at{core::kNever};
    Window window{};
    std::uint64_t windows = 0;
    std::uint64_t refused = 0;

    void carry(core::StateArchive& archive) {
      archive(samples, measured, difference, known_variance, learning, in_force, learned_at, window,
              windows, refused);
    }
  };
  struct Block {
    core::SensorTime time{0};
    double above_degc = 0.0;  // 25 °C
    double measured_radps = 0.0;
    double difference_radps = 0.0;
    double variance_radps2 = 0.0;
    double slew_radps2 = 0.0;
  };

  void learn(Axis& axis, const Block& block) noexcept;
  static void judge_window(Axis& axis, double above_degc) noexcept;
  [[nodiscard]] double share(core::Axis axis, double above_degc) const noexcept;

  RestGateOptions rest_;
  core::PerAxis<Axis> axes_{};
};

}  // namespace zerodrift::compensation
