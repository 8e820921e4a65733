// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/needs.h"

#include <algorithm>
#include <cmath>

#include "common/diagnosis/rounded_text.h"
#include "common/twin/effect_catalogue.h"

namespace zerodrift::diagnosis {

using twin::EffectDefinition;
using twin::Need;
using twin::ParameterDefinition;
using twin::ParameterRole;

namespace {

// What moves less than this says nothing about an effect.
constexpr double kLeastTemperatureRangeDegc = 0.5;
constexpr double kLeastTemperatureDifferenceDegc = 0.05;  // standard deviation
constexpr double kLeastRecordS = 3600.0;                  // for what needs hours
constexpr double kLeastCycleDegc = 1.0;                   // travelled both up and down

struct Range {
  double low = 0.0;
  double high = 0.0;

  [[nodiscard]] double width() const { return high - low; }
};

Range range_of(const std::vector<double>& values) {
  if (values.empty()) return {};
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  return {*low, *high};
}

bool moves(const std::vector<double>& channel) {
  const Range range = range_of(channel);
  return range.width() > 1e-9 * std::max(std::abs(range.low), std::abs(range.high));
}

std::optional<std::string> no_temperature(const Playback& playback) {
  const auto points = playback.measured_points();
  if (points.empty()) return "no temperature in the record";
  double widest = 0.0;
  for (const auto point : points)
    widest = std::max(widest, range_of(temperatures(playback, point)).width());
  if (widest >= kLeastTemperatureRangeDegc) return std::nullopt;
  return "the temperature moves by " + rounded(widest) + " °C only";
}

double standard_deviation(const std::vector<double>& values) {
  double mean = 0.0;
  for (const double v : values) mean += v;
  mean /= static_cast<double>(values.size());
  double squares = 0.0;
  for (const double v : values) squares += (v - mean) * (v - mean);
  return std::sqrt(squares / static_cast<double>(values.size()));
}

std::optional<std::string> no_difference(const MeasuredSeries& series) {
  if (series.probes.size() < 2) return "needs two thermometers";
  double widest = 0.0;
  for (std::size_t p = 1; p < series.probes.size(); ++p) {
    for (std::size_t q = 0; q < p; ++q) {
      std::vector<double> difference(series.size);
      for (std::size_t i = 0; i < series.size; ++i)
        difference[i] = series.probes[p].temperature_degc[i] - series.probes[q].temperature_degc[i];
      widest = std::max(widest, standard_deviation(difference));
    }
  }
  if (widest >= kLeastTemperatureDifferenceDegc) return std::nullopt;
  return "no two thermometers differ";
}

// Travel up and travel down, the smaller of both, of any probe.
std::optional<std::string> no_cycle(const MeasuredSeries& series) {
  double largest = 0.0;
  for (const ProbeSeries& probe : series.probes) {
    double up = 0.0;
    double down = 0.0;
    for (const double rate : probe.rate_degc_per_s) (rate > 0.0 ? up : down) += std::abs(rate);
    largest = std::max(largest, std::min(up, down) * series.interval_s);
  }
  if (largest >= kLeastCycleDegc) return std::nullopt;
  return "the temperature never turns back";
}

std::optional<std::string> no_channel(const std::vector<double>& channel, const char* what) {
  if (channel.empty()) return std::string("no ") + what + " in the record";
  if (!moves(channel)) return std::string("the ") + what + " never changes";
  return std::nullopt;
}

std::optional<std::string> no_vector(const core::PerAxis<std::vector<double>>& channels,
                                     const char* what) {
  std::optional<std::string> why;
  for (const auto& channel : channels) {
    const auto wrong = no_channel(channel, what);
    if (!wrong) return std::nullopt;
    if (!why || !channel.empty()) why = wrong;
  }
  return why;
}

// Why nothing can be said of one component of what an effect reads: its amplitudes name the axes of
// the gyro, or those that follow the own one.
std::optional<std::string> no_component(Need need, const std::string& amplitude,
                                        const MeasuredSeries& series, core::Axis axis) {
  const auto of = [](const core::PerAxis<std::vector<double>>& channels, const std::string& what,
                     std::size_t component) -> std::optional<std::string> {
    const std::string channel = what + std::string(core::name(core::kAxes[component]));
    if (channels[component].empty()) return "no " + channel + " in the record";
    if (!moves(channels[component])) return channel + " never changes";
    return std::nullopt;
  };
  for (std::size_t i = 0; i < core::kAxisCount; ++i) {
    if (!amplitude.starts_with(std::string(core::name(core::kAxes[i])) + "_")) continue;
    if (need == Need::kMagnetic) return of(series.magnetic_ut, "magnetic_", i);
    if (need == Need::kAcceleration) return of(series.acceleration_mps2, "acceleration_", i);
  }
  if (need != Need::kCrossAxisRate) return std::nullopt;
  const std::size_t steps = amplitude.starts_with("next_axis") ? 1 : 2;
  return of(series.reference_radps, "reference_rate_", (core::index(axis) + steps) % 3);
}

std::optional<std::string> no_rate(const MeasuredSeries& series, core::Axis axis) {
  if (!series.has_reference) return "no reference rate in the record";
  if (!moves(series.reference_radps[core::index(axis)]))
    return "the reference rate about this axis never changes";
  return std::nullopt;
}

std::optional<std::string> no_cross_rate(const MeasuredSeries& series, core::Axis axis) {
  if (!series.has_reference) return "no reference rate in the record";
  for (const core::Axis other : core::kAxes) {
    if (other != axis && moves(series.reference_radps[core::index(other)])) return std::nullopt;
  }
  return "the reference rates about the other axes never change";
}

}  // namespace

std::vector<std::string> names_of(const EffectDefinition& definition, ParameterRole role) {
  std::vector<std::string> names;
  for (const ParameterDefinition& parameter : definition.parameters) {
    if (parameter.role == role) names.push_back(parameter.name);
  }
  return names;
}

std::optional<std::string> why_unmet(Need need, const MeasuredSeries& series,
                                     const Playback& playback, core::Axis axis) {
  switch (need) {
    case Need::kTemperature:
      return no_temperature(playback);
    case Need::kTemperatureDifference:
      return no_difference(series);
    case Need::kTemperatureCycles:
      return no_cycle(series);
    case Need::kReferenceRate:
    case Need::kSlowReferenceRate:
      return no_rate(series, axis);
    case Need::kCrossAxisRate:
      return no_cross_rate(series, axis);
    case Need::kMagnetic:
      return no_vector(series.magnetic_ut, "magnetic field");
    case Need::kAcceleration:
      return no_vector(series.acceleration_mps2, "acceleration");
    case Need::kVibration:
      return no_channel(series.vibration_g, "vibration");
    case Need::kSourceCurrent:
      return no_channel(series.source_current_ma, "source current");
    case Need::kSupply:
      return no_channel(series.supply_v, "supply voltage");
    case Need::kLongRecord: {
      const double duration_s = series.interval_s * static_cast<double>(series.size);
      if (duration_s >= kLeastRecordS) return std::nullopt;
      return "needs an hour, the record has " + rounded(duration_s / 60.0) + " min";
    }
    case Need::kPowerOn:
    case Need::kRawRate:
    case Need::kTimeStamps:
      return std::nullopt;
  }
  return std::nullopt;
}

std::string_view wanted(Need need) {
  switch (need) {
    case Need::kTemperature:
      return "temperatures that move";
    case Need::kTemperatureDifference:
      return "two thermometers that differ";
    case Need::kTemperatureCycles:
      return "temperatures that turn back";
    case Need::kReferenceRate:
    case Need::kSlowReferenceRate:
      return "turns about this axis and their reference rate";
    case Need::kCrossAxisRate:
      return "turns about the other axes and their reference rates";
    case Need::kMagnetic:
      return "a magnetic field that changes";
    case Need::kAcceleration:
      return "an acceleration that changes";
    case Need::kVibration:
      return "vibration that changes";
    case Need::kSourceCurrent:
      return "a source current that changes";
    case Need::kSupply:
      return "a supply voltage that changes";
    case Need::kLongRecord:
    case Need::kPowerOn:
    case Need::kRawRate:
    case Need::kTimeStamps:
      break;
  }
  return {};
}

bool an_input_moves(const MeasuredSeries& series, const Playback& playback, core::Axis axis) {
  const auto needs_input = [](Need need) { return !wanted(need).empty(); };
  const auto& all = twin::effect_catalogue();
  return std::any_of(all.begin(), all.end(), [&](const EffectDefinition& definition) {
    return is_waveform(definition) &&
           std::any_of(definition.needs.begin(), definition.needs.end(), needs_input) &&
           !why_not_testable(definition, series, playback, axis);
  });
}

std::optional<std::string> why_not_testable(const EffectDefinition& definition,
                                            const MeasuredSeries& series, const Playback& playback,
                                            core::Axis axis) {
  for (const Need need : definition.needs) {
    if (auto why = why_unmet(need, series, playback, axis)) return why;
  }
  return std::nullopt;
}

std::vector<NotTestable> amplitudes_not_testable(const EffectDefinition& definition,
                                                 const MeasuredSeries& series,
                                                 const Playback& playback, core::Axis axis) {
  if (why_not_testable(definition, series, playback, axis)) return {};
  std::vector<NotTestable> result;
  for (const std::string& amplitude : names_of(definition, ParameterRole::kAmplitude)) {
    for (const Need need : definition.needs) {
      if (auto why = no_component(need, amplitude, series, axis))
        result.push_back({definition.kind + "." + amplitude, std::move(*why)});
    }
  }
  return result;
}

}  // namespace zerodrift::diagnosis
