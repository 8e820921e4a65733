// SPDX-License-Identifier: Apache-2.0
#include "common/navigation/attitude_filter.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <numbers>
#include <stdexcept>

namespace zerodrift::navigation {
namespace {

constexpr double kOpening = 2.0;  // of the drift's sigma with each innovation refused
constexpr double kLargestAngleVariance = std::numbers::pi * std::numbers::pi;
// Of chi² the value that 1 in 1e4 exceeds, by degrees of freedom, against that of three.
constexpr std::array<double, 4> kGateOfDegrees{1.0, 15.137 / 21.108, 18.421 / 21.108, 1.0};

constexpr Eigen::Index at(std::size_t axis) {
  return static_cast<Eigen::Index>(axis);
}

struct Bound {
  const char* key;
  double value, low, high;
};

}  // namespace

std::optional<std::string> AttitudeFilterOptions::validate() const {
  constexpr double kPi = std::numbers::pi;
  for (const auto& [key, value, low, high] : std::initializer_list<Bound>{
           {"latitude_rad", latitude_rad.value_or(0.0), -kPi / 2.0, kPi / 2.0},
           {"tilt_sigma_rad", tilt_sigma_rad, 0.0, kPi},
           {"heading_sigma_rad", heading_sigma_rad, 0.0, kPi},
           {"drift_sigma_radps", drift_sigma_radps, 1e-12, 1.0},
           {"drift_walk_radps_sqrt_s", drift_walk_radps_sqrt_s, 0.0, 1.0},
           {"drift_correlation_s", drift_correlation_s, 1.0, 1e9},
           {"smallest_drift_sigma_radps", smallest_drift_sigma_radps, 0.0, 1.0},
           {"angle_random_walk_rad_sqrt_s", angle_random_walk_rad_sqrt_s, 0.0, 1.0},
           {"claim_factor", claim_factor, 0.1, 100.0},
           {"largest_drift_change_radps", largest_drift_change_radps, 0.0, 1.0},
           {"rest_rate_sigma_radps", rest_rate_sigma_radps, 1e-15, 1.0},
           {"level_sigma_rad", level_sigma_rad, 1e-9, kPi},
           {"gate", gate, 1.0, 1e9}}) {
    if (!(value >= low && value <= high)) {
      return std::string(key) + " is " + std::to_string(value) + ", must be " +
             std::to_string(low) + " to " + std::to_string(high);
    }
  }
  return std::nullopt;
}

double gate_of(const AttitudeFilterOptions& options, int degrees) noexcept {
  return options.gate * kGateOfDegrees[static_cast<std::size_t>(degrees)];
}

AttitudeFilter::AttitudeFilter(const AttitudeFilterOptions& options)
    : options_(options),
      earth_rate_n_(options.latitude_rad ? earth_rate_radps_n(*options.latitude_rad)
                                         : Vector3::Zero()),
      strapdown_(earth_rate_n_) {
  if (const auto problem = options.validate()) throw std::invalid_argument(*problem);
  start(Quaternion::Identity(), options.tilt_sigma_rad, options.heading_sigma_rad, Drift::kForget);
}

void AttitudeFilter::start(const Quaternion& n_from_b, double tilt_sigma_rad,
                           double heading_sigma_rad, Drift drift) noexcept {
  strapdown_.set(n_from_b);
  covariance_.topRows<3>().setZero();
  covariance_.leftCols<3>().setZero();
  covariance_(0, 0) = covariance_(1, 1) = tilt_sigma_rad * tilt_sigma_rad;
  covariance_(2, 2) = heading_sigma_rad * heading_sigma_rad;
  if (drift == Drift::kKeep) return;
  drift_.setZero();
  for (std::size_t i = 0; i < 3; ++i) {
    forget_axis(i, claimed_[at(i)] >= 0.0
                       ? claimed_[at(i)]
                       : options_.drift_sigma_radps * options_.drift_sigma_radps);
  }
}

void AttitudeFilter::forget_axis(std::size_t axis, double variance) noexcept {
  const Eigen::Index i = 3 + at(axis);
  covariance_.row(i).setZero();
  covariance_.col(i).setZero();
  const double smallest = options_.smallest_drift_sigma_radps;
  covariance_(i, i) = std::max(variance, smallest * smallest);
}

void AttitudeFilter::predict_drift(const RateInterval& interval) noexcept {
  const double walk = options_.drift_walk_radps_sqrt_s;
  const double walked = walk * walk * interval.interval_s;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const Eigen::Index i = at(axis);
    const double factor = options_.claim_factor;
    const double variance = factor * factor * interval.drift_variance[i];
    double& own = covariance_(3 + i, 3 + i);
    if (!(variance >= 0.0)) {
      own += walked;
      continue;
    }
    const double kept = std::exp(-interval.interval_s / options_.drift_correlation_s);
    drift_[i] *= kept;
    covariance_.row(3 + i) *= kept;
    covariance_.col(3 + i) *= kept;
    own += (1.0 - kept * kept) * variance + walked;
    if (claimed_[i] >= 0.0) own += std::max(0.0, variance - claimed_[i]);
    claimed_[i] = variance;
  }
}

void AttitudeFilter::turn(const RateInterval& interval, const Vector3& transport_rate_n) noexcept {
  const double h = interval.interval_s;
  const Matrix3 c = n_from_b().toRotationMatrix();
  Matrix6 transition = Matrix6::Identity();
  transition.topLeftCorner<3, 3>() -= skew(earth_rate_n_ + transport_rate_n) * h;
  transition.topRightCorner<3, 3>() = -c * h;
  covariance_ = transition * covariance_ * transition.transpose();
  Vector3 noise;  // of the angle about each body axis, rad²
  for (Eigen::Index i = 0; i < 3; ++i) {
    const double walk = options_.angle_random_walk_rad_sqrt_s;
    const double variance = interval.noise_variance[i];
    noise[i] = variance >= 0.0 ? variance * h * h : walk * walk * h;
  }
  covariance_.topLeftCorner<3, 3>() += c * noise.asDiagonal() * c.transpose();
  strapdown_.advance((interval.rate_radps - drift_) * h, h, transport_rate_n);
  predict_drift(interval);
  covariance_ = 0.5 * (covariance_ + covariance_.transpose()).eval();
}

void AttitudeFilter::stand(const RateInterval& interval) noexcept {
  predict_drift(interval);
  strapdown_.interrupt();
}

void AttitudeFilter::lose(const Vector3& sigma_rad_n) noexcept {
  for (Eigen::Index i = 0; i < 3; ++i) {
    double& own = covariance_(i, i);
    own = std::max(own, std::min(kLargestAngleVariance, own + sigma_rad_n[i] * sigma_rad_n[i]));
  }
}

void AttitudeFilter::lose_b(const Vector3& sigma_rad_b) noexcept {
  const Matrix3 c = n_from_b().toRotationMatrix();
  covariance_.topLeftCorner<3, 3>() += c * sigma_rad_b.cwiseAbs2().asDiagonal() * c.transpose();
}

AttitudeFilter::Measurement AttitudeFilter::at_rest(const RestMean& mean,
                                                    const Vector3& lasting) const noexcept {
  const Matrix3 to_b = n_from_b().toRotationMatrix().transpose();
  const double rest = options_.rest_rate_sigma_radps;
  Measurement measured;
  if (options_.gyrocompassing == Gyrocompassing::kOn)
    measured.h.leftCols<3>() = to_b * skew(earth_rate_n_);
  measured.h.rightCols<3>().setIdentity();
  measured.z = mean.rate_radps - drift_ - to_b * earth_rate_n_;
  measured.variance = mean.noise_variance.cwiseMax(0.0) + lasting;
  measured.variance.array() += rest * rest;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (mean.measured[axis]) {
      ++measured.degrees;
      continue;
    }
    measured.h.row(at(axis)).setZero();
    measured.z[at(axis)] = 0.0;
    measured.variance[at(axis)] = 1.0;
  }
  return measured;
}

InnovationReport AttitudeFilter::rest(const RestMean& mean) noexcept {
  const bool is_compass = options_.gyrocompassing == Gyrocompassing::kOn;
  const Vector3 lasting =
      is_compass ? Vector3::Zero() : earth_rate_variance_b(covariance_.topLeftCorner<3, 3>());
  const Measurement measured = at_rest(mean, lasting);
  InnovationReport report = test(measured);
  if (report.innovation == Innovation::kAccepted) {
    apply(measured, Corrects::kAll);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      double& own = covariance_(3 + at(axis), 3 + at(axis));
      if (mean.measured[axis]) own = std::max(own, lasting[at(axis)]);
    }
    return report;
  }
  if (report.innovation != Innovation::kRejected) return report;
  if (measured.z.norm() > options_.largest_drift_change_radps) {
    report.innovation = Innovation::kTurning;
    return report;
  }
  covariance_.bottomRows<3>() *= kOpening;
  covariance_.rightCols<3>() *= kOpening;
  return report;
}

InnovationReport AttitudeFilter::level(const Vector3& specific_force_mps2) noexcept {
  const double magnitude = specific_force_mps2.norm();
  if (!(magnitude > 0.0) || !std::isfinite(magnitude)) return {};
  const Vector3 direction_n = n_from_b() * (specific_force_mps2 / magnitude);
  Measurement measured;
  measured.h(0, 1) = 1.0;
  measured.h(1, 0) = -1.0;
  measured.z = {direction_n.x(), direction_n.y(), 0.0};
  measured.variance.head<2>().setConstant(options_.level_sigma_rad * options_.level_sigma_rad);
  measured.degrees = 2;
  const InnovationReport report = test(measured);
  if (report.innovation == Innovation::kAccepted) apply(measured, of_levelling());
  return report;
}

InnovationReport AttitudeFilter::level_to(double roll_rad, double pitch_rad,
                                          double sigma_rad) noexcept {
  const double variance = sigma_rad * sigma_rad;
  if (covariance_(0, 0) <= variance && covariance_(1, 1) <= variance) return {};
  const Attitude known{.roll_rad = roll_rad,
                       .pitch_rad = pitch_rad,
                       .heading_rad = attitude_of(n_from_b()).heading_rad};
  const Vector3 off = rotation_vector(navigation::n_from_b(known) * n_from_b().conjugate());
  Measurement measured;
  measured.h(0, 0) = measured.h(1, 1) = 1.0;
  measured.z = {off.x(), off.y(), 0.0};
  measured.variance.head<2>().setConstant(std::max(variance, 1e-18));
  measured.degrees = 2;
  const InnovationReport report = test(measured);
  if (report.innovation == Innovation::kAccepted) apply(measured, of_levelling());
  return report;
}

InnovationReport AttitudeFilter::test(const Measurement& measured) const noexcept {
  InnovationReport report{.degrees = measured.degrees};
  if (measured.degrees == 0 || !measured.z.allFinite()) return report;
  const Matrix3 sum =
      measured.h * covariance_ * measured.h.transpose() + Matrix3(measured.variance.asDiagonal());
  report.nis = measured.z.dot(sum.ldlt().solve(measured.z));
  const double gate = gate_of(options_, measured.degrees);
  report.innovation = report.nis <= gate ? Innovation::kAccepted : Innovation::kRejected;
  return report;
}

// Joseph's form: P is that of any gain, symmetric and positive definite.
void AttitudeFilter::apply(const Measurement& measured, Corrects corrects) noexcept {
  const Eigen::Matrix<double, 3, 6> cross = measured.h * covariance_;
  const Matrix3 sum = cross * measured.h.transpose() + Matrix3(measured.variance.asDiagonal());
  Eigen::Matrix<double, 6, 3> gain = sum.ldlt().solve(cross).transpose();
  if (corrects == Corrects::kDriftAndTilt) gain.row(2).setZero();
  const Matrix6 left = Matrix6::Identity() - gain * measured.h;
  covariance_ = left * covariance_ * left.transpose() +
                gain * measured.variance.asDiagonal() * gain.transpose();
  covariance_ = 0.5 * (covariance_ + covariance_.transpose()).eval();
  const Vector6 correction = gain * measured.z;
  strapdown_.correct(correction.head<3>());
  drift_ += correction.tail<3>();
}

void AttitudeFilter::shift_drift(const Vector3& change_radps) noexcept {
  drift_ -= change_radps;
}

void AttitudeFilter::take_claim(std::size_t axis, double variance) noexcept {
  if (!(variance >= 0.0)) return;
  variance *= options_.claim_factor * options_.claim_factor;
  claimed_[at(axis)] = variance;
  if (variance >= covariance_(3 + at(axis), 3 + at(axis))) return;
  drift_[at(axis)] = 0.0;
  forget_axis(axis, variance);
}

Vector3 AttitudeFilter::earth_rate_b() const noexcept {
  return n_from_b().conjugate() * earth_rate_n_;
}

Vector3 AttitudeFilter::earth_rate_variance_b(const Matrix3& covariance_n) const noexcept {
  const Matrix3 to_b = n_from_b().toRotationMatrix().transpose();
  const Matrix3 h = to_b * skew(earth_rate_n_);
  const Vector3 first_order = (h * covariance_n * h.transpose()).diagonal();
  const Vector3 horizontal = to_b * Vector3(earth_rate_n_.x(), earth_rate_n_.y(), 0.0);
  const double heading = covariance_n(2, 2);
  return first_order + 0.75 * heading * heading * horizontal.cwiseAbs2();
}

}  // namespace zerodrift::navigation
