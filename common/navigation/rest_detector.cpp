// SPDX-License-Identifier: Apache-2.0
#include "common/navigation/rest_detector.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "common/core/units.h"

namespace zerodrift::navigation {

std::optional<std::string> RestDetectorOptions::validate() const {
  const auto wrong = [](const char* key, double found, const char* expected) {
    return std::string(key) + " is " + std::to_string(found) + ", must be " + expected;
  };
  if (!(window_s >= 0.01 && window_s <= 60.0)) return wrong("window_s", window_s, "0.01 to 60");
  if (!(dwell_s >= 0.0 && dwell_s <= 600.0)) return wrong("dwell_s", dwell_s, "0 to 600");
  if (!(enter > 0.0)) return wrong("enter", enter, "above 0");
  if (!(leave >= enter)) return wrong("leave", leave, "at least enter");
  if (!(rate_sigma_radps > 0.0)) return wrong("rate_sigma_radps", rate_sigma_radps, "above 0");
  if (!(force_sigma_mps2 > 0.0)) return wrong("force_sigma_mps2", force_sigma_mps2, "above 0");
  if (!(longest_gap_s > 0.0 && longest_gap_s <= 3600.0))
    return wrong("longest_gap_s", longest_gap_s, "above 0, to 3600");
  if (capacity < 2) return wrong("capacity", static_cast<double>(capacity), "at least 2");
  return std::nullopt;
}

RestDetector::RestDetector(const RestDetectorOptions& options)
    : options_(options),
      window_(core::from_seconds(options.window_s)),
      dwell_(core::from_seconds(options.dwell_s)),
      longest_gap_(core::from_seconds(options.longest_gap_s)),
      samples_(std::max<std::size_t>(options.capacity, 2)) {
  if (const auto problem = options.validate()) throw std::invalid_argument(*problem);
}

core::SensorTime RestDetector::since() const noexcept {
  return standing_ == Standing::kAtRest ? still_since_ : core::kNever;
}

void RestDetector::restart() noexcept {
  samples_.clear();
  began_ = core::kNever;
  sums_ = {};
  since_sum_up_ = 0;
  statistic_ = 0.0;
  standing_ = Standing::kUnknown;
  still_since_ = core::kNever;
}

Standing RestDetector::moving() noexcept {
  restart();
  return standing_ = Standing::kMoving;
}

Standing RestDetector::add(core::SensorTime time, const Vector3& rate_radps,
                           const std::optional<Vector3>& specific_force_mps2) noexcept {
  if (!samples_.empty() &&
      (time <= samples_.back().time || time - samples_.back().time > longest_gap_)) {
    restart();
  }
  const bool has_force = specific_force_mps2 && specific_force_mps2->allFinite();
  take_in({time, rate_radps.squaredNorm(), has_force ? *specific_force_mps2 : Vector3::Zero(),
           has_force});
  if (!std::isfinite(sums_.rate_square)) return moving();
  if (began_ == core::kNever) began_ = time;
  const bool is_full = samples_.full() || time - began_ >= window_;
  if (!is_full) return standing_;
  statistic_ = statistic_of_window();
  decide(time);
  return standing_;
}

void RestDetector::take_in(const Sample& sample) noexcept {
  while (!samples_.empty() && (samples_.full() || sample.time - samples_.front().time > window_)) {
    drop_oldest();
  }
  samples_.push(sample);
  sums_.rate_square += sample.rate_square;
  if (sample.has_force) {
    sums_.force += sample.force;
    sums_.force_square += sample.force.squaredNorm();
    ++sums_.with_force;
  }
  if (++since_sum_up_ >= samples_.capacity()) sum_up();
}

void RestDetector::drop_oldest() noexcept {
  const Sample& oldest = samples_.front();
  sums_.rate_square -= oldest.rate_square;
  if (oldest.has_force) {
    sums_.force -= oldest.force;
    sums_.force_square -= oldest.force.squaredNorm();
    --sums_.with_force;
  }
  samples_.pop();
}

void RestDetector::sum_up() noexcept {
  since_sum_up_ = 0;
  sums_ = {};
  for (std::size_t i = 0; i < samples_.size(); ++i) {
    sums_.rate_square += samples_[i].rate_square;
    if (!samples_[i].has_force) continue;
    sums_.force += samples_[i].force;
    sums_.force_square += samples_[i].force.squaredNorm();
    ++sums_.with_force;
  }
}

// sum |f - g u|² = sum |f|² - 2 g |sum f| + n g², u being the direction of the sum.
double RestDetector::statistic_of_window() const noexcept {
  const double rate_sigma = options_.rate_sigma_radps;
  const double rates = std::max(0.0, sums_.rate_square) / static_cast<double>(samples_.size());
  double statistic = rates / (rate_sigma * rate_sigma);
  if (sums_.with_force == 0) return statistic;
  const auto n = static_cast<double>(sums_.with_force);
  const double off_gravity = sums_.force_square -
                             2.0 * core::kStandardGravityMps2 * sums_.force.norm() +
                             n * core::kStandardGravityMps2 * core::kStandardGravityMps2;
  const double force_sigma = options_.force_sigma_mps2;
  return statistic + std::max(0.0, off_gravity) / n / (force_sigma * force_sigma);
}

void RestDetector::decide(core::SensorTime time) noexcept {
  const double bound = standing_ == Standing::kAtRest ? options_.leave : options_.enter;
  if (!(statistic_ < bound)) {
    standing_ = Standing::kMoving;
    still_since_ = core::kNever;
    return;
  }
  if (still_since_ == core::kNever) still_since_ = time;
  standing_ = time - still_since_ >= dwell_ ? Standing::kAtRest : Standing::kSettling;
}

}  // namespace zerodrift::navigation
