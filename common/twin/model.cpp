// SPDX-License-Identifier: Apache-2.0
#include "common/twin/model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>
#include <utility>

#include "common/core/closest_name.h"
#include "common/twin/effect_catalogue.h"
#include "common/twin/formula.h"
#include "common/twin/thermal_keys.h"

namespace zerodrift::twin {
namespace {

constexpr double kHighestRateHz = 1e5;
constexpr double kHighestProbeRateHz = 1e3;
constexpr std::size_t kLongestProbeName = 31;

std::string text_of(double value) {
  std::ostringstream text;
  text << value;
  return text.str();
}

std::string found(double value) {
  return ", found " + text_of(value);
}

bool is_rate(double rate_hz, double highest_hz) {
  return rate_hz > 0.0 && rate_hz <= highest_hz;
}

std::optional<Problem> problem_of_plant(const ThermalParameters& p) {
  for (const ThermalKey& key : kThermalKeys) {
    const double value = p.*key.value;
    if (std::isfinite(value) && (key.may_be_zero ? value >= 0.0 : value > 0.0)) continue;
    return Problem{std::string("thermal_plant.") + key.name,
                   (key.may_be_zero ? "must be >= 0 W" : "must be above 0") + found(value)};
  }
  return std::nullopt;
}

// The integration step must be small against every node's own time constant.
std::optional<Problem> problem_of_stiffness(const ThermalParameters& p) {
  const std::array<std::pair<const char*, double>, 4> time_constants{{
      {"case_capacity_j_per_k",
       p.case_capacity_j_per_k /
           (p.chamber_case_w_per_k + p.case_coil_outer_w_per_k + p.case_board_w_per_k)},
      {"coil_outer_capacity_j_per_k",
       p.coil_outer_capacity_j_per_k / (p.case_coil_outer_w_per_k + p.coil_outer_inner_w_per_k)},
      {"coil_inner_capacity_j_per_k", p.coil_inner_capacity_j_per_k / p.coil_outer_inner_w_per_k},
      {"board_capacity_j_per_k", p.board_capacity_j_per_k / p.case_board_w_per_k},
  }};
  constexpr double kShortestS = 1.0;
  for (const auto& [key, tau_s] : time_constants) {
    if (tau_s < kShortestS) {
      return Problem{std::string("thermal_plant.") + key,
                     "gives a time constant of " + text_of(tau_s) + " s, at least 1 s is needed"};
    }
  }
  return std::nullopt;
}

bool is_probe_name(const std::string& name) {
  return !name.empty() && name.size() <= kLongestProbeName &&
         std::all_of(name.begin(), name.end(), [](char c) {
           return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_';
         });
}

std::optional<Problem> problem_of_probe(const ProbeSpec& probe) {
  if (!is_probe_name(probe.name)) {
    return Problem{"name",
                   "must be 1 to 31 characters of a-z, 0-9 and _, found '" + probe.name + "'"};
  }
  if (!is_rate(probe.rate_hz, kHighestProbeRateHz)) {
    return Problem{"rate_hz", "must be above 0 and at most 1000 Hz" + found(probe.rate_hz)};
  }
  const std::array<std::pair<const char*, double>, 3> not_negative{{
      {"lag_s", probe.lag_s},
      {"noise_degc", probe.noise_degc},
      {"quantisation_degc", probe.quantisation_degc},
  }};
  for (const auto& [key, value] : not_negative) {
    if (!(value >= 0.0 && std::isfinite(value))) return Problem{key, "must be >= 0" + found(value)};
  }
  return std::nullopt;
}

std::vector<std::string> names_of(const std::vector<ParameterDefinition>& parameters) {
  std::vector<std::string> names;
  for (const ParameterDefinition& parameter : parameters) names.push_back(parameter.name);
  return names;
}

std::optional<Problem> problem_of_parameter(const std::string& name, double value,
                                            const EffectDefinition& definition) {
  const auto& known = definition.parameters;
  const auto parameter =
      std::find_if(known.begin(), known.end(), [&name](const auto& p) { return p.name == name; });
  const std::string key = "parameters." + name;
  if (parameter == known.end()) {
    return Problem{key, "'" + definition.kind + "' has no such parameter" +
                            core::suggestion(name, names_of(known))};
  }
  if (!(value >= parameter->minimum && value <= parameter->maximum)) {
    return Problem{key, "must be within " + text_of(parameter->minimum) + " and " +
                            text_of(parameter->maximum) + found(value)};
  }
  return std::nullopt;
}

std::optional<Problem> problem_of_standard_errors(const EffectSpec& spec,
                                                  const EffectDefinition& definition) {
  const std::vector<std::string> names = names_of(definition.parameters);
  for (const auto& [name, value] : spec.standard_errors) {
    if (std::find(names.begin(), names.end(), name) == names.end()) {
      return Problem{"standard_errors." + name, "'" + definition.kind + "' has no such parameter" +
                                                    core::suggestion(name, names)};
    }
    if (!(value >= 0.0 && std::isfinite(value))) {
      return Problem{"standard_errors." + name, "must be >= 0" + found(value)};
    }
  }
  return std::nullopt;
}

std::optional<Problem> problem_of_inputs(const EffectSpec& spec,
                                         const EffectDefinition& definition) {
  if (spec.inputs.empty()) return std::nullopt;
  if (spec.inputs.size() != definition.inputs.size()) {
    return Problem{"inputs", "'" + spec.kind + "' reads " +
                                 std::to_string(definition.inputs.size()) +
                                 " temperature(s), found " + std::to_string(spec.inputs.size())};
  }
  for (std::size_t i = 0; i < spec.inputs.size(); ++i) {
    if (temperature_point(spec.inputs[i])) continue;
    return Problem{"inputs[" + std::to_string(i) + "]",
                   "no temperature is called '" + spec.inputs[i] + "'" +
                       core::suggestion(spec.inputs[i], temperature_point_names())};
  }
  return std::nullopt;
}

// Nothing in the catalogue stands for a value that the file leaves out of a formula.
std::optional<Problem> problem_of_values(const EffectSpec& spec,
                                         const EffectDefinition& definition) {
  for (const ParameterDefinition& parameter : definition.parameters) {
    const std::string key = "parameters." + parameter.name;
    if (!spec.parameters.empty() && !spec.parameters.contains(parameter.name))
      return Problem{key, "must be given, as all of a formula's parameters or none"};
    const bool can_be_found =
        parameter.role == ParameterRole::kAmplitude || !parameter.grid.empty();
    if (spec.parameters.empty() && !can_be_found) {
      return Problem{key,
                     "must be given, or a number in its place in the formula: a record finds "
                     "factors of summands, time constants of lags and widths of plays of a "
                     "temperature only"};
    }
  }
  return std::nullopt;
}

std::optional<Problem> problem_of_formula(const EffectSpec& spec) {
  const auto parsed = parse_formula(spec.formula);
  if (const auto* wrong = std::get_if<FormulaProblem>(&parsed))
    return Problem{"formula", wrong->text()};
  const EffectDefinition definition =
      formula_effect(std::get<Formula>(parsed), spec.formula, spec.axis);
  if (!spec.inputs.empty())
    return Problem{"inputs", "a formula names its temperatures itself, found a list"};
  for (const auto& [name, value] : spec.parameters) {
    if (auto problem = problem_of_parameter(name, value, definition)) return problem;
  }
  if (auto problem = problem_of_standard_errors(spec, definition)) return problem;
  return problem_of_values(spec, definition);
}

std::optional<Problem> within(std::optional<Problem> problem, const char* list, std::size_t i) {
  if (problem) problem->key = std::string(list) + '[' + std::to_string(i) + "]." + problem->key;
  return problem;
}

std::optional<Problem> problem_of_repeated_probe(const std::vector<ProbeSpec>& probes) {
  for (std::size_t i = 1; i < probes.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (probes[i].name == probes[j].name) {
        return within(Problem{"name", "two probes are called '" + probes[i].name + "'"}, "probes",
                      i);
      }
    }
  }
  return std::nullopt;
}

}  // namespace

std::optional<Problem> EffectSpec::find_problem() const {
  if (kind == kFormulaKind) return problem_of_formula(*this);
  const EffectDefinition* definition = find_effect(kind);
  if (definition == nullptr) {
    return Problem{"kind", "the catalogue has no effect '" + kind + "'" +
                               core::suggestion(kind, effect_names())};
  }
  if (!formula.empty())
    return Problem{"formula", "only kind 'formula' has one, found '" + kind + "'"};
  for (const auto& [name, value] : parameters) {
    if (auto problem = problem_of_parameter(name, value, *definition)) return problem;
  }
  if (auto problem = problem_of_standard_errors(*this, *definition)) return problem;
  return problem_of_inputs(*this, *definition);
}

std::optional<Problem> Model::find_problem() const {
  if (format_version == 0) return Problem{"format_version", "must be given, 1 or more"};
  if (!is_rate(nominal_rate_hz, kHighestRateHz)) {
    return Problem{"nominal_rate_hz",
                   "must be above 0 and at most 1e5 Hz" + found(nominal_rate_hz)};
  }
  if (auto problem = problem_of_plant(thermal_plant)) return problem;
  if (auto problem = problem_of_stiffness(thermal_plant)) return problem;
  for (std::size_t i = 0; i < probes.size(); ++i) {
    if (auto problem = within(problem_of_probe(probes[i]), "probes", i)) return problem;
  }
  if (auto problem = problem_of_repeated_probe(probes)) return problem;
  for (std::size_t i = 0; i < effects.size(); ++i) {
    if (is_newer() && find_effect(effects[i].kind) == nullptr) continue;
    if (auto problem = within(effects[i].find_problem(), "effects", i)) return problem;
  }
  return std::nullopt;
}

std::optional<std::string> Model::validate() const {
  const auto problem = find_problem();
  return problem ? std::optional<std::string>(problem->text()) : std::nullopt;
}

}  // namespace zerodrift::twin
