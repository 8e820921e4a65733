// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/lineup.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <sstream>

#include "common/core/units.h"
#include "common/twin/effect_catalogue.h"

namespace zerodrift::diagnosis {

using twin::ParameterDefinition;
using twin::ParameterRole;

namespace {

// Named groups count from 0, generic ones from here.
constexpr std::uint32_t kFirstGeneric = 1U << 16U;

GroupId named_id(std::size_t place) {
  return static_cast<GroupId>(place);
}
GroupId generic_id(std::size_t place) {
  return static_cast<GroupId>(kFirstGeneric + static_cast<std::uint32_t>(place));
}

double angle_range_rad(const MeasuredSeries& series, core::Axis axis) {
  double angle = 0.0, low = 0.0, high = 0.0;
  for (const double rate : series.reference_radps[core::index(axis)]) {
    angle += rate * series.interval_s;
    low = std::min(low, angle);
    high = std::max(high, angle);
  }
  return high - low;
}

// Between two peaks of a scan over the angle: a quarter of its resolution at the period listed
// first.
ShapeRange reset_range(const ParameterDefinition& parameter, const Candidate& candidate,
                       const MeasuredSeries& series) {
  constexpr double kRadPerArcsec = core::kRadPerDeg / 3600.0;
  const double period_rad = candidate.variants.front().shapes.at(parameter.name) * kRadPerArcsec;
  const double range_rad = angle_range_rad(series, candidate.axis);
  if (!(range_rad > 0.0)) return {};
  return {ShapeScale::kLogarithmic, parameter.minimum, parameter.maximum,
          1.0 + 0.25 * period_rad / range_rad};
}

// Between the first two values listed.
double spacing_of(const std::string& parameter, const Candidate& candidate) {
  const double first = candidate.variants.front().shapes.at(parameter);
  for (const Variant& variant : candidate.variants) {
    const double value = variant.shapes.at(parameter);
    if (value != first) return std::abs(value - first);
  }
  return 1.0;
}

// How a shape parameter moves between the values listed.
ShapeRange range_of(const ParameterDefinition& parameter, const Candidate& candidate,
                    const MeasuredSeries& series) {
  const double lowest = parameter.minimum;
  const double highest = parameter.maximum;
  const double duration_s = series.interval_s * static_cast<double>(series.size);
  switch (parameter.rule) {
    case twin::SearchRule::kFrequency:
      return {ShapeScale::kLinear, 0.5 / duration_s, 0.5 / series.interval_s, 0.25 / duration_s};
    case twin::SearchRule::kCycleFrequency:
      return {ShapeScale::kLinear, 0.5 / duration_s, 0.5 / series.interval_s, 0.02 / duration_s};
    case twin::SearchRule::kCycleDuty:
    case twin::SearchRule::kCyclePhase: return {ShapeScale::kLinear, lowest, highest, 1.0 / 96.0};
    case twin::SearchRule::kAngle: return reset_range(parameter, candidate, series);
    case twin::SearchRule::kPeriod: return {ShapeScale::kLogarithmic, lowest, highest, 1.02};
    case twin::SearchRule::kThreshold:
      return {ShapeScale::kLinear, lowest, highest, spacing_of(parameter.name, candidate)};
    case twin::SearchRule::kTime: return {ShapeScale::kLinear, 0.0, duration_s, duration_s / 200.0};
    case twin::SearchRule::kLag:
      // Those listed, 0 to 1800 s, lie twice to three times as far from -60 s as the one before:
      // half that way from either side leaves none out.
      return {ShapeScale::kLogarithmic, lowest, duration_s / 4.0, 2.0, -60.0};
    case twin::SearchRule::kBetweenFaces: return {};
    case twin::SearchRule::kWithinGrid:
      return {ShapeScale::kLogarithmic, parameter.grid.front(), parameter.grid.back(),
              parameter.grid[1] / parameter.grid[0]};
    case twin::SearchRule::kHalfWidth:
    case twin::SearchRule::kGrid: break;
  }
  if (parameter.grid.size() < 2) return {};
  if (parameter.rule == twin::SearchRule::kHalfWidth) {
    double widest = parameter.grid.front();
    for (const ProbeSeries& probe : series.probes)
      widest = std::max(widest, widest_loop_degc(probe.temperature_degc));
    return {ShapeScale::kLogarithmic, parameter.grid.front() / 4.0, widest,
            parameter.grid[1] / parameter.grid[0]};
  }
  if (parameter.grid.front() > 0.0) {
    return {ShapeScale::kLogarithmic, parameter.grid.front() / 4.0, parameter.grid.back() * 4.0,
            parameter.grid[1] / parameter.grid[0]};
  }
  return {ShapeScale::kLinear, lowest, highest, parameter.grid[1] - parameter.grid[0]};
}

std::string name_of(const GenericFunction& function) {
  std::string name = "f(" + function.depends_on.front();
  for (std::size_t i = 1; i < function.depends_on.size(); ++i)
    name += ", " + function.depends_on[i];
  return name + ")";
}

// All that makes its columns but the record and the shape.
std::string identity_of(const Candidate& candidate, const ShapeCode& code) {
  std::ostringstream text;
  text << std::hexfloat << label_of(*candidate.definition);
  for (const auto& [name, value] : candidate.conventions) text << ' ' << name << '=' << value;
  for (const auto& choice : code.choices) {
    text << " of";
    for (const twin::TemperaturePoint point : choice) text << ' ' << twin::name(point);
  }
  return text.str();
}

CandidateGroup group_of(const Candidate& candidate, const ShapeCode& code,
                        const MeasuredSeries& series, const Playback& playback) {
  CandidateGroup group;
  group.name = label_of(*candidate.definition);
  group.identity = identity_of(candidate, code);
  group.family = twin::input_family(*candidate.definition);
  group.happens_once = candidate.definition->search.happens_once;
  group.has_powers = candidate.definition->search.has_powers;
  group.least_amplitude = candidate.definition->search.least_amplitude;
  group.greatest_amplitude = candidate.definition->search.greatest_amplitude;
  for (const Variant& variant : candidate.variants)
    group.variants.push_back({code.encode(variant), variant.log_prior});
  group.ranges.push_back({});
  for (const ParameterDefinition& parameter : candidate.definition->parameters) {
    if (parameter.role == ParameterRole::kShape)
      group.ranges.push_back(range_of(parameter, candidate, series));
  }
  group.columns = [&candidate, &code, &playback](const std::vector<double>& shape) {
    const twin::EffectContext context =
        context_of(candidate, code.decode(shape), playback.interval_s());
    return columns_of(playback, *candidate.definition, context);
  };
  return group;
}

CandidateGroup group_of(const GenericFunction& function) {
  CandidateGroup group;
  group.name = name_of(function);
  group.identity = group.name;
  group.kind = CandidateKind::kGeneric;
  group.family = function.family;
  for (std::size_t i = 0; i < function.resolutions.size(); ++i)
    group.variants.push_back({.shape = {static_cast<double>(i)}});
  group.columns = [&function](const std::vector<double>& shape) {
    return function.resolutions.at(static_cast<std::size_t>(std::llround(shape.front())));
  };
  return group;
}

}  // namespace

ShapeCode::ShapeCode(const Candidate& candidate)
    : names(names_of(*candidate.definition, ParameterRole::kShape)) {
  for (const Variant& variant : candidate.variants) {
    if (std::find(choices.begin(), choices.end(), variant.inputs) == choices.end())
      choices.push_back(variant.inputs);
  }
}

std::vector<double> ShapeCode::encode(const Variant& variant) const {
  const auto choice = std::find(choices.begin(), choices.end(), variant.inputs);
  std::vector<double> shape{static_cast<double>(choice - choices.begin())};
  for (const std::string& name : names) shape.push_back(variant.shapes.at(name));
  return shape;
}

Variant ShapeCode::decode(const std::vector<double>& shape) const {
  Variant variant;
  variant.inputs = choices.at(static_cast<std::size_t>(std::llround(shape.front())));
  for (std::size_t i = 0; i < names.size(); ++i) variant.shapes[names[i]] = shape[i + 1];
  return variant;
}

void Lineup::add(Candidate candidate) {
  codes.emplace_back(candidate);
  named.push_back(std::move(candidate));
}

const Candidate* Lineup::named_by(GroupId id) const {
  const auto place = static_cast<std::size_t>(id);
  return place < named.size() ? &named[place] : nullptr;
}

const GenericFunction* Lineup::generic_by(GroupId id) const {
  return id < generic_id(0) ? nullptr : &generic[static_cast<std::size_t>(id) - kFirstGeneric];
}

Variant Lineup::variant_of(GroupId id, const std::vector<double>& shape) const {
  return codes.at(static_cast<std::size_t>(id)).decode(shape);
}

std::string Lineup::name_of(GroupId id) const {
  const Candidate* candidate = named_by(id);
  return candidate != nullptr ? label_of(*candidate->definition)
                              : diagnosis::name_of(*generic_by(id));
}

std::vector<CandidateGroup> Lineup::groups(const MeasuredSeries& series,
                                           const Playback& playback) const {
  std::vector<CandidateGroup> all;
  for (std::size_t i = 0; i < named.size(); ++i) {
    all.push_back(group_of(named[i], codes[i], series, playback));
    all.back().id = named_id(i);
    const auto limit = std::find_if(named.begin(), named.end(), [&](const Candidate& candidate) {
      return candidate.definition->kind == named[i].definition->search.limit;
    });
    if (limit != named.end())
      all.back().parent = named_id(static_cast<std::size_t>(limit - named.begin()));
  }
  for (std::size_t i = 0; i < generic.size(); ++i) {
    all.push_back(group_of(generic[i]));
    all.back().id = generic_id(i);
  }
  // What is known to be there needn't pay for where else one looked.
  for (std::size_t i = 0; i < named.size(); ++i) {
    if (named[i].is_listed) all[i].log_prior = std::log(static_cast<double>(all.size()));
  }
  return all;
}

NamedEffect Lineup::effect_of(const FoundEffect& found) const {
  NamedEffect effect = fitted_as(found);
  effect.probability = found.probability;
  effect.log_evidence = found.log_evidence;
  for (const RankedGroup& ranked : found.credible_set) {
    if (ranked.group != found.group)
      effect.alternatives.push_back({name_of(ranked.group), ranked.probability});
  }
  return effect;
}

NamedEffect Lineup::fitted_as(const FittedEffect& found) const {
  NamedEffect effect;
  const Candidate& candidate = *named_by(found.group);
  effect.name = candidate.definition->kind;
  effect.formula = candidate.definition->formula;
  const Variant variant = variant_of(found.group, found.shape);
  if (!candidate.definition->search.has_fixed_inputs) {
    for (const auto point : variant.inputs) effect.inputs.emplace_back(twin::name(point));
  }
  effect.parameters = candidate.conventions;
  for (const auto& [name, value] : variant.shapes) effect.parameters[name] = value;
  for (std::size_t a = 0; a < candidate.amplitudes.size(); ++a) {
    const auto row = static_cast<Eigen::Index>(a);
    effect.parameters[candidate.amplitudes[a]] = found.amplitudes[a];
    if (found.covariance(row, row) > 0.0)
      effect.standard_errors[candidate.amplitudes[a]] = std::sqrt(found.covariance(row, row));
  }
  // A fit knows no limits, and a model beyond them can't be read again.
  for (const ParameterDefinition& parameter : candidate.definition->parameters) {
    const auto value = effect.parameters.find(parameter.name);
    if (value != effect.parameters.end()) value->second = parameter.limited(value->second);
  }
  return effect;
}

}  // namespace zerodrift::diagnosis
