// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/playback.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/twin/effect_catalogue.h"

namespace zerodrift::diagnosis {

using twin::index;
using twin::kTemperaturePointCount;
using twin::TemperaturePoint;

namespace {

constexpr double kRoomDegc = 25.0;

constexpr std::array<TemperaturePoint, kTemperaturePointCount> kForUnknownNames{
    TemperaturePoint::kCoil,      TemperaturePoint::kCase,      TemperaturePoint::kBoard,
    TemperaturePoint::kCoilOuter, TemperaturePoint::kCoilInner, TemperaturePoint::kChamber};

// Nearest first, along the path of the heat.
std::array<TemperaturePoint, kTemperaturePointCount - 1> neighbours(TemperaturePoint point) {
  using P = TemperaturePoint;
  switch (point) {
    case P::kChamber:
      return {P::kCase, P::kCoilOuter, P::kCoil, P::kCoilInner, P::kBoard};
    case P::kCase:
      return {P::kCoilOuter, P::kCoil, P::kChamber, P::kBoard, P::kCoilInner};
    case P::kCoilOuter:
      return {P::kCoil, P::kCase, P::kCoilInner, P::kBoard, P::kChamber};
    case P::kCoilInner:
      return {P::kCoil, P::kCoilOuter, P::kCase, P::kBoard, P::kChamber};
    case P::kBoard:
      return {P::kCase, P::kCoilOuter, P::kCoil, P::kCoilInner, P::kChamber};
    case P::kCoil:
      return {P::kCoilOuter, P::kCoilInner, P::kCase, P::kBoard, P::kChamber};
  }
  return {};
}

TemperaturePoint point_at(std::size_t i) {
  return static_cast<TemperaturePoint>(i);
}

double at_or(const std::vector<double>& channel, std::size_t i, double otherwise) {
  return channel.empty() ? otherwise : channel[i];
}

}  // namespace

Playback::Playback(const MeasuredSeries& series) : interval_s_(series.interval_s) {
  assign_probes(series);
  inputs_.resize(series.size);
  for (std::size_t i = 0; i < series.size; ++i) {
    twin::EffectInputs& in = inputs_[i];
    in.sample = i;
    in.time_s = series.time_s(i) - series.start_s + series.interval_s;
    in.since_power_on_s = series.since_power_on_s[i];
    for (std::size_t a = 0; a < core::kAxisCount; ++a) {
      in.true_rate_radps[a] = series.reference_radps[a][i];
      in.magnetic_ut[a] = at_or(series.magnetic_ut[a], i, 0.0);
      in.acceleration_mps2[a] = at_or(series.acceleration_mps2[a], i, 0.0);
    }
    in.vibration_g = at_or(series.vibration_g, i, 0.0);
    in.source_current_ma = at_or(series.source_current_ma, i, twin::kNominalSourceCurrentMa);
    in.supply_v = at_or(series.supply_v, i, twin::kNominalSupplyV);
    set_thermal(series, i, in.thermal);
  }
}

void Playback::assign_probes(const MeasuredSeries& series) {
  std::vector<std::size_t> unknown;
  for (std::size_t p = 0; p < series.probes.size(); ++p) {
    const auto point = twin::temperature_point(series.probes[p].name);
    if (point) {
      probe_[index(*point)] = p;
    } else {
      unknown.push_back(p);
    }
  }
  coil_is_mean_ = !probe_[index(TemperaturePoint::kCoil)] &&
                  probe_[index(TemperaturePoint::kCoilOuter)] &&
                  probe_[index(TemperaturePoint::kCoilInner)];
  for (const std::size_t p : unknown) {
    const auto free = std::find_if(kForUnknownNames.begin(), kForUnknownNames.end(),
                                   [this](TemperaturePoint point) { return !measures(point); });
    if (free != kForUnknownNames.end()) probe_[index(*free)] = p;
  }
}

bool Playback::measures(TemperaturePoint point) const {
  return probe_[index(point)].has_value() || is_mean_of_faces(point);
}

std::vector<TemperaturePoint> Playback::measured_points() const {
  std::vector<TemperaturePoint> points;
  for (std::size_t i = 0; i < kTemperaturePointCount; ++i) {
    if (measures(point_at(i))) points.push_back(point_at(i));
  }
  return points;
}

std::optional<TemperaturePoint> Playback::source_of(TemperaturePoint point) const {
  if (measures(point)) return point;
  for (const TemperaturePoint other : neighbours(point)) {
    if (measures(other)) return other;
  }
  return std::nullopt;
}

void Playback::set_thermal(const MeasuredSeries& series, std::size_t i,
                           twin::ThermalState& state) const {
  const auto read = [&](TemperaturePoint point, double& temperature, double& rate) {
    const ProbeSeries& probe = series.probes[*probe_[index(point)]];
    temperature = probe.temperature_degc[i];
    rate = probe.rate_degc_per_s[i];
  };
  for (std::size_t p = 0; p < kTemperaturePointCount; ++p) {
    double& temperature = state.temperature_degc[p];
    double& rate = state.temperature_rate_degc_per_s[p];
    const auto source = source_of(point_at(p));
    if (!source) {
      temperature = kRoomDegc;
      rate = 0.0;
    } else if (*source == TemperaturePoint::kCoil && coil_is_mean_) {
      double outer = 0.0, inner = 0.0, outer_rate = 0.0, inner_rate = 0.0;
      read(TemperaturePoint::kCoilOuter, outer, outer_rate);
      read(TemperaturePoint::kCoilInner, inner, inner_rate);
      temperature = 0.5 * (outer + inner);
      rate = 0.5 * (outer_rate + inner_rate);
    } else {
      read(*source, temperature, rate);
    }
  }
}

std::vector<double> Playback::run(const twin::EffectDefinition& definition,
                                  const twin::EffectContext& context) const {
  const auto effect = definition.make(context);
  std::vector<double> added(inputs_.size());
  for (std::size_t i = 0; i < inputs_.size(); ++i) {
    const double rate = effect->step(inputs_[i]);
    added[i] = std::isfinite(rate) ? rate : 0.0;
  }
  return added;
}

Playback Playback::averaged(std::size_t block) const {
  Playback coarse = *this;
  coarse.interval_s_ = interval_s_ * static_cast<double>(block);
  coarse.inputs_.clear();
  for (std::size_t begin = 0; begin + block <= inputs_.size(); begin += block) {
    const std::span<const twin::EffectInputs> of_block = inputs().subspan(begin, block);
    twin::EffectInputs& mean = coarse.inputs_.emplace_back(of_block.back());
    mean.sample = coarse.inputs_.size() - 1;
    const auto average = [&](double& value, auto&& of) {
      value = 0.0;
      for (const twin::EffectInputs& in : of_block) value += of(in);
      value /= static_cast<double>(block);
    };
    for (std::size_t p = 0; p < kTemperaturePointCount; ++p) {
      average(mean.thermal.temperature_degc[p],
              [p](const auto& in) { return in.thermal.temperature_degc[p]; });
      average(mean.thermal.temperature_rate_degc_per_s[p],
              [p](const auto& in) { return in.thermal.temperature_rate_degc_per_s[p]; });
    }
    for (std::size_t a = 0; a < core::kAxisCount; ++a) {
      average(mean.true_rate_radps[a], [a](const auto& in) { return in.true_rate_radps[a]; });
      average(mean.magnetic_ut[a], [a](const auto& in) { return in.magnetic_ut[a]; });
      average(mean.acceleration_mps2[a], [a](const auto& in) { return in.acceleration_mps2[a]; });
    }
    average(mean.vibration_g, [](const auto& in) { return in.vibration_g; });
    average(mean.source_current_ma, [](const auto& in) { return in.source_current_ma; });
    average(mean.supply_v, [](const auto& in) { return in.supply_v; });
  }
  return coarse;
}

std::vector<double> Playback::drift(const twin::Model& model, core::Axis axis) const {
  std::vector<double> sum(inputs_.size(), 0.0);
  for (const twin::EffectSpec& spec : model.effects) {
    const twin::DefinitionPtr definition = twin::definition_of(spec);
    if (definition == nullptr || spec.axis != axis || spec.parameters.empty()) continue;
    if (!is_waveform(*definition)) continue;
    const auto added = run(*definition, context_of(spec, *definition, interval_s_));
    for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += added[i];
  }
  return sum;
}

twin::EffectContext default_context(const twin::EffectDefinition& definition, core::Axis axis,
                                    double interval_s) {
  return {.parameters = twin::complete_parameters(definition, {}),
          .inputs = definition.inputs,
          .axis = axis,
          .interval_s = interval_s,
          .noise = twin::NoiseStream(0, "none")};
}

twin::EffectContext context_of(const twin::EffectSpec& spec,
                               const twin::EffectDefinition& definition, double interval_s) {
  twin::EffectContext context = default_context(definition, spec.axis, interval_s);
  context.parameters = twin::complete_parameters(definition, spec.parameters);
  for (std::size_t i = 0; i < spec.inputs.size() && i < context.inputs.size(); ++i)
    context.inputs[i] = twin::temperature_point(spec.inputs[i]).value_or(context.inputs[i]);
  return context;
}

std::vector<double> temperatures(const Playback& playback, twin::TemperaturePoint point) {
  std::vector<double> values;
  values.reserve(playback.inputs().size());
  for (const auto& in : playback.inputs())
    values.push_back(in.thermal.temperature_degc[twin::index(point)]);
  return values;
}

}  // namespace zerodrift::diagnosis
