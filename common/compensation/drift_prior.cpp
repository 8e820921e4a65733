// SPDX-License-Identifier: Apache-2.0
#include "common/compensation/drift_prior.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "common/twin/effect_catalogue.h"

namespace zerodrift::compensation {

using core::index;
using core::kAxes;
using twin::TemperaturePoint;

namespace {

constexpr double kStepS = 1.0;
static_assert(core::seconds(DriftPrior::kStep) == kStepS);

// What temperatures and the time since power-on fulfil. (kLongRecord says how long a record must
// be to find the effect, not what it reads. A free phase is another one after each start, and
// what happened once is over.)
constexpr bool is_at_hand(twin::Need need) {
  switch (need) {
    case twin::Need::kTemperature:
    case twin::Need::kTemperatureDifference:
    case twin::Need::kTemperatureCycles:
    case twin::Need::kPowerOn:
    case twin::Need::kLongRecord: return true;
    default: return false;
  }
}

bool takes_part(const twin::EffectDefinition& definition) {
  return definition.family == twin::Family::kDeterministic &&
         definition.contribution == twin::Contribution::kDrift &&
         !definition.search.has_free_phase && !definition.search.happens_once &&
         std::all_of(definition.needs.begin(), definition.needs.end(), is_at_hand);
}

// Of an effect that takes part; null for others: unknown ones, those that wait to be fitted, ...
twin::DefinitionPtr part_of(const twin::EffectSpec& spec) {
  const auto definition = spec.parameters.empty() ? nullptr : twin::definition_of(spec);
  return definition != nullptr && takes_part(*definition) ? definition : nullptr;
}

std::vector<TemperaturePoint> inputs_of(const twin::EffectSpec& spec,
                                        const twin::EffectDefinition& definition) {
  std::vector<TemperaturePoint> points = definition.inputs;
  for (std::size_t i = 0; i < spec.inputs.size() && i < points.size(); ++i)
    points[i] = twin::temperature_point(spec.inputs[i]).value_or(points[i]);
  return points;
}

std::string described(const twin::EffectSpec& spec) {
  return label_of(spec) + " of axis " + std::string(core::name(spec.axis));
}

bool holds(std::span<const std::string> names, std::string_view name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

bool coil_is_mean(std::span<const std::string> probes) {
  return !holds(probes, "coil") && holds(probes, "coil_outer") && holds(probes, "coil_inner");
}

std::string exact(double value) {
  std::array<char, 32> buffer{};
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value).ptr;
  return {buffer.data(), end};
}

// FNV-1a, 64 bit (Fowler, Noll, Vo), as 16 hexadecimal digits.
std::string hash_of(std::string_view text) {
  std::uint64_t hash = 0xCBF29CE484222325ULL;
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001B3ULL;
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string digits(16, '0');
  for (std::size_t i = 16; i-- > 0; hash >>= 4U) digits[i] = kDigits[hash & 0xFU];
  return digits;
}

std::int64_t grid_index(core::SensorTime time) {
  const std::int64_t quotient = time / DriftPrior::kStep;
  return time % DriftPrior::kStep < core::SensorTime{0} ? quotient - 1 : quotient;
}

}  // namespace

std::optional<std::string> find_wrong_prior(const twin::Model& model) {
  if (const auto line = model.validate()) return "prior: " + *line;
  core::PerAxis<std::size_t> effects{};
  for (const auto& spec : model.effects) {
    if (part_of(spec) != nullptr) ++effects[index(spec.axis)];
  }
  if (effects == core::PerAxis<std::size_t>{}) {
    return "prior: found no effect that temperature or the time since power-on drives, expected at "
           "least one with parameters";
  }
  for (const auto axis : kAxes) {
    if (effects[index(axis)] <= DriftPrior::kMostEffects) continue;
    return "prior: found " + std::to_string(effects[index(axis)]) + " effects of axis " +
           std::string(core::name(axis)) + ", expected at most " +
           std::to_string(DriftPrior::kMostEffects);
  }
  return std::nullopt;
}

std::vector<std::string> effects_left_out(const twin::Model& model) {
  std::vector<std::string> lines;
  for (const auto& spec : model.effects) {
    if (!spec.parameters.empty() && part_of(spec) == nullptr) lines.push_back(described(spec));
  }
  return lines;
}

std::vector<std::string> prior_probes(const twin::Model& model,
                                      std::span<const std::string> configured) {
  std::vector<std::string> names;
  for (const auto& spec : model.effects) {
    const twin::DefinitionPtr definition = part_of(spec);
    if (definition == nullptr) continue;
    for (const TemperaturePoint point : inputs_of(spec, *definition)) {
      std::vector<std::string> needed{std::string(twin::name(point))};
      if (point == TemperaturePoint::kCoil && coil_is_mean(configured))
        needed = {"coil_outer", "coil_inner"};
      for (auto& name : needed) {
        if (!holds(names, name)) names.push_back(std::move(name));
      }
    }
  }
  return names;
}

std::string prior_identity(const twin::Model& model) {
  std::string text;
  std::size_t effects = 0;
  for (const auto& spec : model.effects) {
    const twin::DefinitionPtr definition = part_of(spec);
    if (definition == nullptr) continue;
    ++effects;
    text += described(spec);
    for (const TemperaturePoint point : inputs_of(spec, *definition))
      text += ' ' + std::string(name(point));
    for (const auto& [key, value] : complete_parameters(*definition, spec.parameters))
      text += ' ' + key + ' ' + exact(value);
    text += '\n';
  }
  return model.gyro_id + ", " + std::to_string(effects) + " effects, " + hash_of(text);
}

DriftPrior::DriftPrior(const twin::Model& model, std::span<const std::string> probes) {
  if (const auto line = find_wrong_prior(model)) throw std::invalid_argument(*line);
  for (const auto& spec : model.effects) {
    const twin::DefinitionPtr definition = part_of(spec);
    if (definition == nullptr) continue;
    AxisPrior& axis = axes_[index(spec.axis)];
    axis.specs.push_back(spec);
    for (const TemperaturePoint point : inputs_of(spec, *definition)) {
      resolve(point, probes);
      if (!sources_[twin::index(point)]) {
        std::string known;
        for (const auto& probe : probes) known += (known.empty() ? "" : ", ") + probe;
        throw std::invalid_argument("prior: " + described(spec) + " reads the temperature of '" +
                                    std::string(name(point)) + "', expected one of " + known +
                                    "; name it under probes");
      }
      if (std::find(axis.reads.begin(), axis.reads.end(), point) == axis.reads.end())
        axis.reads.push_back(point);
    }
  }
  for (AxisPrior& axis : axes_) {
    axis.effects = make_effects(axis.specs);
    axis.prepared.reserve(kPrepared);
    for (std::size_t i = 0; i < kPrepared; ++i) axis.prepared.push_back(make_effects(axis.specs));
  }
}

void DriftPrior::resolve(TemperaturePoint point, std::span<const std::string> probes) {
  const auto found = [&](std::string_view name) {
    return static_cast<std::size_t>(std::find(probes.begin(), probes.end(), name) - probes.begin());
  };
  if (point == TemperaturePoint::kCoil && coil_is_mean(probes)) {
    sources_[twin::index(point)] = Source{found("coil_outer"), found("coil_inner")};
  } else if (holds(probes, name(point))) {
    sources_[twin::index(point)] = Source{found(name(point)), found(name(point))};
  }
}

DriftPrior::Effects DriftPrior::make_effects(const std::vector<twin::EffectSpec>& specs) {
  Effects effects;
  effects.reserve(specs.size());
  for (const auto& spec : specs)
    effects.push_back(twin::make_effect(spec, kStepS, twin::NoiseStream(0, "prior")));
  return effects;
}

void DriftPrior::begin_anew(AxisPrior& axis) {
  if (axis.prepared.empty()) axis.prepared.push_back(make_effects(axis.specs));
  axis.effects.swap(axis.prepared.back());
  axis.prepared.pop_back();
  axis.steps = 0;
}

void DriftPrior::restart() noexcept {
  for (AxisPrior& axis : axes_) {
    axis.stepped_to.reset();
    if (axis.steps > 0) begin_anew(axis);
  }
  newest_.reset();
}

void DriftPrior::carry(core::StateArchive& archive) {
  for (AxisPrior& axis : axes_) {
    for (const auto& effect : axis.effects) effect->carry(archive);
    archive(axis.stepped_to, axis.steps, axis.drift_radps, axis.status);
  }
  archive(newest_);
}

bool DriftPrior::is_due(core::SensorTime now) const noexcept {
  return newest_ != grid_index(now);
}

twin::ThermalState DriftPrior::thermal_state(
    std::span<const PriorReading> readings) const noexcept {
  twin::ThermalState state;
  for (std::size_t p = 0; p < twin::kTemperaturePointCount; ++p) {
    const PriorReading none;
    const auto& source = sources_[p];
    const PriorReading& first = source ? readings[source->first] : none;
    const PriorReading& second = source ? readings[source->second] : none;
    state.temperature_degc[p] = 0.5 * (first.temperature_degc + second.temperature_degc);
    state.temperature_rate_degc_per_s[p] = 0.5 * (first.rate_degc_per_s + second.rate_degc_per_s);
  }
  return state;
}

void DriftPrior::step(core::SensorTime now, core::SensorTime power_on,
                      std::span<const PriorReading> readings) noexcept {
  const std::int64_t to = grid_index(now);
  twin::EffectInputs inputs;
  inputs.thermal = thermal_state(readings);
  for (AxisPrior& axis : axes_) {
    if (axis.specs.empty()) continue;
    const bool complete =
        std::all_of(axis.reads.begin(), axis.reads.end(), [&](TemperaturePoint point) {
          return std::isfinite(inputs.thermal.temperature_degc[twin::index(point)]);
        });
    if (complete) {
      step(axis, to, power_on, inputs);
    } else {
      axis.status = PriorStatus::kTemperatureMissing;
    }
  }
  newest_ = to;
}

void DriftPrior::step(AxisPrior& axis, std::int64_t to, core::SensorTime power_on,
                      twin::EffectInputs& inputs) noexcept {
  std::int64_t steps = axis.stepped_to ? to - *axis.stepped_to : 1;
  if (steps < 1 || steps > kLongestPauseSteps) {
    begin_anew(axis);
    steps = 1;
  }
  double sum = 0.0;
  for (std::int64_t at = to - steps + 1; at <= to; ++at) {
    const double since_s = static_cast<double>(at) * kStepS - core::seconds(power_on);
    inputs.sample = axis.steps++;
    inputs.since_power_on_s = std::max(0.0, since_s);
    inputs.time_s = inputs.since_power_on_s;
    sum = 0.0;
    for (const auto& effect : axis.effects) sum += effect->step(inputs);
  }
  axis.stepped_to = to;
  const bool ready = std::isfinite(sum);
  if (ready) axis.drift_radps = sum;
  axis.status = ready ? PriorStatus::kReady : PriorStatus::kRateNotReady;
}

core::Reason DriftPrior::reason(core::Axis axis) const noexcept {
  switch (status(axis)) {
    case PriorStatus::kReady: return core::Reason::kNone;
    case PriorStatus::kRateNotReady: return core::Reason::kRateNotReady;
    case PriorStatus::kTemperatureMissing: break;
  }
  return drift_radps(axis) ? core::Reason::kTemperatureStale : core::Reason::kTemperatureMissing;
}

}  // namespace zerodrift::compensation
