// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/search_result.h"

#include <algorithm>
#include <limits>
#include <optional>

#include "common/diagnosis/candidates.h"
#include "common/diagnosis/joint_fit.h"
#include "common/diagnosis/noise_weight.h"
#include "common/diagnosis/rounded_text.h"

namespace zerodrift::diagnosis {

void refit_amplitudes(SearchReport& report, const SearchProblem& searched,
                      const SearchOptions& options) {
  SearchProblem problem = searched;
  problem.known.clear();
  for (std::size_t i = 0; i < report.corrections.size(); ++i) {
    if (!report.corrections[i].significant) continue;
    problem.known.push_back(searched.known[i]);
    problem.known.back().prior_sd = std::numeric_limits<double>::infinity();
  }
  std::vector<ChosenShape> chosen;
  for (const FoundEffect& effect : report.effects) chosen.push_back({effect.group, effect.shape});
  if (report.unknown) chosen.push_back({report.unknown->group, report.unknown->shape});
  const std::optional<JointFit> joint = fit_jointly(problem, chosen, options);
  if (!joint) return;
  for (std::size_t i = 0; i < report.effects.size(); ++i)
    static_cast<FittedEffect&>(report.effects[i]) = joint->effects[i];
  if (report.unknown) static_cast<FittedEffect&>(*report.unknown) = joint->effects.back();
  std::size_t of_joint = 0;
  for (CorrectionFinding& correction : report.corrections) {
    correction.value = 0.0;
    if (!correction.significant) continue;
    const CorrectionFinding& now = joint->corrections[of_joint++];
    correction.value = now.value;
    correction.standard_error = now.standard_error;
  }
}

void free_calibrated(SearchReport& report, const std::vector<KnownParameter>& known,
                     const twin::Model& model, const TrialInput& input) {
  for (std::size_t i = 0; i < report.corrections.size(); ++i) {
    const bool is_calibrated = std::find(input.calibrated.begin(), input.calibrated.end(),
                                         known[i].effect) != input.calibrated.end();
    const twin::EffectSpec& spec = model.effects[known[i].effect];
    CorrectionFinding& correction = report.corrections[i];
    if (is_calibrated && known[i].is_amplitude && spec.standard_errors.contains(known[i].parameter))
      correction.significant |= correction.testability == Testability::kTestable;
  }
}

void take_off_corrections(std::vector<double>& left,
                          const std::vector<CorrectionFinding>& corrections,
                          const SearchProblem& problem) {
  for (std::size_t c = 0; c < corrections.size(); ++c) {
    if (corrections[c].testability != Testability::kTestable) continue;
    for (std::size_t i = 0; i < left.size(); ++i)
      left[i] -= corrections[c].value * problem.known[c].values[i];
  }
  centre(left, problem.valid);
}

std::vector<double> remainder_of(const SearchReport& report, const SearchProblem& problem) {
  std::vector<double> left(problem.series.begin(), problem.series.end());
  const auto take_off = [&](const FittedEffect& effect) {
    for (std::size_t i = 0; i < left.size(); ++i) left[i] -= effect.waveform[i];
  };
  for (const FoundEffect& effect : report.effects) take_off(effect);
  if (report.unknown) take_off(*report.unknown);
  take_off_corrections(left, report.corrections, problem);
  return left;
}

void add_to_model(Trial& trial, const TrialInput& input) {
  const auto add = [&](const NamedEffect& effect) {
    twin::EffectSpec spec = spec_of(effect, input.axis);
    spec.standard_errors = effect.standard_errors;
    spec.origin = {.by = "diagnose",
                   .record = input.options.record,
                   .date = input.options.date,
                   .evidence = "log Bayes factor " + rounded(effect.log_evidence)};
    trial.repaired.effects.push_back(std::move(spec));
  };
  std::for_each(trial.effects.begin(), trial.effects.end(), add);
  std::for_each(trial.events.begin(), trial.events.end(), add);
}

}  // namespace zerodrift::diagnosis
