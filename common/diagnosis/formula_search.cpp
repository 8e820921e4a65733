// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/formula_search.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/diagnosis/candidates.h"
#include "common/diagnosis/find_missing.h"
#include "common/diagnosis/formula_terms.h"
#include "common/diagnosis/generic_functions.h"
#include "common/diagnosis/joint_fit.h"
#include "common/diagnosis/known_effects.h"
#include "common/diagnosis/lineup.h"
#include "common/diagnosis/noise_and_bias.h"
#include "common/diagnosis/noise_weight.h"
#include "common/diagnosis/rounded_text.h"
#include "common/diagnosis/search_result.h"
#include "common/diagnosis/term_screen.h"
#include "common/diagnosis/unknown_effect.h"

namespace zerodrift::diagnosis {
namespace {

constexpr int kRounds = 2;
constexpr std::size_t kLeaders = 8;
// A formula of which an effect of the catalogue explains more says the same as that effect.
constexpr double kMeansTheSame = 0.98;

// Every waveform of the catalogue that the record can test, as columns on the grid of the screen.
std::vector<std::vector<std::vector<double>>> catalogue_on(const Playback& coarse,
                                                           const TrialInput& input) {
  std::vector<std::vector<std::vector<double>>> all;
  const Candidates found = candidates(input.series, coarse, twin::Model{}, input.axis, {});
  for (const Candidate& candidate : found.testable) {
    for (const Variant& variant : candidate.variants) {
      all.push_back(columns_of(coarse, *candidate.definition,
                               context_of(candidate, variant, coarse.interval_s())));
    }
  }
  return all;
}

class FormulaSearch {
 public:
  explicit FormulaSearch(const TrialInput& input)
      : input_(input),
        options_(search_options(input.options)),
        residual_(difference(measured_drift(input.series, input.axis),
                             input.playback.drift(input.model, input.axis), input.valid)),
        known_(known_parameters(input.model, input.axis, input.playback)),
        problem_(problem_of(residual_, known_, input.model, input)),
        channels_(moving_inputs(input.series, input.axis)),
        operands_(operands_of(input.playback, input.valid, input.axis)) {
    if (!problem_.noise.known.empty()) problem_.noise.unlisted = UnlistedNoise::kExcluded;
  }

  [[nodiscard]] std::optional<Trial> run() {
    if (operands_.empty() || problem_.reason_to_refuse(options_.least_valid_share))
      return std::nullopt;
    const std::optional<JointFit> noise = fit_noise_beside(problem_, options_);
    if (!noise) return std::nullopt;
    TermScreen screen(question_of(*noise), operands_);
    const auto catalogue = catalogue_on(screen.playback(), input_);
    lineup_.generic = generic_functions(channels_, input_.series.interval_s);
    SearchReport report;
    for (int round = 0; round < kRounds; ++round) {
      if (!add_leaders(screen, catalogue)) break;
      report = search();
      if (report.outcome != SearchOutcome::kUnknown) break;
      for (const FoundEffect& found : report.effects) screen.take_off(term_of(found));
      if (report.effects.empty()) screen.take_off(terms_.front());
    }
    if (report.effects.empty()) return std::nullopt;
    return trial_of(report);
  }

 private:
  [[nodiscard]] ScreenQuestion question_of(const JointFit& noise) const {
    ScreenQuestion question{.series = residual_,
                            .valid = input_.valid,
                            .playback = input_.playback,
                            .axis = input_.axis,
                            .noise_terms = noise.noise_terms,
                            .noise_squares = noise.noise_squares};
    for (const KnownParameter& parameter : known_)
      question.known.push_back(parameter.column.values);
    return question;
  }

  // Whether there is any that is new and that the catalogue doesn't say.
  bool add_leaders(TermScreen& screen,
                   const std::vector<std::vector<std::vector<double>>>& catalogue) {
    bool any = false;
    const std::vector<ScreenedTerm> leaders = screen.best(kLeaders);
    const std::vector<double> said = screen.shares_explained_by(catalogue, leaders);
    for (std::size_t i = 0; i < leaders.size(); ++i) {
      const Term& term = leaders[i].term;
      const bool is_new = std::find(terms_.begin(), terms_.end(), term) == terms_.end();
      if (said[i] > kMeansTheSame || !is_new) continue;
      add(term);
      any = true;
    }
    return any;
  }

  void add(const Term& term) {
    const WrittenTerm text = written(term, operands_);
    Candidate candidate{.definition = definition_of(text, input_.axis), .axis = input_.axis};
    candidate.amplitudes = names_of(*candidate.definition, twin::ParameterRole::kAmplitude);
    candidate.variants = {{.inputs = candidate.definition->inputs,
                           .shapes = text.shapes,
                           .log_prior = log_prior_of(term, operands_)}};
    lineup_.add(std::move(candidate));
    terms_.push_back(term);
  }

  // Each formula pays for the grammar in place of a group among groups.
  [[nodiscard]] SearchReport search() {
    problem_.groups = lineup_.groups(input_.series, input_.playback);
    for (CandidateGroup& group : problem_.groups) {
      if (group.kind == CandidateKind::kNamed)
        group.log_prior = std::log(static_cast<double>(problem_.groups.size()));
    }
    return find_missing(problem_, options_);
  }

  [[nodiscard]] const Term& term_of(const FoundEffect& found) const {
    const Candidate* candidate = lineup_.named_by(found.group);
    return terms_.at(static_cast<std::size_t>(candidate - lineup_.named.data()));
  }

  [[nodiscard]] Trial trial_of(SearchReport& report) const {
    const std::optional<FoundEffect> rest = std::exchange(report.unknown, std::nullopt);
    free_calibrated(report, known_, input_.model, input_);
    refit_amplitudes(report, problem_, options_);
    Trial trial{.repaired = input_.model};
    std::vector<std::string> depends_on;
    std::vector<double> waveform(residual_.size(), 0.0);
    for (const FoundEffect& found : report.effects) {
      trial.effects.push_back(lineup_.effect_of(found));
      trial.effects.back().share_of_gap = found.rms * found.rms;
      trial.log_evidence += found.log_evidence;
      for (std::size_t i = 0; i < waveform.size(); ++i) waveform[i] += found.waveform[i];
      for (const Factor& factor : term_of(found).factors) {
        for (const std::string& channel : operands_[factor.operand].channels) {
          if (std::find(depends_on.begin(), depends_on.end(), channel) == depends_on.end())
            depends_on.push_back(channel);
        }
      }
    }
    trial.recalibrated = recalibrate(trial.repaired, known_, report.corrections);
    add_to_model(trial, input_);
    trial.noise_dct_variances = dct_variances(report.noise_terms, report.noise_squares,
                                              input_.series.size, input_.series.interval_s);
    recalibrate_bias(trial, input_);
    trial.unknown = unknown_as_formulas(trial.effects, std::move(depends_on), waveform, channels_);
    if (rest) {
      trial.unknown->description +=
          ", and a rest that depends on " + joined(lineup_.generic_by(rest->group)->depends_on);
    }
    return trial;
  }

  const TrialInput& input_;
  SearchOptions options_;
  std::vector<double> residual_;
  std::vector<KnownParameter> known_;
  SearchProblem problem_;
  std::vector<InputChannel> channels_;
  std::vector<Operand> operands_;
  std::vector<Term> terms_;  // as the lineup's candidates
  Lineup lineup_;
};

}  // namespace

std::optional<Trial> explain_by_formula(const TrialInput& input) {
  return FormulaSearch(input).run();
}

}  // namespace zerodrift::diagnosis
