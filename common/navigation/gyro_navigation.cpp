// SPDX-License-Identifier: Apache-2.0
#include "common/navigation/gyro_navigation.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "common/core/plausible.h"

namespace zerodrift::navigation {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr core::SensorTime kForgottenAxis{10'000'000'000};  // one not measured for so long is none
constexpr core::SensorTime kSetBack{1'000'000'000};         // more is no disorder but a restart
constexpr core::SensorTime kSetForward{60'000'000'000};
constexpr std::size_t kTruths = 4096;
constexpr std::size_t kReferences = 64;
constexpr double kSameInterval = 0.5;  // of an interval may be missing without being a gap
constexpr double kLongestIntervalS = 10.0;

// Unknown where it can't be one.
double sane_variance(double variance) {
  return variance >= 0.0 && variance <= 1.0 ? variance : -1.0;
}

bool has_interval(const NavigationSample& sample) {
  return sample.interval_s > 0.0 && sample.interval_s <= kLongestIntervalS;
}

Vector3 unsigned_vector(const core::PerAxis<double>& values) {
  return {values[0], values[1], values[2]};
}

}  // namespace

GyroNavigation::GyroNavigation(const GyroNavigationOptions& options)
    : options_(options),
      copies_{Copy{.filter = AttitudeFilter(options.filter)},
              Copy{.filter = AttitudeFilter(options.filter)}},
      detector_(options.rest),
      truth_{.attitude = Strapdown(options.filter.latitude_rad
                                       ? earth_rate_radps_n(*options.filter.latitude_rad)
                                       : Vector3::Zero()),
             .waiting = core::RingBuffer<Truth>(kTruths),
             .has_start = options.heading_known || options.true_attitude.has_value()},
      waiting_(kWaiting),
      references_(kReferences),
      heading_known_(options.heading_known),
      start_heading_sigma_rad_(options.heading_known ? options.filter.heading_sigma_rad : kPi) {
  if (const auto problem = options.validate()) throw std::invalid_argument(*problem);
  measured_at_.fill(core::kNever);
  const Quaternion start = navigation::n_from_b(options.attitude);
  truth_.attitude.set(navigation::n_from_b(options.true_attitude.value_or(options.attitude)));
  for (Copy& copy : copies_) {
    copy.filter.start(start, options.filter.tilt_sigma_rad, start_heading_sigma_rad_,
                      AttitudeFilter::Drift::kForget);
  }
}

const Quaternion& GyroNavigation::n_from_b(Stream stream) const noexcept {
  return stream == Stream::kTruth ? truth_.attitude.n_from_b() : filter(stream).n_from_b();
}

core::PerAxis<double> GyroNavigation::true_earth_rate_radps() const noexcept {
  if (!options_.filter.latitude_rad) return {};
  const Vector3 earth_n = earth_rate_radps_n(*options_.filter.latitude_rad);
  return from_forward_right_down(n_from_b(Stream::kTruth).conjugate() * earth_n, options_.frame);
}

// -------------------------------------------------------------------------------------- taking in

void GyroNavigation::push_truth(core::SensorTime time,
                                const core::PerAxis<double>& rate_radps) noexcept {
  const Vector3 rate = to_forward_right_down(rate_radps, options_.frame);
  if (!rate.allFinite() || rate.norm() > core::kLargestRateRadps) return;
  if (!truth_.waiting.empty() && time <= truth_.waiting.back().time)
    truth_.waiting.clear();  // it began anew
  truth_.waiting.push_overwriting({time, rate});
  truth_.spoken_to = time;
  process_ready(true);
}

void GyroNavigation::push(const NavigationSample& sample) noexcept {
  if (waiting_.full()) process_ready(false);
  waiting_.push(sample);
  process_ready(true);
}

void GyroNavigation::give_up_waiting() noexcept {
  if (!waiting_.empty()) truth_.spoken_to = core::kNever;  // until it speaks again
  process_ready(false);
}

// Once given up, `waits` false, all of the queue goes on.
void GyroNavigation::process_ready(bool waits) noexcept {
  while (!waiting_.empty()) {
    const NavigationSample& sample = waiting_.front();
    const bool awaits = waits && truth_.spoken_to != core::kNever && truth_.spoken_to < sample.time;
    if (awaits) return;
    auto& truths = truth_.waiting;
    while (!truths.empty() && truths.front().time < sample.time) truths.pop();
    std::optional<Truth> truth;
    if (!truths.empty() && truths.front().time == sample.time) truth = truths.front();
    const NavigationSample now = sample;
    waiting_.pop();
    process(now, truth ? &*truth : nullptr);
  }
}

bool GyroNavigation::is_usable(const NavigationSample& sample) noexcept {
  const bool is_behind = newest_ != core::kNever && sample.time < newest_;
  const bool is_next = follows(sample);
  // What is answered as late behind a clock that was set back is in its place all the same.
  const bool is_in_place =
      is_next && core::seconds(core::saturating_difference(sample.time, newest_)) <=
                     (1.0 + kSameInterval) * sample.interval_s;
  if (sample.late && !is_in_place) {
    ++counts_.late;
    return false;
  }
  if (newest_ != core::kNever) {
    const bool back = is_behind && newest_ - sample.time > kSetBack;
    const bool forward = sample.time > newest_ && sample.time - newest_ > kSetForward;
    if (back || forward) {
      begin_time_anew();
      if (phase_ == Phase::kNavigating) {
        lose_heading(core::seconds(kSetForward));
        lose_truth(sample.time);
      }
      newest_ = core::kNever;
    } else if (is_behind && is_next && has_interval(sample)) {
      // The clock was set back, and no sample is missing: what it measured is turned through.
      begin_time_anew();
      if (phase_ == Phase::kNavigating) lose_truth(sample.time);
      newest_ = sample.time - core::from_seconds(sample.interval_s);
    } else if (sample.time <= newest_) {
      ++counts_.duplicates;
      return false;
    }
  }
  if (!has_interval(sample)) {
    ++counts_.unusable;
    return false;
  }
  bool any = false;
  bool lacks = false;
  for (std::size_t i = 0; i < 3; ++i) {
    const bool valid = sample.valid[i] && std::isfinite(sample.applied_drift_radps[i]) &&
                       std::abs(sample.rate_radps[i]) <= core::kLargestRateRadps;
    any = any || valid;
    lacks = lacks || (!valid && measured_at_[i] != core::kNever &&
                      sample.time - measured_at_[i] < kForgottenAxis);
    if (valid) measured_at_[i] = sample.time;
  }
  if (any && !lacks) return true;
  ++counts_.unusable;  // its place is bridged as a gap
  return false;
}

void GyroNavigation::begin_time_anew() noexcept {
  ++counts_.time_restarts;
  detector_.restart();
  stop_ = {};
  for (Copy& copy : copies_) copy.filter.interrupt();
  truth_.attitude.interrupt();
  reference_due_ = core::kNever;
  measured_at_.fill(core::kNever);
}

// An axis that is not measured is taken not to turn against the Earth.
GyroNavigation::Rates GyroNavigation::rates_of(const NavigationSample& sample) const noexcept {
  Rates rates;
  rates.compensated = to_forward_right_down(sample.rate_radps, options_.frame);
  rates.raw = rates.compensated + to_forward_right_down(sample.applied_drift_radps, options_.frame);
  const Vector3 earth = copies_[kCompensatedCopy].filter.earth_rate_b();
  for (std::size_t i = 0; i < 3; ++i) {
    rates.measured[i] = measured_at_[i] == sample.time;
    if (rates.measured[i]) continue;
    const auto axis = static_cast<Eigen::Index>(i);
    rates.compensated[axis] = rates.raw[axis] = earth[axis];
  }
  return rates;
}

void GyroNavigation::process(const NavigationSample& received, const Truth* truth) noexcept {
  if (!is_usable(received)) {
    // A sample that says nothing may have a true rate that does.
    if (truth != nullptr && has_interval(received)) move_truth(truth, received.interval_s);
    return;
  }
  NavigationSample sample = received;
  for (std::size_t i = 0; i < 3; ++i) {
    sample.noise_variance[i] = sane_variance(received.noise_variance[i]);
    sample.drift_variance[i] = sane_variance(received.drift_variance[i]);
  }
  ++counts_.samples;
  const Rates rates = rates_of(sample);
  if (phase_ == Phase::kWaiting) phase_ = Phase::kAligning;
  pass_gap(sample, rates);
  take_model(sample);
  detect(sample, rates);
  move(sample, rates);
  move_truth(truth, sample.interval_s);
  check_truth(truth, sample.time);
  newest_ = sample.time;
  sequence_ = sample.sequence;
  gather(sample, rates);
  if (phase_ == Phase::kAligning) align(sample);
  if (phase_ == Phase::kNavigating) judge();
  prepare_references(sample);
}

// ----------------------------------------------------------------------------------------- moving

// What is missing before the sample's own interval: turned through at the mean of the rates around
// it, which is wrong by up to half their difference. Where no number is missing, nothing may be,
// and a clock was set forward: it is wrong by up to all of it.
void GyroNavigation::pass_gap(const NavigationSample& sample, const Rates& rates) noexcept {
  if (newest_ == core::kNever) return;
  const double missing_s = core::seconds(sample.time - newest_) - sample.interval_s;
  if (!(missing_s > kSameInterval * sample.interval_s)) return;
  for (Copy& copy : copies_) each(copy, [](AttitudeFilter& filter) { filter.interrupt(); });
  truth_.attitude.interrupt();
  if (phase_ != Phase::kNavigating) return;
  if (missing_s > options_.longest_bridged_s) {
    ++counts_.losses;
    lose_heading(missing_s);
    return;
  }
  ++counts_.gaps;
  const bool is_next = follows(sample);
  const std::array<const Vector3*, 2> now{&rates.raw, &rates.compensated};
  for (std::size_t i = 0; i < copies_.size(); ++i) {
    Copy& copy = copies_[i];
    RateInterval bridge;
    bridge.rate_radps = 0.5 * (copy.previous_rate + *now[i]);
    bridge.interval_s = missing_s;
    each(copy, [&](AttitudeFilter& filter) {
      filter.turn(bridge);
      filter.interrupt();
      filter.lose_b(0.5 * missing_s * (*now[i] - copy.previous_rate));
      if (is_next) filter.lose_b(missing_s * bridge.rate_radps);
    });
  }
}

void GyroNavigation::lose_heading(double gap_s) noexcept {
  const double sigma = std::min(kPi, options_.fastest_turn_radps * gap_s);
  for (Copy& copy : copies_)
    each(copy, [&](AttitudeFilter& filter) { filter.lose({0.0, 0.0, sigma}); });
  start_heading_sigma_rad_ = std::max(start_heading_sigma_rad_, sigma);
}

// With another model the applied drift jumps, which the drift itself doesn't: what is left jumps
// the other way. Within a model the applied drift moves because the drift does.
void GyroNavigation::take_model(const NavigationSample& sample) noexcept {
  Copy& copy = copies_[kCompensatedCopy];
  const double sign = options_.frame == BodyFrame::kForwardLeftUp ? -1.0 : 1.0;
  const bool tracks = options_.updates == Updates::kAtRest;
  Vector3 change = Vector3::Zero();
  for (std::size_t i = 0; i < 3; ++i) {
    const auto axis = static_cast<Eigen::Index>(i);
    const bool is_new = sample.model_epoch != model_.epoch || sample.rung[i] != model_.rung[i];
    const bool first = newest_ == core::kNever;
    const double step = sample.applied_drift_radps[i] - model_.applied_drift_radps[i];
    if (!first && is_new) change[axis] = (i == 0 ? 1.0 : sign) * step;
  }
  if (tracks) each(copy, [&](AttitudeFilter& filter) { filter.shift_drift(change); });
  for (std::size_t i = 0; i < 3; ++i) {
    const bool known = sample.drift_variance[i] >= 0.0;
    const bool is_new = sample.model_epoch != model_.epoch || sample.rung[i] != model_.rung[i];
    if (known && (is_new || !model_.claim_known[i])) {
      each(copy, [&](AttitudeFilter& filter) { filter.take_claim(i, sample.drift_variance[i]); });
    }
    model_.claim_known[i] = known;
  }
  model_.applied_drift_radps = sample.applied_drift_radps;
  model_.epoch = sample.model_epoch;
  model_.rung = sample.rung;
}

void GyroNavigation::detect(const NavigationSample& sample, const Rates& rates) noexcept {
  const bool was_at_rest = at_rest();
  if (sample.clipped[0] || sample.clipped[1] || sample.clipped[2]) {
    ++counts_.clipped;
    detector_.moving();
  } else {
    const AttitudeFilter& filter = copies_[kCompensatedCopy].filter;
    std::optional<Vector3> force;
    if (sample.specific_force_mps2)
      force = to_forward_right_down(*sample.specific_force_mps2, options_.frame);
    detector_.add(sample.time, rates.compensated - filter.drift_radps() - filter.earth_rate_b(),
                  force);
  }
  if (at_rest()) {
    rest_s_ += sample.interval_s;
    return;
  }
  if (!was_at_rest) return;
  stop_ = {};
}

void GyroNavigation::move(const NavigationSample& sample, const Rates& rates) noexcept {
  RateInterval interval;
  interval.interval_s = sample.interval_s;
  interval.noise_variance = unsigned_vector(sample.noise_variance);
  const std::array<const Vector3*, 2> now{&rates.raw, &rates.compensated};
  for (std::size_t i = 0; i < copies_.size(); ++i) {
    Copy& copy = copies_[i];
    interval.rate_radps = *now[i];
    if (i == kCompensatedCopy) interval.drift_variance = unsigned_vector(sample.drift_variance);
    each(copy, [&](AttitudeFilter& filter) {
      if (phase_ == Phase::kNavigating) {
        filter.turn(interval);
      } else {
        filter.stand(interval);
      }
    });
    copy.previous_rate = *now[i];
  }
  if (sample.clipped == core::PerAxis<bool>{}) return;
  Vector3 lost = Vector3::Zero();
  for (std::size_t i = 0; i < 3; ++i) {
    const auto axis = static_cast<Eigen::Index>(i);
    if (sample.clipped[i]) lost[axis] = rates.raw[axis] * sample.interval_s;
  }
  for (Copy& copy : copies_) copy.filter.lose_b(lost);
}

void GyroNavigation::move_truth(const Truth* truth, double interval_s) noexcept {
  if (truth == nullptr) {
    if (truth_.started) ++counts_.truth_missing;
    return;
  }
  if (truth_.last && truth->time > truth_.last->time) {
    const double missing_s = core::seconds(truth->time - truth_.last->time) - interval_s;
    if (missing_s > kSameInterval * interval_s) {
      if (phase_ == Phase::kNavigating && missing_s > options_.longest_bridged_s)
        lose_truth(truth->time);
      truth_.attitude.interrupt();
      truth_.attitude.advance(0.5 * (truth->rate + truth_.last->rate) * missing_s, missing_s);
      truth_.attitude.interrupt();
    }
    truth_.attitude.advance(truth->rate * interval_s, interval_s);
  }
  truth_.started = true;
  truth_.last = *truth;
}

// Held against the Earth's rate while the first stop lasts.
void GyroNavigation::check_truth(const Truth* truth, core::SensorTime time) noexcept {
  if (!at_rest()) {
    truth_.at_rest.move();
    return;
  }
  if (truth == nullptr) return;
  const bool are_others = truth_.at_rest.add(
      time, from_forward_right_down(truth->rate, options_.frame), true_earth_rate_radps());
  if (!are_others || truth_.doubt || !truth_.has_start || !options_.filter.latitude_rad) return;
  const auto means = truth_.at_rest.means();
  if (are_earths(*means, {true, true, true})) return;
  truth_.doubt = means;
  for (Copy& copy : copies_) copy.errors = {};
}

void GyroNavigation::lose_truth(core::SensorTime time) noexcept {
  if (truth_.started && truth_.lost_at == core::kNever) truth_.lost_at = time;
}

}  // namespace zerodrift::navigation
