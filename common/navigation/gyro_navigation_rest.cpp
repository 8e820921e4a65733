// SPDX-License-Identifier: Apache-2.0
// What GyroNavigation makes of a vehicle that stands: means over a second, alignment, north, and
// how far both headings are from the true one.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "common/navigation/gyro_navigation.h"

namespace zerodrift::navigation {
namespace {

constexpr core::SensorTime kBlock{1'000'000'000};
constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
constexpr int kMayBeTakenBack = 10;  // updates of a stop; what more agree with is its drift

std::array<bool, 3> both(const std::array<bool, 3>& a, const std::array<bool, 3>& b) {
  return {a[0] && b[0], a[1] && b[1], a[2] && b[2]};
}

}  // namespace

void GyroNavigation::gather(const NavigationSample& sample, const Rates& rates) noexcept {
  if (!at_rest()) return;
  if (stop_.block.begin == core::kNever) {
    stop_.block = {};
    stop_.block.begin = sample.time;
    stop_.block.measured = {true, true, true};
  }
  stop_.block.sum += rates.raw;
  stop_.block.measured = both(stop_.block.measured, rates.measured);
  stop_.block.squares += rates.raw.cwiseAbs2();
  for (std::size_t i = 0; i < 3; ++i) {
    const double stated = sample.noise_variance[i];
    stop_.block.noise[static_cast<Eigen::Index>(i)] += stated > 0.0 ? stated : kUnknown;
  }
  ++stop_.block.count;
  if (sample.specific_force_mps2) {
    stop_.block.force += to_forward_right_down(*sample.specific_force_mps2, options_.frame);
    ++stop_.block.with_force;
  }
  if (sample.time - stop_.block.begin < kBlock) return;
  if (stop_.confirmed_next) {
    if (!stop_.has_begun && agree(*stop_.confirmed_next, stop_.block)) begin_stop();
    if (stop_.has_begun) update(*stop_.confirmed_next);
  }
  stop_.confirmed_next = stop_.block;
  stop_.block = {};
}

void GyroNavigation::begin_stop() noexcept {
  stop_.has_begun = true;
  for (Copy& copy : copies_) {
    copy.before = copy.filter;
    copy.agreeing = copy.disputing = 0;
  }
}

// As stated. Where it isn't, which is so until the compensation knows the drift, the samples'
// scatter tells it, and the random walk of an unknown gyro counts as one sample more.
Vector3 GyroNavigation::noise_of_mean(const Block& block) const noexcept {
  const auto n = static_cast<double>(block.count);
  const double walk = options_.filter.angle_random_walk_rad_sqrt_s;
  const double one_sample = walk * walk / core::seconds(kBlock);
  const Vector3 scatter = (block.squares - block.sum.cwiseAbs2() / n).cwiseMax(0.0);
  Vector3 variance = block.noise / (n * n);
  for (Eigen::Index i = 0; i < 3; ++i) {
    if (!(variance[i] > 0.0)) variance[i] = (one_sample + scatter[i] / n) / n;
  }
  return variance;
}

// Drift moves by less within a second.
bool GyroNavigation::agree(const Block& first, const Block& second) const noexcept {
  const double rest = options_.filter.rest_rate_sigma_radps;
  const std::array<bool, 3> measured = both(first.measured, second.measured);
  const Vector3 noise = noise_of_mean(first) + noise_of_mean(second);
  double nis = 0.0;
  int degrees = 0;
  for (std::size_t i = 0; i < measured.size(); ++i) {
    if (!measured[i]) continue;
    const auto axis = static_cast<Eigen::Index>(i);
    const double change = second.sum[axis] / static_cast<double>(second.count) -
                          first.sum[axis] / static_cast<double>(first.count);
    const double variance = 2.0 * rest * rest + noise[axis];
    nis += change * change / variance;
    ++degrees;
  }
  return nis <= gate_of(options_.filter, degrees);
}

// The compensated mean is that of the raw rates less what is applied now: the model may have
// changed since.
void GyroNavigation::update(const Block& block) noexcept {
  const auto n = static_cast<double>(block.count);
  const Vector3 raw = block.sum / n;
  const Vector3 noise_variance = noise_of_mean(block);
  const Vector3 compensated =
      raw - to_forward_right_down(model_.applied_drift_radps, options_.frame);
  if (!compass_.has_checked) {
    check_heading(
        {.rate_radps = compensated, .noise_variance = noise_variance, .measured = block.measured});
  }
  for (std::size_t i = 0; i < copies_.size(); ++i) {
    Copy& copy = copies_[i];
    RestMean mean{.rate_radps = i == kRawCopy ? raw : compensated,
                  .noise_variance = noise_variance,
                  .measured = block.measured};
    if (options_.updates == Updates::kNone) continue;
    // Without a heading Earth's horizontal rate is unknown, its vertical one is not.
    if (!heading_known_) mean.measured[0] = mean.measured[1] = false;
    const auto note = [&copy](const InnovationReport& report) {
      copy.counts.updates += report.innovation == Innovation::kAccepted ? 1 : 0;
      copy.counts.rejected += report.innovation > Innovation::kAccepted ? 1 : 0;
      if (report.innovation == Innovation::kNothing) return;
      copy.counts.nis_sum += report.nis;
      copy.counts.nis_degrees += static_cast<std::uint64_t>(report.degrees);
    };
    const InnovationReport report = learn(copy, mean);
    note(report);
    if (i == kCompensatedCopy) {
      stop_.stands = report.innovation != Innovation::kTurning;
      stop_.residual_due = report.innovation == Innovation::kAccepted;
    }
    if (stop_.levelled) continue;
    note(level(copy.filter, block));
    static_cast<void>(level(copy.before, block));
  }
  stop_.levelled = true;
  if (phase_ == Phase::kAligning && !heading_known_) {
    compass_.sum += compensated;
    ++compass_.count;
  }
  if (options_.updates == Updates::kNone) stop_.stands = heading_known_;
}

// A mean that could be no drift by what the stop's first seconds taught, but is one by what was
// known before, takes their word back once as many in turn have contradicted them.
InnovationReport GyroNavigation::learn(Copy& copy, const RestMean& mean) noexcept {
  InnovationReport report = copy.filter.rest(mean);
  if (report.innovation == Innovation::kAccepted) {
    ++copy.agreeing;
    copy.disputing = 0;
  }
  if (report.innovation != Innovation::kTurning) return report;
  ++copy.disputing;
  if (copy.agreeing > kMayBeTakenBack || copy.disputing < copy.agreeing) return report;
  AttitudeFilter other = copy.before;
  const InnovationReport by_before = other.rest(mean);
  if (by_before.innovation != Innovation::kAccepted) return report;
  copy.filter = other;
  copy.agreeing = 1;
  copy.disputing = 0;
  return by_before;
}

InnovationReport GyroNavigation::level(AttitudeFilter& filter, const Block& block) const noexcept {
  if (block.with_force == block.count)
    return filter.level(block.force / static_cast<double>(block.count));
  return filter.level_to(options_.attitude.roll_rad, options_.attitude.pitch_rad,
                         options_.filter.tilt_sigma_rad);
}

void GyroNavigation::align(const NavigationSample& sample) noexcept {
  if (at_rest()) aligned_s_ += sample.interval_s;
  const bool enough = aligned_s_ >= options_.alignment_s;
  if (!enough && detector_.standing() != Standing::kMoving) return;
  if (!heading_known_) {
    find_heading();
    if (!heading_known_ && !enough) return;  // a stop is waited for
  }
  begin_navigating();
}

// Of a mean at rest, by the drift as the filter knows it.
CompassResult GyroNavigation::compass_of(const Vector3& rate_radps,
                                         const Vector3& noise_variance) const noexcept {
  const AttitudeFilter& filter = copies_[kCompensatedCopy].filter;
  const Vector3 drift_variance = filter.covariance().diagonal().tail<3>();
  CompassInput input;
  input.rate_radps = rate_radps - filter.drift_radps();
  input.drift_sigma_radps = (drift_variance + noise_variance).cwiseSqrt();
  for (std::size_t i = 0; i < 3; ++i) input.measured[i] = measured_at_[i] == newest_;
  input.latitude_rad = options_.filter.latitude_rad.value_or(0.0);
  input.roll_rad = options_.attitude.roll_rad;
  input.pitch_rad = options_.attitude.pitch_rad;
  input.tilt_sigma_rad = options_.filter.tilt_sigma_rad;
  return gyrocompass(input);
}

// Before the filter learns from the mean: by the drift that others have learned. A horizontal rate
// that isn't as large as the Earth's says nothing of north.
void GyroNavigation::check_heading(const RestMean& mean) noexcept {
  compass_.has_checked = true;
  if (!options_.heading_known || !options_.filter.latitude_rad) return;
  const CompassResult found = compass_of(mean.rate_radps, mean.noise_variance);
  if (found.verdict != CompassVerdict::kFound) return;
  const double gate = std::sqrt(gate_of(options_.filter, 1));
  const double horizontal = core::kEarthRateRadps * std::cos(*options_.filter.latitude_rad);
  if (std::abs(found.excess_radps) > gate * found.sigma_rad * horizontal) return;
  const double given = attitude(Stream::kCompensated).heading_rad;
  const double heading_variance = copies_[kCompensatedCopy].filter.covariance()(2, 2);
  const double error = std::abs(wrapped(found.heading_rad - given));
  if (error <= gate * std::sqrt(found.sigma_rad * found.sigma_rad + heading_variance)) return;
  compass_.doubt = HeadingDoubt{given, found.heading_rad};
  for (Copy& copy : copies_)
    each(copy, [&](AttitudeFilter& filter) { filter.lose({0.0, 0.0, error}); });
  start_heading_sigma_rad_ = std::max(start_heading_sigma_rad_, error);
  if (!options_.true_attitude) truth_.has_start = false;
}

void GyroNavigation::find_heading() noexcept {
  if (compass_.count == 0) return;
  const CompassResult found =
      compass_of(compass_.sum / static_cast<double>(compass_.count), Vector3::Zero());
  compass_.verdict = found.verdict;
  if (found.verdict != CompassVerdict::kFound) return;
  heading_known_ = true;
  start_heading_sigma_rad_ = found.sigma_rad;
  options_.attitude.heading_rad = found.heading_rad;
}

// Where the attitude was held the filters know it together with the drift: kept. Without updates,
// or with a heading that was found only now, both begin here.
void GyroNavigation::begin_navigating() noexcept {
  phase_ = Phase::kNavigating;
  const bool keeps = options_.updates == Updates::kAtRest && options_.heading_known;
  if (keeps) return;
  for (Copy& copy : copies_) {
    each(copy, [&](AttitudeFilter& filter) {
      filter.start(navigation::n_from_b(options_.attitude), options_.filter.tilt_sigma_rad,
                   start_heading_sigma_rad_, AttitudeFilter::Drift::kForget);
    });
  }
}

void GyroNavigation::judge() noexcept {
  if (!knows_truth() || !truth_.last || truth_.last->time != newest_) return;
  const double heading = attitude(Stream::kTruth).heading_rad;
  for (std::size_t i = 0; i < copies_.size(); ++i) {
    Copy& copy = copies_[i];
    const Quaternion& estimate = copy.filter.n_from_b();
    const Vector3 phi = rotation_vector(truth_.attitude.n_from_b() * estimate.conjugate());
    StreamErrors& errors = copy.errors;
    errors.heading_now = wrapped(attitude_of(estimate).heading_rad - heading);
    errors.heading_square_sum += errors.heading_now * errors.heading_now;
    errors.heading_largest = std::max(errors.heading_largest, std::abs(errors.heading_now));
    errors.angle_now = phi.norm();
    const Matrix3 covariance = copy.filter.covariance().topLeftCorner<3, 3>();
    errors.heading_sigma_now = std::sqrt(covariance(2, 2));
    errors.nees_sum += phi.dot(covariance.ldlt().solve(phi));
    ++errors.samples;
  }
}

}  // namespace zerodrift::navigation
