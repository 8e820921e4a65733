// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/candidates.h"

#include <algorithm>
#include <cmath>

#include "common/core/units.h"
#include "common/twin/effect_catalogue.h"
#include "common/twin/power_on.h"

namespace zerodrift::diagnosis {

using twin::EffectDefinition;
using twin::Need;
using twin::ParameterDefinition;
using twin::ParameterRole;
using twin::SearchRule;
using twin::TemperaturePoint;

namespace {

// Quantiles of the temperature, for thresholds within its range.
std::vector<double> thresholds(const Playback& playback, TemperaturePoint point) {
  constexpr int kThresholds = 24;
  auto values = temperatures(playback, point);
  std::sort(values.begin(), values.end());
  const double low = values.front();
  const double width = values.back() - low;
  std::vector<double> grid;
  for (int i = 1; i <= kThresholds; ++i) grid.push_back(low + width * i / (kThresholds + 1.0));
  return grid;
}

std::vector<double> inverse(const std::vector<double>& frequencies, double scale) {
  std::vector<double> periods;
  for (const double frequency : frequencies) periods.push_back(scale / frequency);
  return periods;
}

// Of the three that are searched together.
bool is_of_cycle(SearchRule rule) {
  return rule == SearchRule::kCycleFrequency || rule == SearchRule::kCycleDuty ||
         rule == SearchRule::kCyclePhase;
}

double value_of(const Cycle& cycle, SearchRule rule) {
  if (rule == SearchRule::kCycleFrequency) return cycle.frequency_hz;
  return rule == SearchRule::kCycleDuty ? cycle.duty : cycle.phase_turns;
}

// What a search tries for one shape parameter, and how many independent values that stands for.
struct Grid {
  std::vector<double> values;
  double looked_at;
};

Grid grid_of(const ParameterDefinition& parameter, const Playback& playback,
             const std::vector<TemperaturePoint>& inputs, const Scans& scans) {
  constexpr double kArcsecPerRad = 3600.0 / core::kRadPerDeg;
  if (parameter.rule == SearchRule::kFrequency)
    return {scans.lines.frequencies, scans.lines.looked_at};
  if (parameter.rule == SearchRule::kTime) {
    std::vector<double> times_s;
    for (const std::size_t place : scans.steps.first_after)
      times_s.push_back(static_cast<double>(place) * playback.interval_s());
    return {std::move(times_s), scans.steps.looked_at};
  }
  if (parameter.rule == SearchRule::kAngle) {
    return {inverse(scans.resets.frequencies, kArcsecPerRad), scans.resets.looked_at};
  }
  if (parameter.rule == SearchRule::kPeriod && !inputs.empty()) {
    const auto& fringes = scans.fringes[twin::index(inputs.front())];
    return {inverse(fringes.frequencies, 1.0), fringes.looked_at};
  }
  if (parameter.rule == SearchRule::kBetweenFaces) {
    constexpr double kToldApart = 2.0;  // of columns that are nearly parallel
    const bool has_faces = !inputs.empty() && playback.is_mean_of_faces(inputs.front());
    return has_faces ? Grid{parameter.grid, kToldApart} : Grid{{parameter.default_value}, 1.0};
  }
  std::vector<double> values = parameter.rule == SearchRule::kThreshold && !inputs.empty()
                                   ? thresholds(playback, inputs.front())
                               : parameter.grid.empty()
                                   ? std::vector<double>{parameter.default_value}
                                   : parameter.grid;
  const double greatest = parameter.rule == SearchRule::kHalfWidth && !inputs.empty()
                              ? std::max(parameter.grid.front(),
                                         widest_loop_degc(temperatures(playback, inputs.front())))
                              : parameter.maximum;
  std::erase_if(values, [&](double v) { return !(v >= parameter.minimum && v <= greatest); });
  const auto count = static_cast<double>(values.size());
  return {std::move(values), count};
}

// Every choice of measured places for `count` inputs; pairs without regard to their order, since an
// amplitude has either sign.
std::vector<std::vector<TemperaturePoint>> input_choices(const Playback& playback,
                                                         std::size_t count) {
  if (count == 0) return {{}};
  const auto points = playback.measured_points();
  std::vector<std::vector<TemperaturePoint>> choices;
  if (count == 1) {
    for (const auto point : points) choices.push_back({point});
  } else if (count == 2) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      for (std::size_t j = i + 1; j < points.size(); ++j) choices.push_back({points[i], points[j]});
    }
  }
  return choices;
}

// One for each cycle where the effect is one, else one without shapes.
std::vector<Variant> first_variants(const EffectDefinition& definition,
                                    const std::vector<TemperaturePoint>& inputs,
                                    const std::vector<Cycle>& cycles) {
  const auto& parameters = definition.parameters;
  const bool is_cycle = std::any_of(parameters.begin(), parameters.end(),
                                    [](const auto& p) { return is_of_cycle(p.rule); });
  if (!is_cycle) return {{.inputs = inputs}};
  std::vector<Variant> variants;
  for (const Cycle& cycle : cycles) {
    Variant& variant = variants.emplace_back(Variant{.inputs = inputs});
    for (const ParameterDefinition& parameter : parameters) {
      if (is_of_cycle(parameter.rule))
        variant.shapes[parameter.name] = value_of(cycle, parameter.rule);
    }
  }
  return variants;
}

void add_variants(Candidate& candidate, const Playback& playback,
                  const std::vector<TemperaturePoint>& inputs, const Scans& scans) {
  auto variants = first_variants(*candidate.definition, inputs, scans.cycles);
  double looked_at = 1.0;
  for (const ParameterDefinition& parameter : candidate.definition->parameters) {
    if (parameter.role != ParameterRole::kShape) continue;
    if (is_of_cycle(parameter.rule)) {
      looked_at *= parameter.rule == SearchRule::kCycleFrequency
                       ? scans.lines.looked_at
                       : static_cast<double>(parameter.grid.size());
      continue;
    }
    const Grid grid = grid_of(parameter, playback, inputs, scans);
    looked_at *= grid.looked_at;
    std::vector<Variant> longer;
    for (const double value : grid.values) {
      for (Variant variant : variants) {
        variant.shapes[parameter.name] = value;
        longer.push_back(std::move(variant));
      }
    }
    variants = std::move(longer);
  }
  for (Variant& variant : variants) variant.log_prior = -std::log(looked_at);
  candidate.variants.insert(candidate.variants.end(), variants.begin(), variants.end());
}

using Choices = std::vector<std::vector<TemperaturePoint>>;

void add_choices(Candidate& candidate, const Playback& playback, const Choices& choices,
                 const Scans& scans) {
  for (const auto& inputs : choices) add_variants(candidate, playback, inputs, scans);
  for (Variant& variant : candidate.variants)
    variant.log_prior -= std::log(static_cast<double>(choices.size()));
}

// The temperatures that the file says, or any.
Choices choices_of(const twin::EffectSpec& spec, const EffectDefinition& definition,
                   const Playback& playback) {
  if (definition.search.has_fixed_inputs) return {definition.inputs};
  if (spec.inputs.empty()) return input_choices(playback, definition.inputs.size());
  return {context_of(spec, definition, playback.interval_s()).inputs};
}

const twin::EffectSpec* listed_in(const twin::Model& model, core::Axis axis,
                                  const std::string& kind) {
  const auto found =
      std::find_if(model.effects.begin(), model.effects.end(),
                   [&](const auto& spec) { return spec.axis == axis && spec.kind == kind; });
  return found == model.effects.end() ? nullptr : &*found;
}

bool lends(const twin::EffectSpec& spec, core::Axis axis, twin::Lending lending) {
  const EffectDefinition* definition = twin::find_effect(spec.kind);
  return spec.axis == axis && definition != nullptr && definition->search.lends == lending;
}

// The effect of an axis that the others take their conventions from.
const twin::EffectSpec* lender_in(const twin::Model& model, core::Axis axis) {
  for (const twin::EffectSpec& spec : model.effects) {
    if (lends(spec, axis, twin::Lending::kConventions)) return &spec;
  }
  return nullptr;
}

std::vector<TemperaturePoint> inputs_of(const twin::EffectSpec& spec, const Playback& playback) {
  return context_of(spec, *twin::find_effect(spec.kind), playback.interval_s()).inputs;
}

twin::Parameters borrowed(const EffectDefinition& definition, const twin::Model& model,
                          const Playback& playback, core::Axis axis) {
  twin::Parameters values;
  const twin::EffectSpec* lender = lender_in(model, axis);
  if (lender == nullptr) return values;
  for (const twin::EffectSpec& spec : model.effects) {
    const bool is_beside = lends(spec, axis, twin::Lending::kBesideAnother) &&
                           inputs_of(spec, playback) == inputs_of(*lender, playback);
    if (&spec != lender && !is_beside) continue;
    for (const std::string& name : names_of(definition, ParameterRole::kConvention)) {
      const auto given = spec.parameters.find(name);
      if (given != spec.parameters.end()) values[name] = given->second;
    }
  }
  return values;
}

std::optional<std::string> nothing_to_borrow(const EffectDefinition& definition,
                                             const twin::Model& model, core::Axis axis) {
  if (definition.search.without_lender.empty()) return std::nullopt;
  const twin::EffectSpec* lender = lender_in(model, axis);
  if (lender != nullptr && !lender->parameters.empty()) return std::nullopt;
  return definition.search.without_lender;
}

}  // namespace

double widest_loop_degc(const std::vector<double>& course_degc) {
  const auto [low, high] = std::minmax_element(course_degc.begin(), course_degc.end());
  return 0.25 * (*high - *low);
}

Scans scan_residual(std::span<const double> weighted, std::span<const double> variances,
                    const Playback& playback, core::Axis axis) {
  constexpr std::size_t kPeaks = 6;
  constexpr double kShortestPeriodDegc = 0.5;
  constexpr double kLowestFringes = 1.5;  // below, a polynomial does as well
  Scans found;
  found.lines = line_peaks(weighted, playback.interval_s(), kPeaks);
  std::vector<double> middle_s;
  for (const auto& in : playback.inputs())
    middle_s.push_back(in.time_s - 0.5 * playback.interval_s());
  found.cycles = cycles_at(found.lines.frequencies, weighted, middle_s);
  for (const TemperaturePoint point : playback.measured_points()) {
    found.fringes[twin::index(point)] =
        oscillation_peaks(weighted, temperatures(playback, point),
                          {.lowest_cycles = kLowestFringes,
                           .highest_frequency = 1.0 / kShortestPeriodDegc,
                           .peaks = kPeaks});
  }
  std::vector<double> middle_rad, turn_rad;  // since power-on; in each interval
  double turned = 0.0;
  double since_power_on_s = 0.0;
  for (const auto& in : playback.inputs()) {
    if (twin::was_off(since_power_on_s, in.since_power_on_s)) turned = 0.0;
    since_power_on_s = in.since_power_on_s;
    const double turn = in.true_rate_radps[core::index(axis)] * playback.interval_s();
    middle_rad.push_back(turned + 0.5 * turn);
    turn_rad.push_back(turn);
    turned += turn;
  }
  found.resets = angle_peaks(weighted, middle_rad, turn_rad, kPeaks);
  found.steps = step_places(weighted.first(variances.size()), variances, kPeaks);
  return found;
}

std::optional<Candidate> listed_candidate(const twin::EffectSpec& spec,
                                          const MeasuredSeries& series, const Playback& playback,
                                          const twin::Model& model) {
  const twin::DefinitionPtr found = twin::definition_of(spec);
  const EffectDefinition& definition = *found;
  if (why_not_testable(definition, series, playback, spec.axis)) return std::nullopt;
  if (nothing_to_borrow(definition, model, spec.axis)) return std::nullopt;
  Candidate candidate{.definition = found,
                      .axis = spec.axis,
                      .amplitudes = names_of(definition, ParameterRole::kAmplitude),
                      .conventions = borrowed(definition, model, playback, spec.axis),
                      .is_listed = true};
  if (candidate.amplitudes.empty()) return std::nullopt;
  add_choices(candidate, playback, choices_of(spec, definition, playback), {});
  if (candidate.variants.empty()) return std::nullopt;
  return candidate;
}

Candidates candidates(const MeasuredSeries& series, const Playback& playback,
                      const twin::Model& model, core::Axis axis, const Scans& scans) {
  Candidates result;
  const twin::EffectSpec* lender = lender_in(model, axis);
  for (const EffectDefinition& definition : twin::effect_catalogue()) {
    if (!is_waveform(definition) || definition.search.is_constant) continue;
    const twin::EffectSpec* listed = listed_in(model, axis, definition.kind);
    if (listed != nullptr && !listed->parameters.empty()) continue;
    auto why = why_not_testable(definition, series, playback, axis);
    if (!why) why = nothing_to_borrow(definition, model, axis);
    if (why) {
      if (listed == nullptr) result.not_testable.push_back({definition.kind, *why});
      continue;
    }
    auto components = amplitudes_not_testable(definition, series, playback, axis);
    if (listed != nullptr) components.clear();
    result.not_testable.insert(result.not_testable.end(), components.begin(), components.end());
    Candidate candidate{.definition = {twin::DefinitionPtr(), &definition},
                        .axis = axis,
                        .amplitudes = names_of(definition, ParameterRole::kAmplitude),
                        .conventions = borrowed(definition, model, playback, axis),
                        .is_listed = listed != nullptr};
    const bool reads_as_lender = !definition.search.without_lender.empty() && lender != nullptr;
    const auto choices = listed != nullptr ? choices_of(*listed, definition, playback)
                         : reads_as_lender ? Choices{inputs_of(*lender, playback)}
                                           : input_choices(playback, definition.inputs.size());
    add_choices(candidate, playback, choices, scans);
    if (!candidate.variants.empty()) result.testable.push_back(std::move(candidate));
  }
  for (const twin::EffectSpec& spec : model.effects) {
    if (spec.axis != axis || spec.formula.empty() || !spec.parameters.empty()) continue;
    auto candidate = listed_candidate(spec, series, playback, model);
    if (candidate) result.testable.push_back(std::move(*candidate));
  }
  return result;
}

std::vector<std::vector<double>> columns_of(const Playback& playback,
                                            const EffectDefinition& definition,
                                            const twin::EffectContext& context) {
  const auto amplitudes = names_of(definition, ParameterRole::kAmplitude);
  if (amplitudes.empty()) return {playback.run(definition, context)};
  std::vector<std::vector<double>> columns;
  for (const std::string& amplitude : amplitudes)
    columns.push_back(column_of(playback, definition, context, amplitude));
  return columns;
}

std::vector<double> column_of(const Playback& playback, const EffectDefinition& definition,
                              twin::EffectContext context, const std::string& amplitude) {
  // A formula's rate is bounded, and 1 of an amplitude in its own unit may be far beyond: it is run
  // at a power of two that no digit notices.
  const double unit = definition.formula.empty() ? 1.0 : 0x1p-60;
  for (const ParameterDefinition& parameter : definition.parameters) {
    if (parameter.role == ParameterRole::kAmplitude)
      context.parameters[parameter.name] = parameter.name == amplitude ? unit : 0.0;
  }
  std::vector<double> column = playback.run(definition, context);
  for (double& value : column) value /= unit;
  return column;
}

twin::EffectSpec spec_of(const NamedEffect& effect, core::Axis axis) {
  return {.kind = effect.name,
          .axis = axis,
          .parameters = effect.parameters,
          .inputs = effect.inputs,
          .formula = effect.formula};
}

twin::EffectContext context_of(const Candidate& candidate, const Variant& variant,
                               double interval_s) {
  twin::EffectContext context = default_context(*candidate.definition, candidate.axis, interval_s);
  context.inputs = variant.inputs;
  for (const auto& [name, value] : candidate.conventions) context.parameters[name] = value;
  for (const auto& [name, value] : variant.shapes) context.parameters[name] = value;
  return context;
}

}  // namespace zerodrift::diagnosis
