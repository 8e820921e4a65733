// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/listed_effects.h"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "common/diagnosis/candidates.h"
#include "common/twin/effect_catalogue.h"

namespace zerodrift::diagnosis {

using twin::EffectSpec;

void tell_untestable(Trial& trial, const TrialInput& input) {
  for (const EffectSpec& spec : input.model.effects) {
    const auto definition = twin::definition_of(spec);
    if (spec.axis != input.axis || definition == nullptr || !is_waveform(*definition)) continue;
    if (auto why = why_not_testable(*definition, input.series, input.playback, input.axis)) {
      trial.not_testable.push_back({label_of(spec), std::move(*why)});
      continue;
    }
    const auto components =
        amplitudes_not_testable(*definition, input.series, input.playback, input.axis);
    trial.not_testable.insert(trial.not_testable.end(), components.begin(), components.end());
  }
}

void tell_unfitted(Trial& trial, const TrialInput& input) {
  for (const EffectSpec& spec : trial.repaired.effects) {
    const auto definition = twin::definition_of(spec);
    if (spec.axis != input.axis || definition == nullptr || !spec.parameters.empty()) continue;
    if (definition->family == twin::Family::kRecordFault) continue;
    const bool is_told =
        std::any_of(trial.not_testable.begin(), trial.not_testable.end(),
                    [&](const NotTestable& entry) { return entry.name == label_of(spec); });
    if (is_told) continue;
    trial.not_testable.push_back(
        {label_of(spec),
         "listed without coefficients, and the record shows too little of it to fit them"});
  }
}

void give_coefficients(EffectSpec& waiting, const Candidate& candidate, const NamedEffect& found,
                       std::vector<Recalibration>& changed) {
  waiting.inputs = found.inputs;
  waiting.parameters = found.parameters;
  waiting.standard_errors = found.standard_errors;
  for (const std::string& amplitude : candidate.amplitudes) {
    const auto error = found.standard_errors.find(amplitude);
    if (error == found.standard_errors.end()) continue;
    changed.push_back(
        {label_of(waiting), amplitude, 0.0, found.parameters.at(amplitude), error->second});
  }
  if (!candidate.amplitudes.empty()) return;  // else its shape is its size
  for (const std::string& shape : names_of(*candidate.definition, twin::ParameterRole::kShape))
    changed.push_back({label_of(waiting), shape, 0.0, found.parameters.at(shape), 0.0});
}

}  // namespace zerodrift::diagnosis
