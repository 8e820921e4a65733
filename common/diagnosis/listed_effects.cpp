// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/listed_effects.h"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "common/diagnosis/candidates.h"
#include "common/diagnosis/known_effects.h"
#include "common/diagnosis/lineup.h"
#include "common/twin/effect_catalogue.h"

namespace zerodrift::diagnosis {

using twin::EffectSpec;

void tell_untestable(Trial& trial, const TrialInput& input) {
  for (const EffectSpec& spec : input.model.effects) {
    const auto* definition = twin::find_effect(spec.kind);
    if (spec.axis != input.axis || definition == nullptr || !is_waveform(*definition)) continue;
    if (auto why = why_not_testable(*definition, input.series, input.playback, input.axis)) {
      trial.not_testable.push_back({spec.kind, std::move(*why)});
      continue;
    }
    const auto components =
        amplitudes_not_testable(*definition, input.series, input.playback, input.axis);
    trial.not_testable.insert(trial.not_testable.end(), components.begin(), components.end());
  }
}

void tell_unfitted(Trial& trial, const TrialInput& input) {
  for (const EffectSpec& spec : trial.repaired.effects) {
    const auto* definition = twin::find_effect(spec.kind);
    if (spec.axis != input.axis || definition == nullptr || !spec.parameters.empty()) continue;
    if (definition->family == twin::Family::kRecordFault) continue;
    const bool is_told =
        std::any_of(trial.not_testable.begin(), trial.not_testable.end(),
                    [&](const NotTestable& entry) { return entry.name == spec.kind; });
    if (is_told) continue;
    trial.not_testable.push_back(
        {spec.kind,
         "listed without coefficients, and the record shows too little of it to fit them"});
  }
}

void fit_listed(Trial& trial, const TrialInput& input) {
  twin::Model& model = trial.repaired;
  std::vector<std::size_t> waiting;
  twin::Model without = model;
  for (std::size_t i = 0; i < model.effects.size(); ++i) {
    const EffectSpec& spec = model.effects[i];
    const auto* definition = twin::find_effect(spec.kind);
    if (spec.axis != input.axis || !spec.parameters.empty() || definition == nullptr) continue;
    if (definition->family == twin::Family::kDeterministic && !definition->search.is_constant)
      waiting.push_back(i);
  }
  if (waiting.empty()) return;
  std::erase_if(without.effects, [&](const EffectSpec& spec) {
    return spec.axis == input.axis && spec.parameters.empty();
  });
  const auto drift = input.playback.drift(without, input.axis);
  const auto residual = difference(measured_drift(input.series, input.axis), drift, input.valid);
  const auto known = known_parameters(without, input.axis, input.playback);
  Lineup lineup;
  const Candidates all = candidates(input.series, input.playback, without, input.axis, {});
  for (const std::size_t i : waiting) {
    for (const Candidate& candidate : all.testable) {
      if (candidate.definition->kind == model.effects[i].kind) lineup.add(candidate);
    }
  }
  SearchProblem problem = problem_of(residual, known, model, input);
  problem.groups = lineup.groups(input.series, input.playback);
  SearchOptions options = search_options(input.options);
  options.false_alarm = 0.1;  // they are known to be there
  const SearchReport report = find_missing(problem, options);
  take_groups(trial, report, lineup);
  for (const FoundEffect& found : report.effects) {
    const NamedEffect fitted = lineup.effect_of(found);
    for (const std::size_t i : waiting) {
      EffectSpec& spec = model.effects[i];
      if (spec.kind != fitted.name || !spec.parameters.empty()) continue;
      spec.inputs = fitted.inputs;
      spec.parameters = fitted.parameters;
      spec.standard_errors = fitted.standard_errors;
      for (const std::string& amplitude : lineup.named_by(found.group)->amplitudes) {
        const auto error = fitted.standard_errors.find(amplitude);
        if (error == fitted.standard_errors.end()) continue;  // nothing is known of it
        trial.recalibrated.push_back(
            {spec.kind, amplitude, 0.0, fitted.parameters.at(amplitude), error->second});
      }
    }
  }
}

}  // namespace zerodrift::diagnosis
