// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/repair.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "common/core/require.h"
#include "common/diagnosis/calibration.h"
#include "common/diagnosis/candidates.h"
#include "common/diagnosis/cosine_transform.h"
#include "common/diagnosis/generic_functions.h"
#include "common/diagnosis/held_out.h"
#include "common/diagnosis/joint_fit.h"
#include "common/diagnosis/known_effects.h"
#include "common/diagnosis/listed_effects.h"
#include "common/diagnosis/noise_and_bias.h"
#include "common/diagnosis/noise_level.h"
#include "common/diagnosis/noise_of_model.h"
#include "common/diagnosis/noise_weight.h"
#include "common/diagnosis/search_result.h"
#include "common/diagnosis/stochastic_effects.h"
#include "common/diagnosis/thinning.h"
#include "common/diagnosis/unknown_effect.h"
#include "common/twin/effect_catalogue.h"

namespace zerodrift::diagnosis {

using twin::EffectSpec;
using twin::ParameterDefinition;
using twin::ParameterRole;

namespace {

// What the known effects alone leave of the residual, over its noise.
struct WeightedResidual {
  std::vector<double> weighted{};
  std::vector<double> variances{};
};

std::optional<WeightedResidual> weighted_residual(const SearchProblem& problem,
                                                  const TrialInput& input) {
  const auto noise = fit_noise_beside(problem, search_options(input.options));
  if (!noise) return std::nullopt;
  std::vector<double> left(problem.series.begin(), problem.series.end());
  take_off_corrections(left, noise->corrections, problem);
  const std::size_t quick = smooth_length_up_to(left.size());
  WeightedResidual residual{.variances = dct_variances(noise->noise_terms, noise->noise_squares,
                                                       quick, input.series.interval_s)};
  residual.weighted = divided_by_noise(std::span(left).first(quick), residual.variances);
  residual.weighted.resize(left.size(), 0.0);
  return residual;
}

// Whether a course over the temperature comes from this very record, a polynomial or a formula
// that somebody wrote: it leaves the rest of its form in it. An effect of one size leaves none that
// one with a stated size would not.
bool has_course_from_here(const TrialInput& input) {
  for (std::size_t i = 0; i < input.model.effects.size(); ++i) {
    const twin::EffectSpec& spec = input.model.effects[i];
    const twin::DefinitionPtr definition = twin::definition_of(spec);
    if (spec.axis != input.axis || definition == nullptr || !is_waveform(*definition)) continue;
    const bool is_from_here =
        spec.parameters.empty() ||
        std::find(input.calibrated.begin(), input.calibrated.end(), i) != input.calibrated.end();
    if (is_from_here && (definition->search.has_powers || !spec.formula.empty())) return true;
  }
  return false;
}

Lineup line_up(const twin::Model& model, const TrialInput& input, const SearchProblem& problem,
               std::vector<GenericFunction> generic, std::vector<NotTestable>& not_testable) {
  const auto residual = weighted_residual(problem, input);
  const Scans scans =
      residual ? scan_residual(residual->weighted, residual->variances, input.playback, input.axis)
               : Scans{};
  Candidates found = candidates(input.series, input.playback, model, input.axis, scans);
  if (residual) thin_out(found.testable, input.playback, residual->weighted, residual->variances);
  not_testable.insert(not_testable.end(), found.not_testable.begin(), found.not_testable.end());
  Lineup lineup;
  for (Candidate& candidate : found.testable) {
    const bool refuted = std::find(input.refuted.begin(), input.refuted.end(),
                                   label_of(*candidate.definition)) != input.refuted.end();
    const bool may_be_a_rest =
        candidate.definition->search.happens_once && has_course_from_here(input);
    if (!refuted && !may_be_a_rest) lineup.add(std::move(candidate));
  }
  lineup.generic = std::move(generic);
  return lineup;
}

// r' C^-1 r of what an effect with these parameters would leave.
double misfit(const NamedEffect& effect, const std::vector<double>& without,
              const std::vector<double>& dct_variances, const TrialInput& input) {
  const EffectSpec spec = spec_of(effect, input.axis);
  const twin::EffectDefinition& definition = *twin::find_effect(effect.name);
  const auto waveform =
      input.playback.run(definition, context_of(spec, definition, input.series.interval_s));
  return weighted_square(difference(without, waveform, input.valid), input.valid, dct_variances);
}

// An effect without an amplitude has the size that its shape gives it: the shape that fits as it
// is, within a factor of five of the one whose column was chosen, or of what it would be if its
// waveform grew with it.
void fit_size(NamedEffect& effect, const Candidate& candidate, double factor,
              const std::vector<double>& without, const SearchReport& report,
              const TrialInput& input) {
  constexpr int kSteps = 60;
  const auto shapes = names_of(*candidate.definition, ParameterRole::kShape);
  if (!candidate.amplitudes.empty() || shapes.size() != 1) return;
  const auto variances =
      dct_variances(report.noise_terms, report.noise_squares, smooth_length_up_to(without.size()),
                    input.series.interval_s);
  const ParameterDefinition& parameter = *std::find_if(
      candidate.definition->parameters.begin(), candidate.definition->parameters.end(),
      [&](const ParameterDefinition& p) { return p.name == shapes.front(); });
  double& value = effect.parameters[shapes.front()];
  const double chosen = value;
  double best = chosen;
  double least = std::numeric_limits<double>::infinity();
  for (const double around : {chosen, chosen * factor}) {
    for (int step = -kSteps; step <= kSteps; ++step) {
      value = around * std::pow(5.0, static_cast<double>(step) / kSteps);
      if (!(value >= parameter.minimum && value <= parameter.maximum)) continue;
      const double left = misfit(effect, without, variances, input);
      if (left < least) {
        least = left;
        best = value;
      }
    }
  }
  value = best;
}

// What the model lists without coefficients was known to be there: it gets them, and is no finding.
void take_listed(Trial& trial, core::Axis axis, const Candidate& candidate,
                 const NamedEffect& found) {
  const auto waiting = std::find_if(
      trial.repaired.effects.begin(), trial.repaired.effects.end(), [&](const EffectSpec& spec) {
        return spec.axis == axis && spec.kind == found.name && spec.formula == found.formula &&
               spec.parameters.empty();
      });
  core::require(waiting != trial.repaired.effects.end(), "what is listed waits in the model");
  give_coefficients(*waiting, candidate, found, trial.recalibrated);
}

// A name that was chosen in the light of one state of the search may look worse in another one, or
// once a noise is split into two readings. Then it can't be distinguished from the names that look
// better: all of them are as probable.
void level(NamedEffect& effect) {
  double sum = effect.probability;
  double count = 1.0;
  for (const Alternative& other : effect.alternatives) {
    if (other.probability <= effect.probability) continue;
    sum += other.probability;
    count += 1.0;
  }
  for (Alternative& other : effect.alternatives) {
    if (other.probability > effect.probability) other.probability = sum / count;
  }
  effect.probability = sum / count;
}

// Each alternative's shape as it looks best beside the known columns alone, its amplitudes fitted
// in place of the effect beside which it stands.
void fit_alternatives(NamedEffect& effect, std::size_t place, const SearchReport& report,
                      const SearchProblem& problem, const Lineup& lineup,
                      const SearchOptions& options) {
  std::vector<ChosenShape> chosen;
  for (const FoundEffect& found : report.effects) chosen.push_back({found.group, found.shape});
  if (report.unknown) chosen.push_back({report.unknown->group, report.unknown->shape});
  for (Alternative& other : effect.alternatives) {
    const auto group = std::find_if(
        report.groups.begin(), report.groups.end(),
        [&](const GroupFinding& finding) { return lineup.name_of(finding.group) == other.name; });
    if (group == report.groups.end() || group->shape.empty()) continue;
    chosen[place] = {group->group, group->shape};
    const std::optional<JointFit> joint = fit_jointly(problem, chosen, options);
    if (!joint) continue;
    NamedEffect fitted = lineup.fitted_as(joint->effects[place]);
    other.inputs = std::move(fitted.inputs);
    other.parameters = std::move(fitted.parameters);
  }
}

double evidence_of(const SearchReport& report) {
  double sum = report.unknown ? report.unknown->log_evidence : 0.0;
  for (const FoundEffect& effect : report.effects) sum += effect.log_evidence;
  return sum;
}

std::vector<double> sum(std::vector<double> a, std::span<const double> b) {
  for (std::size_t i = 0; i < a.size(); ++i) a[i] += b[i];
  return a;
}

// Beside noise that the model lacks an effect explains what that leaves. What both explain of the
// record is what the effects do beside the noise that is listed, and what the noise does beside
// them.
double evidence_beside_listed_noise(const SearchReport& report, const SearchProblem& searched,
                                    std::size_t listed, const SearchOptions& options) {
  if (searched.noise.known.size() == listed) return evidence_of(report);
  SearchProblem problem = searched;
  problem.noise.known.resize(listed);
  std::erase_if(problem.groups, [&](const CandidateGroup& group) {
    const bool is_unknown = report.unknown && report.unknown->group == group.id;
    return !is_unknown &&
           std::none_of(report.effects.begin(), report.effects.end(),
                        [&](const FoundEffect& found) { return found.group == group.id; });
  });
  return problem.groups.empty() ? 0.0 : evidence_of(find_missing(problem, options));
}

double evidence_of(const NoiseFindings& noise) {
  double sum = 0.0;
  for (const NamedEffect& effect : noise.effects) sum += effect.log_evidence;
  return sum;
}

// An unknown dependence on an input, described by a spline, leaves a remainder that effects of the
// same input seem to explain: with an unknown of their family none of them is named.
SearchReport search_without_family_of_unknown(SearchProblem& problem, const SearchOptions& options,
                                              ColumnMemory* memory) {
  SearchReport report = find_missing(problem, options, memory);
  if (!report.unknown || report.effects.empty()) return report;
  const twin::InputFamily of_unknown = problem.group(report.unknown->group).family;
  const auto named_there = std::count_if(
      report.effects.begin(), report.effects.end(),
      [&](const FoundEffect& effect) { return problem.group(effect.group).family == of_unknown; });
  if (named_there == 0) return report;
  std::erase_if(problem.groups, [&](const CandidateGroup& group) {
    return group.kind == CandidateKind::kNamed && group.family == of_unknown;
  });
  SearchReport again = find_missing(problem, options, memory);
  again.groups = std::move(report.groups);
  return again;
}

// Noise that is missing: beside what was found, or in the place of some of it or of all, where that
// explains more. Effects give way to noise one after the other, the one first for which that costs
// least.
NoiseFindings missing_noise(const SearchReport& report, const SearchProblem& problem,
                            const TrialInput& input, Trial& trial) {
  const twin::Model& model = trial.repaired;
  std::vector<double> series = remainder_of(report, problem);
  NoiseFindings best = noise_of(series, input, problem, model);
  if (input.slow_noise == SlowNoise::kAsStated) return best;
  double kept = evidence_of(report);
  double most = kept + evidence_of(best);
  std::vector<FoundEffect> left = report.effects;
  if (report.unknown) left.push_back(*report.unknown);
  const auto compete = [&](NoiseFindings rival, double evidence) {
    if (evidence <= most) return;
    most = evidence;
    best = std::move(rival);
    trial.noise_could_be_effects = true;
  };
  while (left.size() > 1) {
    std::size_t first = 0;
    double evidence = -std::numeric_limits<double>::infinity();
    NoiseFindings noise;
    for (std::size_t e = 0; e < left.size(); ++e) {
      NoiseFindings rival = noise_of(sum(series, left[e].waveform), input, problem, model);
      const double sum_of_all = kept - left[e].log_evidence + evidence_of(rival);
      if (sum_of_all <= evidence) continue;
      evidence = sum_of_all;
      noise = std::move(rival);
      first = e;
    }
    kept -= left[first].log_evidence;
    series = sum(series, left[first].waveform);
    left.erase(left.begin() + static_cast<std::ptrdiff_t>(first));
    compete(std::move(noise), evidence);
  }
  if (!left.empty()) {
    NoiseFindings alone = noise_of(problem.series, input, problem, model);
    const double evidence = evidence_of(alone);
    compete(std::move(alone), evidence);
  }
  return best;
}

// A missing kind of noise looks like missing effects, and the other way round. First the model's
// own kinds of noise only: flexible noise would absorb effects. Where a kind is missing, the search
// is made again with it, among candidates lined up with it: noise that was not known of hides the
// peaks of what oscillates.
SearchReport search_beside_noise(SearchProblem& problem, Lineup& lineup, const TrialInput& input,
                                 Trial& trial) {
  const SearchOptions options = search_options(input.options);
  const std::size_t listed = problem.noise.known.size();
  if (listed == 0) return search_without_family_of_unknown(problem, options, input.memory);
  problem.noise.unlisted = UnlistedNoise::kExcluded;
  SearchReport report = search_without_family_of_unknown(problem, options, input.memory);
  if (report.outcome == SearchOutcome::kRefused) return report;
  const NoiseFindings noise = missing_noise(report, problem, input, trial);
  if (noise.effects.empty()) return report;
  const double share = valid_share(input.valid);
  for (std::size_t t = listed; t < noise.terms.size(); ++t) {
    const double seen = noise.squares[t] * seen_share(noise.terms[t].kind, share);
    problem.noise.known.push_back({noise.terms[t], seen, kModelNoiseSigma});
  }
  std::vector<NotTestable> as_before;
  lineup = line_up(trial.repaired, input, problem, std::move(lineup.generic), as_before);
  problem.groups = lineup.groups(input.series, input.playback);
  return search_without_family_of_unknown(problem, options, input.memory);
}

bool has_two_levels(const Trial& trial) {
  return std::any_of(trial.effects.begin(), trial.effects.end(), [](const NamedEffect& effect) {
    const twin::EffectDefinition* definition = twin::find_effect(effect.name);
    return definition != nullptr && definition->spectrum.law == twin::NoiseLaw::kTwoLevel;
  });
}

Trial repaired_once(const TrialInput& input) {
  Trial trial{.repaired = input.model};
  tell_untestable(trial, input);
  const auto residual = difference(measured_drift(input.series, input.axis),
                                   input.playback.drift(trial.repaired, input.axis), input.valid);
  const auto known = known_parameters(trial.repaired, input.axis, input.playback);
  SearchProblem problem = problem_of(residual, known, trial.repaired, input);
  const auto channels = moving_inputs(input.series, input.axis);
  Lineup lineup = line_up(trial.repaired, input, problem,
                          generic_functions(channels, input.series.interval_s), trial.not_testable);
  problem.groups = lineup.groups(input.series, input.playback);

  const std::size_t listed_noise = problem.noise.known.size();
  SearchReport report = search_beside_noise(problem, lineup, input, trial);
  if (report.outcome == SearchOutcome::kRefused) {
    trial.refusal = report.reason;
    return trial;
  }
  if (!report.effects.empty() || report.unknown)
    free_calibrated(report, known, trial.repaired, input);
  refit_amplitudes(report, problem, search_options(input.options));
  take_groups(trial, report, lineup);
  const auto remainder = remainder_of(report, problem);
  for (const FoundEffect& found : report.effects) {
    NamedEffect effect = lineup.effect_of(found);
    effect.share_of_gap = found.rms * found.rms;
    const std::vector<double> without = sum(remainder, found.waveform);
    const Candidate& candidate = *lineup.named_by(found.group);
    fit_size(effect, candidate, found.amplitudes.front(), without, report, input);
    const auto place = static_cast<std::size_t>(&found - report.effects.data());
    fit_alternatives(effect, place, report, problem, lineup, search_options(input.options));
    if (candidate.is_listed) {
      take_listed(trial, input.axis, candidate, effect);
    } else if (candidate.definition->search.happens_once) {
      trial.events.push_back(std::move(effect));
    } else {
      trial.effects.push_back(std::move(effect));
    }
  }
  if (report.unknown) {
    const GenericFunction& function = *lineup.generic_by(report.unknown->group);
    trial.unknown = unknown_effect(*report.unknown, function, channels);
  }
  const auto changes = recalibrate(trial.repaired, known, report.corrections);
  trial.recalibrated.insert(trial.recalibrated.end(), changes.begin(), changes.end());
  add_to_model(trial, input);
  take_noise(trial, input, noise_of(remainder, input, problem, trial.repaired));
  trial.noise_could_be_effects |= inflated_noise(trial.recalibrated) != nullptr;
  take_growing_noise(trial, remainder, input, search_options(input.options));
  trial.log_evidence =
      evidence_beside_listed_noise(report, problem, listed_noise, search_options(input.options));
  for (const NamedEffect& effect : trial.effects)
    trial.log_evidence += is_noise(effect.name) ? effect.log_evidence : 0.0;
  recalibrate_bias(trial, input);
  tell_unfitted(trial, input);
  for (NamedEffect& effect : trial.effects) level(effect);
  for (NamedEffect& event : trial.events) level(event);
  return trial;
}

}  // namespace

// A step beside a noise of two levels is one of its switches.
Trial repair(const TrialInput& input) {
  Trial trial = repaired_once(input);
  if (trial.events.empty() || !has_two_levels(trial)) return trial;
  std::vector<std::string> refuted(input.refuted.begin(), input.refuted.end());
  for (const NamedEffect& event : trial.events) refuted.push_back(event.name);
  TrialInput without_steps = input;
  without_steps.refuted = refuted;
  return repaired_once(without_steps);
}

}  // namespace zerodrift::diagnosis
