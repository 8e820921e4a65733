// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/formula_search.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "common/core/units.h"
#include "common/diagnosis/candidates.h"
#include "common/diagnosis/find_missing.h"
#include "common/diagnosis/formula_terms.h"
#include "common/diagnosis/generic_functions.h"
#include "common/diagnosis/held_out.h"
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

// A term that is linear in what it reads has its centre from nowhere: it is the bias'. Over what is
// fitted its mean is 0, so that the bias stays what it was.
Term beside_the_bias(Term term, std::span<const Operand> operands, const TrialInput& input) {
  Factor& factor = term.factors.front();
  const bool is_linear =
      factor.form == Form::kPlain || factor.form == Form::kLag || factor.form == Form::kPlay;
  if (term.factors.size() != 1 || !is_linear || operands[factor.operand].has_zero) return term;
  factor.centre = 0.0;
  const WrittenTerm text = written(term, operands);
  const twin::DefinitionPtr definition = definition_of(text, input.axis);
  twin::EffectContext context =
      default_context(*definition, input.axis, input.playback.interval_s());
  for (const auto& [name, value] : text.shapes) context.parameters[name] = value;
  const auto amplitudes = names_of(*definition, twin::ParameterRole::kAmplitude);
  const auto added = column_of(input.playback, *definition, context, amplitudes.front());
  factor.centre = core::deg_h_from_radps(mean_of_valid(added, input.valid));
  return term;
}

// Of a curve: what a smooth function, one with a bend or two, and one of a bump here and there
// need.
constexpr std::array<std::size_t, 3> kCurveParameters{5, 11, 22};

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

  [[nodiscard]] std::optional<Trial> run(Vocabulary vocabulary) {
    if (operands_.empty() || problem_.reason_to_refuse(options_.least_valid_share))
      return std::nullopt;
    lineup_.generic = generic_functions(channels_, input_.series.interval_s);
    SearchReport report = vocabulary == Vocabulary::kTerms ? search_terms() : search_curves();
    if (report.effects.empty()) return std::nullopt;
    return trial_of(report, vocabulary);
  }

 private:
  [[nodiscard]] SearchReport search_terms() {
    SearchReport report;
    const std::optional<JointFit> noise = fit_noise_beside(problem_, options_);
    if (!noise) return report;
    TermScreen screen(question_of(*noise), operands_);
    const auto catalogue = catalogue_on(screen.playback(), input_);
    for (int round = 0; round < kRounds; ++round) {
      if (!add_leaders(screen, catalogue)) break;
      report = search();
      if (report.outcome != SearchOutcome::kUnknown) break;
      for (const FoundEffect& found : report.effects) screen.take_off(terms_.at(place_of(found)));
      if (report.effects.empty()) screen.take_off(terms_.front());
    }
    return report;
  }

  [[nodiscard]] SearchReport search_curves() {
    SearchReport report = search();
    for (int round = 0; round < kRounds && report.unknown; ++round) {
      if (!add_curves(lineup_.generic_by(report.unknown->group)->depends_on)) break;
      report = search();
    }
    return report;
  }

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
      const Term term = beside_the_bias(leaders[i].term, operands_, input_);
      const bool is_new = std::find(terms_.begin(), terms_.end(), term) == terms_.end();
      if (said[i] > kMeansTheSame || !is_new) continue;
      std::vector<std::string> channels;
      for (const Factor& factor : term.factors)
        add_new(channels, operands_[factor.operand].channels);
      add({written(term, operands_)}, std::move(channels), log_prior_of(term, operands_));
      terms_.push_back(term);
      any = true;
    }
    return any;
  }

  // Over each of these inputs, times the other one. Whether there is any that is new.
  bool add_curves(const std::vector<std::string>& depends_on) {
    const bool is_new =
        std::none_of(reads_.begin(), reads_.end(), [&](const std::vector<std::string>& read) {
          return std::is_permutation(read.begin(), read.end(), depends_on.begin(),
                                     depends_on.end());
        });
    if (!is_new) return false;
    std::vector<std::size_t> inputs;
    for (const std::string& name : depends_on) {
      const auto found =
          std::find_if(operands_.begin(), operands_.end(), [&](const Operand& operand) {
            return operand.channels == std::vector<std::string>{name};
          });
      if (found == operands_.end()) return false;
      inputs.push_back(static_cast<std::size_t>(found - operands_.begin()));
    }
    const auto choices =
        std::pow(static_cast<double>(operands_.size()), static_cast<double>(inputs.size())) *
        static_cast<double>(kCurveParameters.size() * (1 + lags_looked_at_s().size()));
    for (std::size_t i = 0; i < inputs.size(); ++i) {
      Curve curve{.over = inputs[i]};
      if (inputs.size() == 2) curve.by = inputs[1 - i];
      for (const std::size_t count : kCurveParameters) {
        curve.parameters = count;
        curve.lag_s = 0.0;
        add({written(curve, operands_)}, depends_on, -std::log(choices));
        std::vector<WrittenTerm> lagged;
        for (const double tau_s : lags_looked_at_s()) {
          curve.lag_s = tau_s;
          lagged.push_back(written(curve, operands_));
        }
        add(lagged, depends_on, -std::log(choices));
      }
    }
    return true;
  }

  static void add_new(std::vector<std::string>& channels, const std::vector<std::string>& others) {
    for (const std::string& channel : others) {
      if (std::find(channels.begin(), channels.end(), channel) == channels.end())
        channels.push_back(channel);
    }
  }

  // One formula with each of these values.
  void add(const std::vector<WrittenTerm>& texts, std::vector<std::string> channels,
           double log_prior) {
    Candidate candidate{.definition = definition_of(texts.front(), input_.axis),
                        .axis = input_.axis};
    candidate.amplitudes = names_of(*candidate.definition, twin::ParameterRole::kAmplitude);
    for (const WrittenTerm& text : texts) {
      candidate.variants.push_back(
          {.inputs = candidate.definition->inputs, .shapes = text.shapes, .log_prior = log_prior});
    }
    lineup_.add(std::move(candidate));
    reads_.push_back(std::move(channels));
  }

  // Each formula pays for the grammar in place of a group among groups.
  [[nodiscard]] SearchReport search() {
    problem_.groups = lineup_.groups(input_.series, input_.playback);
    for (CandidateGroup& group : problem_.groups) {
      if (group.kind == CandidateKind::kNamed)
        group.log_prior = std::log(static_cast<double>(problem_.groups.size()));
    }
    return find_missing(problem_, options_, input_.memory);
  }

  [[nodiscard]] std::size_t place_of(const FoundEffect& found) const {
    return static_cast<std::size_t>(lineup_.named_by(found.group) - lineup_.named.data());
  }

  [[nodiscard]] Trial trial_of(SearchReport& report, Vocabulary vocabulary) const {
    const std::optional<FoundEffect> rest = std::exchange(report.unknown, std::nullopt);
    free_calibrated(report, known_, input_.model, input_);
    refit_amplitudes(report, problem_, options_);
    Trial trial{.repaired = input_.model};
    std::vector<std::string> depends_on;
    std::vector<std::string> words;
    std::vector<double> waveform(residual_.size(), 0.0);
    for (const FoundEffect& found : report.effects) {
      trial.effects.push_back(lineup_.effect_of(found));
      trial.effects.back().share_of_gap = found.rms * found.rms;
      trial.log_evidence += found.log_evidence;
      for (std::size_t i = 0; i < waveform.size(); ++i) waveform[i] += found.waveform[i];
      const std::vector<std::string>& reads = reads_.at(place_of(found));
      words.push_back(vocabulary == Vocabulary::kTerms
                          ? trial.effects.back().formula
                          : dependence_in_words(reads, found.waveform, channels_));
      add_new(depends_on, reads);
    }
    trial.recalibrated = recalibrate(trial.repaired, known_, report.corrections);
    add_to_model(trial, input_);
    const std::vector<NamedEffect> formulas = trial.effects;
    take_noise(trial, input_,
               noise_of(remainder_of(report, problem_), input_, problem_, trial.repaired));
    for (const NamedEffect& effect : trial.effects)
      trial.log_evidence += is_noise(effect.name) ? effect.log_evidence : 0.0;
    keep_mean(trial, input_);
    recalibrate_bias(trial, input_);
    std::string description = joined(words);
    if (rest) {
      description +=
          ", and a rest that depends on " + joined(lineup_.generic_by(rest->group)->depends_on);
    }
    trial.unknown = unknown_as_formulas(std::move(description), formulas, std::move(depends_on),
                                        waveform, channels_);
    return trial;
  }

  const TrialInput& input_;
  SearchOptions options_;
  std::vector<double> residual_;
  std::vector<KnownParameter> known_;
  SearchProblem problem_;
  std::vector<InputChannel> channels_;
  std::vector<Operand> operands_;
  Lineup lineup_;
  std::vector<std::vector<std::string>> reads_;  // channels of each of the lineup's candidates
  std::vector<Term> terms_;                      // the same, where terms are searched
};

}  // namespace

std::optional<Trial> explain_by_formula(const TrialInput& input, Vocabulary vocabulary) {
  return FormulaSearch(input).run(vocabulary);
}

}  // namespace zerodrift::diagnosis
