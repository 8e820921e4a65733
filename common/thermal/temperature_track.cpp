// SPDX-License-Identifier: Apache-2.0
#include "common/thermal/temperature_track.h"

#include <bit>
#include <cmath>
#include <stdexcept>

#include "common/core/integer_time.h"

namespace zerodrift::thermal {
namespace {

// What is inside a gyro changes by less between two readings: resolution, noise, and a chamber's
// quickest ramp. A wire that touches, or a sensor that was off (85 °C), reads farther.
constexpr double kLargestStepDegc = 2.0;
constexpr double kFastestDegcPerS = 1.0;

bool is_near(const Reading& earlier, const Reading& later) noexcept {
  const double elapsed_s = core::seconds(core::saturating_difference(later.time, earlier.time));
  return std::abs(later.temperature_degc - earlier.temperature_degc) <=
         kLargestStepDegc + kFastestDegcPerS * elapsed_s;
}

bool same_bits(double a, double b) noexcept {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}

const TemperatureTrackOptions& checked(const TemperatureTrackOptions& options) {
  if (const auto problem = options.validate()) throw std::invalid_argument(*problem);
  return options;
}

std::optional<std::string> validate_rate(const TemperatureTrackOptions& options) {
  if (options.rate_method == RateMethod::kSlidingMean) {
    const auto problem = options.sliding_mean.validate();
    return problem ? std::optional("sliding_mean." + *problem) : std::nullopt;
  }
  const auto problem = options.local_polynomial.validate();
  return problem ? std::optional("local_polynomial." + *problem) : std::nullopt;
}

}  // namespace

std::optional<std::string> TemperatureTrackOptions::validate() const {
  if (auto problem = validate_rate(*this)) return problem;
  if (!(history_step_s >= 1e-3 && history_step_s <= 1e6)) {
    return "history_step_s is " + std::to_string(history_step_s) + ", must be 0.001 to 1e6";
  }
  if (!(history_span_s >= 0.0 && history_span_s <= longest_history_s())) {
    return "history_span_s is " + std::to_string(history_span_s) +
           ", must be 0 to 1e6 times history_step_s";
  }
  if (!(history_max_gap_s >= history_step_s && history_max_gap_s <= 1e6)) {
    return "history_max_gap_s is " + std::to_string(history_max_gap_s) +
           ", must be history_step_s to 1e6";
  }
  if (!(min_temperature_degc < max_temperature_degc) || !std::isfinite(min_temperature_degc) ||
      !std::isfinite(max_temperature_degc)) {
    return "min_temperature_degc is " + std::to_string(min_temperature_degc) +
           ", must be finite and below max_temperature_degc (" +
           std::to_string(max_temperature_degc) + ")";
  }
  return std::nullopt;
}

std::string_view name(ReadingVerdict verdict) {
  switch (verdict) {
    case ReadingVerdict::kAccepted: return "accepted";
    case ReadingVerdict::kJumped: return "jumped";
    case ReadingVerdict::kDoubtful: return "doubtful";
    case ReadingVerdict::kNotMeasured: return "not_measured";
    case ReadingVerdict::kNotFinite: return "not_finite";
    case ReadingVerdict::kOutOfRange: return "out_of_range";
    case ReadingVerdict::kOutOfOrder: return "out_of_order";
  }
  return "unknown";
}

TemperatureTrack::TemperatureTrack(const TemperatureTrackOptions& options)
    : min_temperature_degc_(checked(options).min_temperature_degc),
      max_temperature_degc_(options.max_temperature_degc),
      estimator_(make_estimator(options)),
      history_(options.history_span_s, options.history_step_s, options.history_max_gap_s) {}

ReadingVerdict TemperatureTrack::add(const core::TemperatureSample& sample) noexcept {
  const ReadingVerdict verdict = judge(sample);
  count(verdict);
  const Reading reading{sample.time, sample.temperature_degc};
  if (verdict == ReadingVerdict::kDoubtful) doubtful_ = reading;
  if (verdict == ReadingVerdict::kJumped) reset();
  if (is_accepted(verdict)) accept(reading);
  return verdict;
}

void TemperatureTrack::reset() noexcept {
  with(estimator_, [](auto& estimator) noexcept { estimator.reset(); });
  history_.reset();
  newest_.reset();
  doubtful_.reset();
  rate_.reset();
}

std::optional<double> TemperatureTrack::temperature_degc_at(core::SensorTime time) const noexcept {
  return history_.at(time);
}

std::optional<core::SensorTime> TemperatureTrack::age(core::SensorTime now) const noexcept {
  if (!newest_) return std::nullopt;
  return core::saturating_difference(now, newest_->time);
}

std::optional<core::SensorTime> TemperatureTrack::unchanged_for(
    core::SensorTime now) const noexcept {
  if (!newest_) return std::nullopt;
  return core::saturating_difference(now, changed_at_);
}

TemperatureTrack::RateEstimator TemperatureTrack::make_estimator(
    const TemperatureTrackOptions& options) {
  if (options.rate_method == RateMethod::kSlidingMean) return SlidingMeanRate(options.sliding_mean);
  return LocalPolynomialRate(options.local_polynomial);
}

ReadingVerdict TemperatureTrack::judge(const core::TemperatureSample& sample) const noexcept {
  if (!sample.measured) return ReadingVerdict::kNotMeasured;
  const double temperature_degc = sample.temperature_degc;
  if (!std::isfinite(temperature_degc)) return ReadingVerdict::kNotFinite;
  if (temperature_degc < min_temperature_degc_ || temperature_degc > max_temperature_degc_ ||
      !core::is_usable(sample.time)) {
    return ReadingVerdict::kOutOfRange;
  }
  if (!newest_) return ReadingVerdict::kAccepted;
  if (sample.time <= (doubtful_ ? *doubtful_ : *newest_).time) return ReadingVerdict::kOutOfOrder;
  const Reading reading{sample.time, temperature_degc};
  if (is_near(*newest_, reading)) return ReadingVerdict::kAccepted;
  return doubtful_ && is_near(*doubtful_, reading) ? ReadingVerdict::kJumped
                                                   : ReadingVerdict::kDoubtful;
}

void TemperatureTrack::count(ReadingVerdict verdict) noexcept {
  switch (verdict) {
    case ReadingVerdict::kAccepted:
    case ReadingVerdict::kJumped: ++counts_.accepted; break;
    case ReadingVerdict::kDoubtful: ++counts_.doubtful; break;
    case ReadingVerdict::kNotMeasured: ++counts_.not_measured; break;
    case ReadingVerdict::kNotFinite: ++counts_.not_finite; break;
    case ReadingVerdict::kOutOfRange: ++counts_.out_of_range; break;
    case ReadingVerdict::kOutOfOrder: ++counts_.out_of_order; break;
  }
}

void TemperatureTrack::accept(const Reading& reading) noexcept {
  if (!newest_ || !same_bits(newest_->temperature_degc, reading.temperature_degc)) {
    changed_at_ = reading.time;
  }
  newest_ = reading;
  doubtful_.reset();
  history_.add(reading);
  rate_ = with(estimator_, [&reading](auto& estimator) noexcept {
    estimator.add(reading.time, reading.temperature_degc);
    return estimator.rate_degc_per_s();
  });
}

void TemperatureTrack::carry(core::StateArchive& archive) {
  with(estimator_, [&](auto& estimator) { archive(estimator); });
  archive(newest_, doubtful_, rate_, changed_at_, counts_);
  history_.carry(archive, newest_);
}

}  // namespace zerodrift::thermal
