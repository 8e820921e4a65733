// SPDX-License-Identifier: Apache-2.0
#include "common/thermal/features.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "common/core/units.h"

namespace zerodrift::thermal {
namespace {

constexpr double kSecondsPerMinute = 60.0;
constexpr double kMaxAgeS = 1e6;

bool needs_probe(FeatureKind kind) {
  return kind != FeatureKind::kPulseMean && kind != FeatureKind::kPulseRate;
}

[[noreturn]] void refuse(std::size_t feature, const std::string& problem) {
  throw std::invalid_argument("features[" + std::to_string(feature) + "]." + problem);
}

std::string listed(std::span<const std::string> probes) {
  if (probes.empty()) return "none";
  std::string list;
  for (const std::string& probe : probes) list += (list.empty() ? "" : ", ") + probe;
  return list;
}

std::size_t find_probe(std::size_t feature, std::string_view key, const std::string& probe,
                       std::span<const std::string> probes) {
  const auto found = std::find(probes.begin(), probes.end(), probe);
  if (found == probes.end()) {
    refuse(feature, std::string(key) + " is '" + probe + "', must be a known probe (" +
                        listed(probes) + ")");
  }
  return static_cast<std::size_t>(found - probes.begin());
}

double checked_scale(std::size_t feature, const FeatureSpec& spec) {
  const double scale = spec.scale.value_or(default_scale(spec.kind));
  if (!std::isfinite(scale) || !(scale > 0.0)) {
    refuse(feature, "scale is " + std::to_string(scale) + ", must be finite and above 0");
  }
  if (!std::isfinite(spec.offset)) {
    refuse(feature, "offset is " + std::to_string(spec.offset) + ", must be finite");
  }
  return scale;
}

double checked_lag_s(std::size_t feature, const FeatureSpec& spec) {
  if (spec.kind != FeatureKind::kLaggedTemperature) return 0.0;
  if (!(spec.lag_s > 0.0 && spec.lag_s <= kLongestLagS)) {
    refuse(feature, "lag_s is " + std::to_string(spec.lag_s) + ", must be above 0 and at most 9e5");
  }
  return spec.lag_s;
}

}  // namespace

std::string_view name(FeatureKind kind) {
  switch (kind) {
    case FeatureKind::kTemperature: return "temperature";
    case FeatureKind::kTemperatureRate: return "temperature_rate";
    case FeatureKind::kTemperatureTimesRate: return "temperature_times_rate";
    case FeatureKind::kLaggedTemperature: return "lagged_temperature";
    case FeatureKind::kProbeDifference: return "probe_difference";
    case FeatureKind::kPulseMean: return "pulse_mean";
    case FeatureKind::kPulseRate: return "pulse_rate";
  }
  return "unknown";
}

double default_scale(FeatureKind kind) {
  switch (kind) {
    case FeatureKind::kTemperature:
    case FeatureKind::kLaggedTemperature: return 10.0;
    case FeatureKind::kTemperatureRate: return 1.0 / kSecondsPerMinute;
    case FeatureKind::kTemperatureTimesRate: return 10.0 / kSecondsPerMinute;
    case FeatureKind::kProbeDifference: return 1.0;
    case FeatureKind::kPulseMean: return core::radps_from_deg_h(1.0);
    case FeatureKind::kPulseRate: return core::radps_from_deg_h(1.0) / kSecondsPerMinute;
  }
  return 1.0;
}

std::string_view name(FeatureStatus status) {
  switch (status) {
    case FeatureStatus::kReady: return "ready";
    case FeatureStatus::kNoTemperature: return "no_temperature";
    case FeatureStatus::kTemperatureStale: return "temperature_stale";
    case FeatureStatus::kRateNotReady: return "rate_not_ready";
    case FeatureStatus::kLagNotReady: return "lag_not_ready";
    case FeatureStatus::kPulseNotReady: return "pulse_not_ready";
  }
  return "unknown";
}

FeatureBuilder::FeatureBuilder(const FeatureBuilderOptions& options,
                               std::span<const std::string> probes) {
  if (options.features.empty() || options.features.size() > kMaxFeatures) {
    throw std::invalid_argument("features has " + std::to_string(options.features.size()) +
                                " entries, must have 1 to " + std::to_string(kMaxFeatures));
  }
  if (!(options.max_temperature_age_s > 0.0 && options.max_temperature_age_s <= kMaxAgeS)) {
    throw std::invalid_argument("max_temperature_age_s is " +
                                std::to_string(options.max_temperature_age_s) +
                                ", must be above 0 and at most 1e6");
  }
  max_age_ = core::from_seconds(options.max_temperature_age_s);
  for (std::size_t i = 0; i < options.features.size(); ++i) {
    const FeatureSpec& spec = options.features[i];
    Term term{.kind = spec.kind,
              .track = 0,
              .second_track = 0,
              .lag = {},
              .offset = spec.offset,
              .scale = checked_scale(i, spec)};
    if (needs_probe(spec.kind)) term.track = find_probe(i, "probe", spec.probe, probes);
    term.second_track = spec.kind == FeatureKind::kProbeDifference
                            ? find_probe(i, "second_probe", spec.second_probe, probes)
                            : term.track;
    const double lag_s = checked_lag_s(i, spec);
    term.lag = core::from_seconds(lag_s);
    longest_lag_s_ = std::max(longest_lag_s_, lag_s);
    terms_.push_back(term);
  }
}

FeatureVector FeatureBuilder::build(core::SensorTime now, std::span<const TemperatureTrack> tracks,
                                    const PulseTerms& pulse) const noexcept {
  FeatureVector vector;
  for (std::size_t i = 0; i < terms_.size(); ++i) {
    const Term& term = terms_[i];
    const Value value = evaluate(term, now, tracks, pulse);
    if (value.status != FeatureStatus::kReady) {
      return {.status = value.status, .size = 0, .blocked_by = i, .values = {}};
    }
    vector.values[i] = (value.value - term.offset) / term.scale;
  }
  vector.status = FeatureStatus::kReady;
  vector.size = terms_.size();
  return vector;
}

FeatureBuilder::Value FeatureBuilder::evaluate(const Term& term, core::SensorTime now,
                                               std::span<const TemperatureTrack> tracks,
                                               const PulseTerms& pulse) const noexcept {
  if (needs_probe(term.kind)) return temperature_term(term, now, tracks);
  const std::optional<double>& value =
      term.kind == FeatureKind::kPulseMean ? pulse.mean_radps : pulse.slope_radps2;
  if (!value || !std::isfinite(*value)) return {FeatureStatus::kPulseNotReady, 0.0};
  return {FeatureStatus::kReady, *value};
}

FeatureBuilder::Value FeatureBuilder::temperature_term(
    const Term& term, core::SensorTime now,
    std::span<const TemperatureTrack> tracks) const noexcept {
  for (const std::size_t used : {term.track, term.second_track}) {
    const FeatureStatus status = freshness(used, now, tracks);
    if (status != FeatureStatus::kReady) return {status, 0.0};
  }
  const TemperatureTrack& track = tracks[term.track];
  const double temperature_degc = track.newest()->temperature_degc;
  if (term.kind == FeatureKind::kTemperature) return {FeatureStatus::kReady, temperature_degc};
  if (term.kind == FeatureKind::kProbeDifference) {
    return {FeatureStatus::kReady,
            temperature_degc - tracks[term.second_track].newest()->temperature_degc};
  }
  if (term.kind == FeatureKind::kLaggedTemperature) {
    const auto lagged = track.temperature_degc_at(now - term.lag);
    return {lagged ? FeatureStatus::kReady : FeatureStatus::kLagNotReady, lagged.value_or(0.0)};
  }
  const auto rate = track.rate_degc_per_s();
  if (!rate) return {FeatureStatus::kRateNotReady, 0.0};
  const double factor = term.kind == FeatureKind::kTemperatureTimesRate ? temperature_degc : 1.0;
  return {FeatureStatus::kReady, factor * *rate};
}

// Once a track is fresh, now lies within max_age of a usable stamp, so now - lag cannot overflow.
FeatureStatus FeatureBuilder::freshness(std::size_t track, core::SensorTime now,
                                        std::span<const TemperatureTrack> tracks) const noexcept {
  if (track >= tracks.size()) return FeatureStatus::kNoTemperature;
  const auto age = tracks[track].age(now);
  if (!age) return FeatureStatus::kNoTemperature;
  const bool fresh = *age <= max_age_ && *age >= -max_age_;
  return fresh ? FeatureStatus::kReady : FeatureStatus::kTemperatureStale;
}

}  // namespace zerodrift::thermal
