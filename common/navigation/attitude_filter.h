// SPDX-License-Identifier: Apache-2.0
// Attitude and what drift is left in a gyro's rates: an error-state Kalman filter.
//
// State: phi, the attitude error about north, east and down (the true attitude is exp(phi) times
// the estimate), and the error of the drift d left in the rates, body axes, forward-right-down. To
// first order (Groves 2nd ed., eq. 14.9 and 14.23, with the error on the left)
//
//   phi' = -w_in x phi - C (d + n),   d as below,   C = n_from_b
//
// What a stream says of itself is used as what it is:
// - the sensor's noise, white: variance r² of a sample of length h adds (r h)² to the angle;
// - the variance of the drift taken off is that of an error that lasts: it follows slowly moving
//   inputs. Taken for white at 200 Hz, 0.1 deg/h would count as 1.2e-4 degrees after an hour, not
//   as 0.1. It is the variance of the state d, which forgets over `drift_correlation_s`
//   (first-order Gauss-Markov) and grows at once by what the published variance grows by, since
//   that growth is what the compensation does not know any more.
// - where no variance is given (raw rates), d begins with `drift_sigma_radps`. Either way it also
//   walks: what a forecast misses between two stops is new each time.
//
// No clock, no allocation; 6 x 6 algebra of fixed size, some hundred nanoseconds a sample.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "common/navigation/strapdown.h"

namespace zerodrift::navigation {

using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

// Whether what is measured of Earth's rate corrects the attitude (kOn), to drift / (W cos L). kOff
// is the way to go where the compensation learns from references that were given with this
// attitude: its small variance then is no knowledge of north, and to take it for that goes round in
// circles.
enum class Gyrocompassing : std::uint8_t { kOff, kOn };

struct AttitudeFilterOptions {
  std::optional<double> latitude_rad{};  // none: n stands still against the stars
  double tilt_sigma_rad = 1.745e-3;      // of the roll and pitch it starts with; 0.1 degrees
  double heading_sigma_rad = 1.745e-3;
  double drift_sigma_radps = 2.424e-5;       // where the stream gives no variance: 5 deg/h
  double drift_walk_radps_sqrt_s = 8.08e-8;  // d walks by 1 deg/h in an hour
  double drift_correlation_s = 1800.0;       // of d where the stream gives its variance
  // Published sigmas are taken times this: they were tested at the ages that labels had, and a
  // drive is longer than the time between two labels.
  double claim_factor = 3.0;
  double largest_drift_change_radps = 9.7e-6;  // an innovation beyond, 2 deg/h, is rotation
  Gyrocompassing gyrocompassing = Gyrocompassing::kOff;
  double smallest_drift_sigma_radps = 4.85e-9;     // 0.001 deg/h: no claim is taken for better
  double angle_random_walk_rad_sqrt_s = 2.909e-6;  // where the noise isn't known: 0.01 deg/√h
  double rest_rate_sigma_radps =
      4.85e-8;                    // of a standing vehicle's mean rate in a second; 0.01 deg/h
  double level_sigma_rad = 1e-3;  // of tilt by specific force: the accelerometers' bias
  double gate = 21.11;  // innovations² / variances with three axes; of chi² with 3 degrees 1 in 1e4

  // Nothing when usable, else one line that names the wrong key.
  [[nodiscard]] std::optional<std::string> validate() const;
};

// What innovations² / variances of one to three axes may be.
[[nodiscard]] double gate_of(const AttitudeFilterOptions& options, int degrees) noexcept;

// One sample's interval, forward-right-down. Variances of an axis below 0 (one is enough): unknown.
struct RateInterval {
  Vector3 rate_radps = Vector3::Zero();
  double interval_s = 0.0;
  Vector3 noise_variance = Vector3::Constant(-1.0);  // of this sample, white, (rad/s)²
  Vector3 drift_variance = Vector3::Constant(-1.0);  // of what was taken off, (rad/s)²
};

// The mean of a while at rest. An axis that wasn't measured says nothing.
struct RestMean {
  Vector3 rate_radps = Vector3::Zero();
  Vector3 noise_variance = Vector3::Zero();  // of the mean, (rad/s)²
  std::array<bool, 3> measured{};
};

// kTurning: refused, and too large for drift.
enum class Innovation : std::uint8_t { kNothing, kAccepted, kRejected, kTurning };

struct InnovationReport {
  Innovation innovation = Innovation::kNothing;
  double nis = 0.0;  // normalised innovation squared: chi² with `degrees` degrees of freedom
  int degrees = 0;
};

class AttitudeFilter {
 public:
  // Throws std::invalid_argument with validate()'s line.
  explicit AttitudeFilter(const AttitudeFilterOptions& options);

  // Attitude and its sigmas anew; the drift too, or as it is known.
  enum class Drift : std::uint8_t { kForget, kKeep };
  void start(const Quaternion& n_from_b, double tilt_sigma_rad, double heading_sigma_rad,
             Drift drift) noexcept;

  // The body turned through the interval.
  void turn(const RateInterval& interval,
            const Vector3& transport_rate_n = Vector3::Zero()) noexcept;
  // The body is known to have stood still against the Earth: only the drift goes on.
  void stand(const RateInterval& interval) noexcept;
  // Samples are missing: the attitude is less certain by these angles (1 sigma, rad, about n's
  // axes).
  void lose(const Vector3& sigma_rad_n) noexcept;
  // As lose(), about body axes.
  void lose_b(const Vector3& sigma_rad_b) noexcept;

  // At rest, rate - Earth rate = drift (zero angular rate update), which also corrects what a wrong
  // drift did to the attitude on the way here: z = d - C^T (w_ie x phi), the second part with
  // `gyrocompassing` only; without, its variance counts as noise that lasts, and the drift is never
  // known better. Refused by the gate, the drift counts as twice as uncertain (sigma), so that a
  // filter that is too sure of itself opens again; unless the innovation is larger than drift can
  // be: then it turns.
  InnovationReport rest(const RestMean& mean) noexcept;
  // At rest the specific force points up: z = (f_N, f_E) / |f| = (phi_E, -phi_N). Once a stop: the
  // accelerometers' bias, which limits it, is the same each time.
  InnovationReport level(const Vector3& specific_force_mps2) noexcept;

  // What was taken off the rates changed by `change`, which the drift itself did not: what is left
  // changed by as much.
  void shift_drift(const Vector3& change_radps) noexcept;
  // The compensation states a new estimate, d = 0 with this variance. It may rest on the same
  // samples as ours: of two estimates that may be correlated the better one is taken, axis by axis
  // (covariance intersection with weight 0 or 1), never both.
  void take_claim(std::size_t axis, double variance) noexcept;

  // At rest, roll and pitch as they are known from elsewhere (a level floor), where they are less
  // certain by now than `sigma_rad`. Once a stop.
  InnovationReport level_to(double roll_rad, double pitch_rad, double sigma_rad) noexcept;

  [[nodiscard]] const Quaternion& n_from_b() const noexcept { return strapdown_.n_from_b(); }
  [[nodiscard]] const Vector3& drift_radps() const noexcept { return drift_; }
  [[nodiscard]] const Matrix6& covariance() const noexcept { return covariance_; }
  // Of the Earth rate in b, to first order in phi; zero without a latitude.
  [[nodiscard]] Vector3 earth_rate_b() const noexcept;
  // Its variances with `covariance_n` as that of phi. A heading may be lost by so much that it turns
  // an axis along north too, which it doesn't to first order: E[(psi²/2)²] = 3/4 sigma⁴ on top.
  [[nodiscard]] Vector3 earth_rate_variance_b(const Matrix3& covariance_n) const noexcept;

  void interrupt() noexcept { strapdown_.interrupt(); }

 private:
  void predict_drift(const RateInterval& interval) noexcept;
  enum class Corrects : std::uint8_t { kAll, kDriftAndTilt };
  // All, or all but the heading: that would be gyrocompassing by way of the tilt.
  [[nodiscard]] Corrects of_levelling() const noexcept {
    return options_.gyrocompassing == Gyrocompassing::kOn ? Corrects::kAll
                                                          : Corrects::kDriftAndTilt;
  }
  struct Measurement {  // z = H x + noise; a row of H that is 0 says nothing
    Eigen::Matrix<double, 3, 6> h = Eigen::Matrix<double, 3, 6>::Zero();
    Vector3 z = Vector3::Zero();
    Vector3 variance = Vector3::Ones();
    int degrees = 0;
  };
  [[nodiscard]] InnovationReport test(const Measurement& measured) const noexcept;
  void apply(const Measurement& measured, Corrects corrects) noexcept;
  [[nodiscard]] Measurement at_rest(const RestMean& mean, const Vector3& lasting) const noexcept;
  void forget_axis(std::size_t axis, double variance) noexcept;

  AttitudeFilterOptions options_;
  Vector3 earth_rate_n_;
  Strapdown strapdown_;
  Vector3 drift_ = Vector3::Zero();
  Vector3 claimed_ = Vector3::Constant(-1.0);  // variance received last
  Matrix6 covariance_ = Matrix6::Zero();
};

}  // namespace zerodrift::navigation
