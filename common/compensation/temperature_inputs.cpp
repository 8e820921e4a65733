// SPDX-License-Identifier: Apache-2.0
#include "common/compensation/temperature_inputs.h"

#include <algorithm>
#include <cmath>

#include "common/compensation/option_keys.h"
#include "common/core/integer_time.h"
#include "common/core/not_known.h"
#include "common/core/plausible.h"

namespace zerodrift::compensation {
namespace {

constexpr std::size_t kWaiting = 4096;  // of each probe
constexpr double kMovedDegc = 1.0;      // a probe counts as moving past this
constexpr double kMarginS = 60.0;       // of a track beyond what is asked of it
using core::kNaN;

auto first_feature(const CompensationOptions& options, thermal::FeatureKind kind) {
  return std::find_if(options.features.begin(), options.features.end(),
                      [&](const auto& feature) { return feature.kind == kind; });
}

double scale_of(const CompensationOptions& options, thermal::FeatureKind kind) {
  const auto found = first_feature(options, kind);
  const auto scale = found == options.features.end() ? std::nullopt : found->scale;
  return scale.value_or(thermal::default_scale(kind));
}

// A probe that stands still is compared with where the others were, if there are others.
bool compares_probes(const std::vector<std::string>& probes) {
  return probes.size() > 1;
}

// " (25 degC, if it is in kelvin)" where that is a temperature of a gyro.
std::string kelvin_hint(double value) {
  constexpr double kZeroDegcInKelvin = 273.15;
  const double degc = value - kZeroDegcInKelvin;
  if (!(degc >= core::kColdestStoreDegc && degc <= core::kHottestElectronicsDegc)) return "";
  return " (" + short_text(std::round(10.0 * degc) / 10.0) + " degC, if it is in kelvin)";
}

std::string fault_text(const RefusedReadings& refused,
                       const thermal::TemperatureTrackOptions& track) {
  using thermal::ReadingVerdict;
  const std::string value = short_text(refused.last.temperature_degc);
  const std::string stamp =
      "is stamped " + std::to_string(core::seconds(refused.last.time)) + " s, ";
  if (refused.why == ReadingVerdict::kOutOfOrder) return stamp + "not later than the one before";
  if (refused.why == ReadingVerdict::kDoubtful) {
    return "leaps from " + short_text(refused.newest_degc.value_or(kNaN)) + " to " + value +
           " degC, farther than a thermometer gets";
  }
  if (!core::is_usable(refused.last.time)) return stamp + "which no clock shows";
  return "is " + value + ", expected " + short_text(track.min_temperature_degc) + " to " +
         short_text(track.max_temperature_degc) + " degC" +
         kelvin_hint(refused.last.temperature_degc);
}

}  // namespace

std::string refused_text(const std::string& probe, const RefusedReadings& refused,
                         const thermal::TemperatureTrackOptions& track) {
  return "a temperature of probe " + probe + " " + fault_text(refused, track) + "; not used" +
         (refused.why == thermal::ReadingVerdict::kDoubtful ? " unless the next one confirms it"
                                                            : "");
}

ThermalScales::ThermalScales(const CompensationOptions& options)
    : temperature_degc(scale_of(options, thermal::FeatureKind::kTemperature)),
      rate_degc_per_s(scale_of(options, thermal::FeatureKind::kTemperatureRate)) {}

TemperatureInputs::Basis::Basis(const CompensationOptions& options,
                                const std::vector<std::string>& probes)
    : scales(options) {
  const auto temperature = first_feature(options, thermal::FeatureKind::kTemperature);
  if (probes.empty()) return;
  probe = 0;
  if (temperature == options.features.end()) return;
  probe = static_cast<std::size_t>(std::find(probes.begin(), probes.end(), temperature->probe) -
                                   probes.begin());
}

std::optional<std::string> TemperatureInputs::find_wrong(const CompensationOptions& options) {
  const double longest_s = options.track.longest_history_s() - kMarginS;
  if (!compares_probes(options.probes()) || options.probe_stuck_s <= longest_s) return std::nullopt;
  return "probe_stuck_s: found " + short_text(options.probe_stuck_s) + ", expected at most " +
         short_text(longest_s) + " where there is more than one probe";
}

TemperatureInputs::TemperatureInputs(const CompensationOptions& options, double longest_lag_s)
    : probes_(options.probes()),
      delay_(core::from_seconds(options.temperature_delay_s)),
      stuck_after_(core::from_seconds(options.probe_stuck_s)),
      stale_after_(core::from_seconds(options.temperature_stale_s)),
      basis_(options, probes_),
      queue_(probes_.size(), kWaiting),
      readings_(probes_.size()),
      refused_by_probe_(probes_.size()) {
  thermal::TemperatureTrackOptions track = options.track;
  const double longest_s =
      compares_probes(probes_) ? std::max(longest_lag_s, options.probe_stuck_s) : longest_lag_s;
  track.history_span_s = std::max(track.history_span_s, longest_s + kMarginS);
  for (std::size_t i = 0; i < probes_.size(); ++i) tracks_.emplace_back(track);
}

void TemperatureInputs::push(const core::TemperatureSample& sample) noexcept {
  const auto found = std::find(probes_.begin(), probes_.end(), sample.probe);
  if (found == probes_.end()) return;
  const auto probe = static_cast<std::size_t>(found - probes_.begin());
  ++received_;
  const bool usable =
      sample.measured && std::abs(sample.temperature_degc) <= core::kLargestTemperatureDegc;
  const bool timely = core::is_usable(sample.time);
  if (!timely || (sample.measured && !usable)) {
    const bool is_finite = !sample.measured || std::isfinite(sample.temperature_degc);
    refuse(probe,
           is_finite ? thermal::ReadingVerdict::kOutOfRange : thermal::ReadingVerdict::kNotFinite,
           {sample.time, sample.temperature_degc});
  }
  if (!timely) return;
  queue_.push({probe, sample.time, usable ? sample.temperature_degc : 0.0, usable});
}

void TemperatureInputs::refuse(std::size_t probe, thermal::ReadingVerdict why,
                               const thermal::Reading& reading) noexcept {
  ++refused_;
  RefusedReadings& refused = refused_by_probe_[probe];
  ++refused.count;
  refused.why = why;
  refused.last = reading;
  refused.newest_degc.reset();
  if (const auto& newest = tracks_[probe].newest()) refused.newest_degc = newest->temperature_degc;
}

void TemperatureInputs::limit(std::string_view published) noexcept {
  const auto is_named = [published](std::string_view probe) {
    for (std::string_view left = published; !left.empty();) {
      const std::size_t comma = std::min(left.find(','), left.size());
      if (left.substr(0, comma) == probe) return true;
      left.remove_prefix(std::min(comma + 1, left.size()));
    }
    return false;
  };
  for (std::size_t p = 0; p < probes_.size(); ++p) {
    if (queue_.spoken_to(p) == core::kNever && !is_named(probes_[p])) queue_.end(p);
  }
}

void TemperatureInputs::give_up_waiting(core::SensorTime rate_time) noexcept {
  queue_.give_up_waiting(rate_time - delay_);
}

bool TemperatureInputs::take_for(core::SensorTime rate_time) noexcept {
  bool has_new = false;
  while (const auto reading = queue_.pop_until(rate_time - delay_)) {
    core::TemperatureSample sample;
    sample.time = reading->time;
    sample.temperature_degc = reading->temperature_degc;
    sample.measured = reading->measured;
    thermal::TemperatureTrack& track = tracks_[reading->probe];
    const thermal::ReadingVerdict verdict = track.add(sample);
    if (!thermal::is_accepted(verdict)) {
      if (reading->measured)
        refuse(reading->probe, verdict, {reading->time, reading->temperature_degc});
      continue;
    }
    has_new = true;
    if (reading->probe != basis_.probe) continue;
    if (verdict == thermal::ReadingVerdict::kJumped) thermal_.restart();
    thermal_.advance(reading->time, reading->temperature_degc / basis_.scales.temperature_degc,
                     track.rate_degc_per_s().value_or(0.0) / basis_.scales.rate_degc_per_s);
  }
  return has_new;
}

void TemperatureInputs::forget_time() noexcept {
  for (auto& track : tracks_) track.reset();
  thermal_.restart();
}

const std::vector<PriorReading>& TemperatureInputs::readings(core::SensorTime now) noexcept {
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    readings_[i] = {};
    const auto age = tracks_[i].age(now);
    if (!age || *age > stale_after_) continue;
    readings_[i].temperature_degc = tracks_[i].newest()->temperature_degc;
    if (const auto rate = tracks_[i].rate_degc_per_s()) readings_[i].rate_degc_per_s = *rate;
  }
  return readings_;
}

bool TemperatureInputs::one_is_stuck(core::SensorTime now) const noexcept {
  for (const auto& track : tracks_) {
    const auto unchanged = track.unchanged_for(now);
    if (!unchanged || *unchanged < stuck_after_) continue;
    const bool another_moved =
        std::any_of(tracks_.begin(), tracks_.end(), [&](const thermal::TemperatureTrack& other) {
          const auto then = other.temperature_degc_at(now - stuck_after_);
          return then && other.newest() &&
                 std::abs(other.newest()->temperature_degc - *then) > kMovedDegc;
        });
    if (another_moved) return true;
  }
  return false;
}

core::Reason TemperatureInputs::reason(thermal::FeatureStatus status,
                                       core::SensorTime now) const noexcept {
  switch (status) {
    case thermal::FeatureStatus::kReady:
      return one_is_stuck(now) ? core::Reason::kProbeStuck : core::Reason::kNone;
    case thermal::FeatureStatus::kNoTemperature: return core::Reason::kTemperatureMissing;
    case thermal::FeatureStatus::kTemperatureStale: return core::Reason::kTemperatureStale;
    default: return core::Reason::kRateNotReady;
  }
}

double TemperatureInputs::first_degc() const noexcept {
  if (tracks_.empty() || !tracks_.front().newest()) return kNaN;
  return tracks_.front().newest()->temperature_degc;
}

double TemperatureInputs::first_rate_degc_per_s() const noexcept {
  return tracks_.empty() ? kNaN : tracks_.front().rate_degc_per_s().value_or(kNaN);
}

bool TemperatureInputs::is_stale(core::SensorTime now) const noexcept {
  const auto age = tracks_.empty() ? std::nullopt : tracks_.front().age(now);
  return !age || *age > stale_after_;
}

bool TemperatureInputs::has_received(const core::TemperatureSample& sample) const noexcept {
  const auto probe = std::find(probes_.begin(), probes_.end(), sample.probe);
  if (probe == probes_.end()) return true;
  return sample.time <= queue_.spoken_to(static_cast<std::size_t>(probe - probes_.begin()));
}

}  // namespace zerodrift::compensation
