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

}  // namespace

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
      readings_(probes_.size()) {
  thermal::TemperatureTrackOptions track = options.track;
  const double longest_s =
      compares_probes(probes_) ? std::max(longest_lag_s, options.probe_stuck_s) : longest_lag_s;
  track.history_span_s = std::max(track.history_span_s, longest_s + kMarginS);
  for (std::size_t i = 0; i < probes_.size(); ++i) tracks_.emplace_back(track);
}

void TemperatureInputs::push(const core::TemperatureSample& sample) noexcept {
  const auto probe = std::find(probes_.begin(), probes_.end(), sample.probe);
  if (probe == probes_.end()) return;
  ++received_;
  const bool usable =
      sample.measured && std::abs(sample.temperature_degc) <= core::kLargestTemperatureDegc;
  const bool timely = core::is_usable(sample.time);
  if (!timely || (sample.measured && !usable)) ++refused_;
  if (!timely) return;
  queue_.push({static_cast<std::size_t>(probe - probes_.begin()), sample.time,
               usable ? sample.temperature_degc : 0.0, usable});
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
      if (reading->measured) ++refused_;
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
