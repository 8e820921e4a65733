// SPDX-License-Identifier: Apache-2.0
// Decides within about a second whether a vehicle stands still.
//
// Apart from compensation::RestGate, which looks at one-second means of drift and takes its time
// (10 s and more) to find out whether a level is the gyro's own; here the drift and Earth rate are
// known well enough to be taken off, what is looked at are samples, and what is wanted is the
// moment of stopping and driving off. They share no arithmetic: means against a tracked level with
// noise learned from the blocks there, energy of a window against a scale here.
#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "common/core/ring_buffer.h"
#include "common/core/time.h"
#include "common/navigation/rotation.h"

namespace zerodrift::navigation {

// The statistic is that of SHOE (Skog et al., Zero-velocity detection: an algorithm evaluation,
// IEEE Trans. Biomed. Eng. 57 (2010), eq. 16), the generalised likelihood ratio for "standing":
//
//   T = mean over the window of |w|² / sigma_w² + |f - g u|² / sigma_f²
//
// w the rate without drift and Earth rate, f the specific force (only where it is given), u the
// window's mean direction of it. The sigmas are no sensor noise but what may move a vehicle that
// stands: engine, wind, people.
struct RestDetectorOptions {
  double window_s = 0.5;
  double dwell_s = 1.0;                // of T below `enter` before it is rest
  double enter = 1.0;                  // T below: still
  double leave = 2.0;                  // T above: moving, at once
  double rate_sigma_radps = 1.745e-4;  // 0.01 deg/s = 36 deg/h, all axes together
  double force_sigma_mps2 = 0.05;
  double longest_gap_s = 0.5;   // between samples; longer: begins anew
  std::size_t capacity = 4096;  // samples of a window; of faster gyros it is shorter

  // Nothing when usable, else one line that names the wrong key.
  [[nodiscard]] std::optional<std::string> validate() const;
};

enum class Standing { kUnknown, kMoving, kSettling, kAtRest };  // kUnknown: the window isn't full

// O(window) memory from the constructor on, O(1) a sample. One thread.
class RestDetector {
 public:
  // Throws std::invalid_argument with validate()'s line.
  explicit RestDetector(const RestDetectorOptions& options);

  // `rate_radps`: see above; axes that weren't measured are 0. Times ascend.
  Standing add(core::SensorTime time, const Vector3& rate_radps,
               const std::optional<Vector3>& specific_force_mps2 = std::nullopt) noexcept;
  // A sample that says nothing, or says that it moves (saturated).
  Standing moving() noexcept;
  void restart() noexcept;

  [[nodiscard]] Standing standing() const noexcept { return standing_; }
  // Since when it is at rest; kNever where it isn't.
  [[nodiscard]] core::SensorTime since() const noexcept;
  // T of the window; 0 before it is full.
  [[nodiscard]] double statistic() const noexcept { return statistic_; }

 private:
  struct Sample {
    core::SensorTime time{0};
    double rate_square = 0.0;
    Vector3 force = Vector3::Zero();
    bool has_force = false;
  };
  struct Sums {
    double rate_square = 0.0;
    double force_square = 0.0;
    Vector3 force = Vector3::Zero();
    std::size_t with_force = 0;
  };
  void take_in(const Sample& sample) noexcept;
  void drop_oldest() noexcept;
  // The sums anew: what large values left of rounding is gone.
  void sum_up() noexcept;
  [[nodiscard]] double statistic_of_window() const noexcept;
  void decide(core::SensorTime time) noexcept;

  RestDetectorOptions options_;
  core::SensorTime window_;
  core::SensorTime dwell_;
  core::SensorTime longest_gap_;
  core::RingBuffer<Sample> samples_;
  core::SensorTime began_{core::kNever};
  std::size_t since_sum_up_ = 0;
  Sums sums_;
  double statistic_ = 0.0;
  Standing standing_ = Standing::kUnknown;
  core::SensorTime still_since_{core::kNever};
};

}  // namespace zerodrift::navigation
