// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/known_effects.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/core/not_known.h"
#include "common/core/require.h"
#include "common/core/units.h"
#include "common/diagnosis/candidates.h"
#include "common/twin/effect_catalogue.h"

namespace zerodrift::diagnosis {

using twin::EffectDefinition;
using twin::EffectSpec;
using twin::ParameterDefinition;
using twin::ParameterRole;

namespace {

constexpr double kExpectedErrors = 5.0;
constexpr double kExpectedShareOfAmplitude = 0.5;
constexpr double kExpectedShareOfShape = 0.3;
constexpr double kDifferenceShare = 0.02;  // step of the difference columns

// NaN where the model states none.
double standard_error_of(const EffectSpec& spec, const std::string& parameter) {
  const auto found = spec.standard_errors.find(parameter);
  return found == spec.standard_errors.end() ? core::kNaN : found->second;
}

// (f(p + h) - f(p - h)) / 2h.
std::vector<double> shape_column(const Playback& playback, const EffectSpec& spec,
                                 const EffectDefinition& definition, const std::string& shape) {
  twin::EffectContext context = context_of(spec, definition, playback.interval_s());
  const double value = context.parameters[shape];
  const double step = kDifferenceShare * std::abs(value);
  context.parameters[shape] = value + step;
  std::vector<double> column = playback.run(definition, context);
  context.parameters[shape] = value - step;
  const auto below = playback.run(definition, context);
  for (std::size_t i = 0; i < column.size(); ++i) column[i] = (column[i] - below[i]) / (2.0 * step);
  return column;
}

bool is_fitted_shape(const ParameterDefinition& parameter, const EffectSpec& spec) {
  if (parameter.role != ParameterRole::kShape) return false;
  const auto given = spec.parameters.find(parameter.name);
  return given != spec.parameters.end() && given->second != 0.0;
}

double limited(const EffectDefinition& definition, const std::string& name, double value) {
  for (const ParameterDefinition& parameter : definition.parameters) {
    if (parameter.name == name) return parameter.limited(value);
  }
  return value;
}

}  // namespace

std::vector<KnownParameter> known_parameters(const twin::Model& model, core::Axis axis,
                                             const Playback& playback) {
  std::vector<KnownParameter> known;
  for (std::size_t i = 0; i < model.effects.size(); ++i) {
    const EffectSpec& spec = model.effects[i];
    const twin::DefinitionPtr definition = twin::definition_of(spec);
    if (definition == nullptr || spec.axis != axis || spec.parameters.empty()) continue;
    if (definition->family != twin::Family::kDeterministic || definition->search.is_constant)
      continue;
    const auto complete = twin::complete_parameters(*definition, spec.parameters);
    for (const ParameterDefinition& parameter : definition->parameters) {
      const bool amplitude = parameter.role == ParameterRole::kAmplitude;
      if (!amplitude && !is_fitted_shape(parameter, spec)) continue;
      const double value = complete.at(parameter.name);
      const double share = amplitude ? kExpectedShareOfAmplitude : kExpectedShareOfShape;
      double expected = std::fmax(kExpectedErrors * standard_error_of(spec, parameter.name),
                                  share * std::abs(value));  // no NaN
      if (expected == 0.0) expected = std::numeric_limits<double>::infinity();
      known.push_back(
          {i,
           parameter.name,
           value,
           amplitude,
           {.name = label_of(spec) + "." + parameter.name,
            .values = amplitude ? column_of(playback, *definition,
                                            context_of(spec, *definition, playback.interval_s()),
                                            parameter.name)
                                : shape_column(playback, spec, *definition, parameter.name),
            .prior_sd = expected}});
    }
  }
  return known;
}

std::vector<Recalibration> recalibrate(twin::Model& model, const std::vector<KnownParameter>& known,
                                       const std::vector<CorrectionFinding>& corrections) {
  core::require(known.size() == corrections.size(), "each known parameter has its correction");
  std::vector<Recalibration> changed;
  for (std::size_t i = 0; i < known.size(); ++i) {
    const CorrectionFinding& correction = corrections[i];
    if (!correction.significant) continue;
    EffectSpec& spec = model.effects[known[i].effect];
    const double to =
        limited(*twin::definition_of(spec), known[i].parameter, known[i].value + correction.value);
    spec.parameters[known[i].parameter] = to;
    spec.standard_errors[known[i].parameter] = correction.standard_error;
    changed.push_back(
        {label_of(spec), known[i].parameter, known[i].value, to, correction.standard_error});
  }
  return changed;
}

Recalibration shift_bias(twin::Model& model, core::Axis axis, double by_radps) {
  const auto all = twin::effect_catalogue();
  const auto constant = std::find_if(
      all.begin(), all.end(), [](const EffectDefinition& d) { return d.search.is_constant; });
  core::require(constant != all.end(), "the catalogue has a constant effect");
  const std::string& parameter = constant->parameters.front().name;  // deg/h
  const double by_deg_h = by_radps / core::radps_from_deg_h(1.0);
  auto spec = std::find_if(model.effects.begin(), model.effects.end(), [&](const EffectSpec& e) {
    return e.kind == constant->kind && e.axis == axis;
  });
  if (spec == model.effects.end())
    spec = model.effects.insert(spec, {.kind = constant->kind, .axis = axis});
  const auto given = spec->parameters.find(parameter);
  const double to = (given == spec->parameters.end() ? 0.0 : given->second) + by_deg_h;
  spec->parameters[parameter] = to;
  return {spec->kind, parameter, to - core::deg_h_from_radps(by_radps), to,
          standard_error_of(*spec, parameter)};
}

std::vector<Recalibration> merged(std::vector<Recalibration> first,
                                  const std::vector<Recalibration>& later) {
  for (const Recalibration& change : later) {
    const auto same = std::find_if(first.begin(), first.end(), [&](const Recalibration& other) {
      return other.name == change.name && other.parameter == change.parameter;
    });
    if (same == first.end()) {
      first.push_back(change);
      continue;
    }
    same->to = change.to;
    same->standard_error = change.standard_error;
  }
  return first;
}

void keep_what_stands(std::vector<Recalibration>& changes, const twin::Model& model,
                      core::Axis axis) {
  std::erase_if(changes, [&](Recalibration& change) {
    const auto has_it = [&](const EffectSpec& spec) {
      return spec.axis == axis && label_of(spec) == change.name &&
             spec.parameters.contains(change.parameter);
    };
    const auto has_this_value = [&](const EffectSpec& spec) {
      return has_it(spec) && spec.parameters.at(change.parameter) == change.to;
    };
    const auto& all = model.effects;
    if (std::any_of(all.begin(), all.end(), has_this_value)) return false;
    const auto spec = std::find_if(all.begin(), all.end(), has_it);
    if (spec == all.end()) return true;
    change.to = spec->parameters.at(change.parameter);
    change.standard_error = standard_error_of(*spec, change.parameter);
    return false;
  });
}

}  // namespace zerodrift::diagnosis
