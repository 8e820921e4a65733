// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/calibration.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "common/diagnosis/candidates.h"
#include "common/diagnosis/joint_fit.h"
#include "common/diagnosis/known_effects.h"
#include "common/diagnosis/lineup.h"
#include "common/diagnosis/listed_effects.h"
#include "common/diagnosis/noise_and_bias.h"
#include "common/diagnosis/search_board.h"
#include "common/twin/effect_catalogue.h"

namespace zerodrift::diagnosis {

using twin::EffectDefinition;
using twin::EffectSpec;
using twin::ParameterRole;

namespace {

constexpr double kOddsNats = 2.3;  // ten to one
constexpr int kRounds = 4;
constexpr std::size_t kNone = static_cast<std::size_t>(-1);

double cost_of_freedom(const SearchOptions& options) {
  return 0.5 * std::log(static_cast<double>(options.single_coefficients));
}

// One listed effect in the fit: which variant of its group, or kNone.
using State = std::vector<std::size_t>;

struct Ending {
  State state;
  double score = -std::numeric_limits<double>::infinity();
};

// Effects with their amplitudes, nothing named: all groups of the problem are in it unless the
// record shows too little of them.
class ListedFit {
 public:
  ListedFit(const SearchProblem& problem, const SearchOptions& options)
      : problem_(problem), options_(options), board_(problem, options) {
    squares_ = board_.fit(board_.known()).squares;
  }

  [[nodiscard]] bool is_possible() const { return board_.series_power() > 0.0; }

  // Nothing where no noise that the fit may have explains what is left: then no fit is the best.
  [[nodiscard]] std::optional<Ending> run() {
    Ending best;
    for (const State& start : starts()) {
      Ending ending{settled(start)};
      ending.score = score(base_of(ending.state));
      if (ending.score > best.score) best = std::move(ending);
    }
    if (!std::isfinite(best.score)) return std::nullopt;
    sharpen(best.state);
    drop_without_evidence(best.state);
    best.score = score(base_of(best.state));
    return best;
  }

  // Of those in the fit; empty of the others.
  [[nodiscard]] std::vector<std::vector<double>> shapes(const State& state) const {
    std::vector<std::vector<double>> shapes(groups());
    for (std::size_t g = 0; g < groups(); ++g) {
      if (state[g] != kNone) shapes[g] = board_.variant(state[g]).definition.shape;
    }
    return shapes;
  }

  // Their joint fit, amplitudes without evidence 0; empty ones are those left out.
  [[nodiscard]] std::vector<std::optional<FittedEffect>> fitted(const State& state) {
    std::vector<std::optional<FittedEffect>> effects(groups());
    const Base base = with_evidence(problem_, options_, board_, base_of(state), squares_);
    const NoiseFit noise = board_.fit(base, squares_);
    const auto joint = fit_amplitudes(board_.rows(base), noise.spectrum);
    if (!joint) return effects;
    for (std::size_t g = 0; g < groups(); ++g) {
      if (state[g] == kNone) continue;
      const Base& places = places_of(state[g]);
      const bool any = std::any_of(places.begin(), places.end(), [&](std::size_t place) {
        return std::find(base.begin(), base.end(), place) != base.end();
      });
      if (any) effects[g] = fitted_effect(problem_, board_, state[g], places, base, *joint);
    }
    return effects;
  }

 private:
  [[nodiscard]] std::size_t groups() const { return board_.group_count(); }

  [[nodiscard]] bool is_testable(std::size_t variant) const {
    return board_.variant(variant).testability() == Testability::kTestable;
  }

  // The most evident one first; all effects with the same choice of inputs, of their first and of
  // their last shapes: where one reads a thermometer, others may well.
  [[nodiscard]] std::vector<State> starts() const {
    std::vector<State> all{State(groups(), kNone)};
    for (double choice = 0.0;; choice += 1.0) {
      bool any = false;
      for (const double at : {0.0, 1.0}) {
        State state(groups(), kNone);
        for (std::size_t g = 0; g < groups(); ++g) {
          if (board_.members(g).size() < 2) continue;
          std::vector<std::size_t> fitting;
          for (const std::size_t variant : board_.members(g)) {
            const bool fits = board_.variant(variant).definition.shape.front() == choice;
            if (is_testable(variant) && fits) fitting.push_back(variant);
          }
          if (fitting.empty()) continue;
          const auto last = static_cast<double>(fitting.size() - 1);
          state[g] = fitting[static_cast<std::size_t>(at * last)];
          any = any || state[g] != kNone;
        }
        if (any) all.push_back(std::move(state));
      }
      if (!any) return all;
    }
  }

  const Base& places_of(std::size_t variant) {
    const auto known = places_.find(variant);
    if (known != places_.end()) return known->second;
    return places_.emplace(variant, board_.activate(variant)).first->second;
  }

  [[nodiscard]] Base base_of(const State& state, std::size_t left_out = kNone) {
    Base base = board_.known();
    for (std::size_t g = 0; g < state.size(); ++g) {
      if (g == left_out || state[g] == kNone) continue;
      const Base& places = places_of(state[g]);
      base.insert(base.end(), places.begin(), places.end());
    }
    return board_.independent(base);
  }

  [[nodiscard]] Eigen::VectorXd spectrum_beside(const Base& base) {
    const NoiseFit noise = board_.fit(base, squares_);
    if (noise.status == NoiseFitStatus::kNoPower) return {};
    squares_ = noise.squares;
    return noise.spectrum;
  }

  struct Best {
    std::size_t variant = kNone;
    double log_evidence = -std::numeric_limits<double>::infinity();
  };

  [[nodiscard]] Best best_beside(std::size_t group, const Base& base,
                                 const Eigen::VectorXd& spectrum) const {
    Best best;
    std::vector<std::size_t> testable;
    for (const std::size_t variant : board_.members(group)) {
      if (is_testable(variant)) testable.push_back(variant);
    }
    const auto projected = board_.project(base, testable, spectrum);
    for (std::size_t i = 0; i < testable.size(); ++i) {
      const ColumnEvidence e = column_evidence(projected[i], options_.evidence, Detail::kEvidence);
      const double value = e.log_bayes_factor + board_.variant(testable[i]).definition.log_prior;
      if (e.rank > 0 && value > best.log_evidence) best = {testable[i], value};
    }
    return best;
  }

  // The most evident of those that have no place yet, until all have one.
  void place_all(State& state) {
    while (true) {
      const Base base = base_of(state);
      const Eigen::VectorXd spectrum = spectrum_beside(base);
      if (spectrum.size() == 0) return;
      std::size_t group = kNone;
      Best most;
      for (std::size_t g = 0; g < groups(); ++g) {
        if (state[g] != kNone) continue;
        const Best best = best_beside(g, base, spectrum);
        if (best.variant == kNone || !(best.log_evidence > most.log_evidence)) continue;
        most = best;
        group = g;
      }
      if (group == kNone) return;
      state[group] = most.variant;
    }
  }

  // Each group beside all others until none moves.
  [[nodiscard]] State settled(State state) {
    place_all(state);
    for (int round = 0; round < kRounds && move_each(state); ++round) {
    }
    return state;
  }

  // Each of those that have a place once more beside the others; whether one moved.
  bool move_each(State& state) {
    const Eigen::VectorXd spectrum = spectrum_beside(base_of(state));
    if (spectrum.size() == 0) return false;
    bool moved = false;
    for (std::size_t g = 0; g < groups(); ++g) {
      if (state[g] == kNone || board_.members(g).size() < 2) continue;
      const Best best = best_beside(g, base_of(state, g), spectrum);
      if (best.variant == kNone) continue;
      moved = moved || best.variant != state[g];
      state[g] = best.variant;
    }
    return moved;
  }

  // Shapes between the values listed.
  void sharpen(State& state) {
    constexpr int kTurns = 2;
    for (int turn = 0; turn < kTurns; ++turn) {
      for (std::size_t g = 0; g < groups(); ++g) {
        if (state[g] == kNone || problem_.groups[g].ranges.empty()) continue;
        const Base base = base_of(state, g);
        if (spectrum_beside(base_of(state)).size() == 0) return;
        board_.refine(state[g], base, squares_);
        places_.erase(state[g]);
      }
    }
  }

  void drop_without_evidence(State& state) {
    while (true) {
      std::size_t weakest = kNone;
      double least = kOddsNats;
      for (std::size_t g = 0; g < groups(); ++g) {
        if (state[g] == kNone) continue;
        std::vector<std::size_t> others;
        for (std::size_t other = 0; other < groups(); ++other) {
          if (other != g) others.push_back(other);
        }
        const Evaluation e = board_.evaluate(base_of(state, g), others, squares_);
        const double evidence = e.variants[state[g]].log_evidence;
        if (!(evidence < least)) continue;
        least = evidence;
        weakest = g;
      }
      if (weakest == kNone) return;
      state[weakest] = kNone;
      move_each(state);
    }
  }

  // Log likelihood at the best amplitudes and noise, less what each amplitude costs (Schwarz 1978).
  [[nodiscard]] double score(const Base& base) {
    const RowSystem rows = board_.rows(base);
    const NoiseFit noise = board_.fit(base, squares_);
    if (noise.status == NoiseFitStatus::kNoPower) return -std::numeric_limits<double>::infinity();
    const auto p = rows.columns();
    Eigen::MatrixXd a = weighted_gram(rows, noise.spectrum).topLeftCorner(p, p);
    a.diagonal() += rows.ridge;
    const Eigen::VectorXd scale = a.diagonal().cwiseSqrt();
    const Eigen::LLT<Eigen::MatrixXd> factor(scale.cwiseInverse().asDiagonal() * a *
                                             scale.cwiseInverse().asDiagonal());
    const double half_log_determinant =
        factor.matrixLLT().diagonal().array().log().sum() + scale.array().log().sum();
    return noise.log_likelihood + half_log_determinant -
           cost_of_freedom(options_) * static_cast<double>(p);
  }

  const SearchProblem& problem_;
  const SearchOptions& options_;
  Board board_;
  Eigen::VectorXd squares_;
  std::map<std::size_t, Base> places_;
};

bool waits_for_coefficients(const EffectSpec& spec, core::Axis axis) {
  const EffectDefinition* definition = twin::find_effect(spec.kind);
  return spec.axis == axis && spec.parameters.empty() && definition != nullptr &&
         definition->family == twin::Family::kDeterministic && !definition->search.is_constant;
}

std::vector<std::size_t> waiting_in(const twin::Model& model, core::Axis axis) {
  std::vector<std::size_t> waiting;
  for (std::size_t i = 0; i < model.effects.size(); ++i) {
    if (waits_for_coefficients(model.effects[i], axis)) waiting.push_back(i);
  }
  return waiting;
}

// The places of the shapes that are lags, among a group's: of an effect behind a thermometer, or of
// a coil's inside behind its faces.
std::vector<std::size_t> lags_of(const EffectDefinition& definition) {
  std::vector<std::size_t> places;
  std::size_t place = 1;  // the first is the choice of inputs
  for (const twin::ParameterDefinition& parameter : definition.parameters) {
    if (parameter.role != ParameterRole::kShape) continue;
    const bool is_lag = parameter.rule == twin::SearchRule::kLag ||
                        parameter.rule == twin::SearchRule::kBetweenFaces;
    if (is_lag) places.push_back(place);
    ++place;
  }
  return places;
}

void hold_lags(CandidateGroup& group, const std::vector<std::size_t>& lags) {
  for (const std::size_t place : lags) {
    std::erase_if(group.variants,
                  [place](const CandidateVariant& variant) { return variant.shape[place] != 0.0; });
    group.ranges[place] = {};
  }
}

// Between the values listed, which are some factor of three apart; what isn't refined stays as
// listed.
void widen_lags(CandidateGroup& group, const std::vector<std::size_t>& lags, double duration_s) {
  constexpr double kShortestS = 10.0;
  constexpr double kFactor = 3.3;
  for (const std::size_t place : lags) {
    if (group.ranges[place].scale == ShapeScale::kFixed) continue;
    group.ranges[place] = {ShapeScale::kLogarithmic, kShortestS, duration_s / 4.0, kFactor};
  }
}

// As much for each lag that isn't 0 as for an amplitude.
double cost_of_lags(const std::vector<std::vector<double>>& shapes, const Lineup& lineup,
                    const SearchOptions& options) {
  double count = 0.0;
  for (std::size_t g = 0; g < shapes.size(); ++g) {
    if (shapes[g].empty()) continue;
    for (const std::size_t place : lags_of(*lineup.named[g].definition))
      count += shapes[g][place] != 0.0 ? 1.0 : 0.0;
  }
  return count * cost_of_freedom(options);
}

// Coefficients of noise that the model as given hasn't.
twin::Model without_new_noise(twin::Model model, const twin::Model& given) {
  for (std::size_t i = 0; i < given.effects.size(); ++i) {
    const auto* definition = twin::find_effect(given.effects[i].kind);
    if (definition != nullptr && definition->family == twin::Family::kStochastic)
      model.effects[i] = given.effects[i];
  }
  return model;
}

// What was found missing, at its shapes: any amplitude.
std::vector<KnownParameter> free_columns_of(std::span<const NamedEffect> found,
                                            const TrialInput& input) {
  twin::Model model;
  for (const NamedEffect& effect : found) model.effects.push_back(spec_of(effect, input.axis));
  auto known = known_parameters(model, input.axis, input.playback);
  std::erase_if(known, [](const KnownParameter& parameter) { return !parameter.is_amplitude; });
  for (KnownParameter& parameter : known)
    parameter.column.prior_sd = std::numeric_limits<double>::infinity();
  return known;
}

void finish(Calibration& calibration, const TrialInput& input) {
  Trial& trial = calibration.trial;
  const auto left = difference(measured_drift(input.series, input.axis),
                               input.playback.drift(trial.repaired, input.axis), input.valid);
  const SearchProblem problem = problem_of(
      left, known_parameters(trial.repaired, input.axis, input.playback), trial.repaired, input);
  NoiseFindings noise = noise_of(left, input, problem, trial.repaired);
  noise.effects.clear();  // a kind that is missing is not for a calibration to tell
  take_noise(trial, input, noise);
  recalibrate_bias(trial, input);
  calibration.drift_alone = without_new_noise(trial.repaired, input.model);
}

}  // namespace

bool lists_without_coefficients(const twin::Model& model, core::Axis axis) {
  return !waiting_in(model, axis).empty();
}

Calibration calibrate(const TrialInput& input, Lags lags, std::span<const NamedEffect> beside) {
  Calibration calibration{
      .trial = {.repaired = input.model}, .drift_alone = input.model, .lags = lags};
  const std::vector<std::size_t> waiting = waiting_in(input.model, input.axis);
  Lineup lineup;
  std::vector<std::size_t> specs;  // one a candidate
  for (const std::size_t i : waiting) {
    const std::string label = label_of(input.model.effects[i]);
    if (std::find(input.refuted.begin(), input.refuted.end(), label) != input.refuted.end())
      continue;
    auto candidate =
        listed_candidate(input.model.effects[i], input.series, input.playback, input.model);
    if (!candidate) continue;
    lineup.add(std::move(*candidate));
    specs.push_back(i);
  }
  if (specs.empty()) return calibration;
  const auto drift = input.playback.drift(input.model, input.axis);
  const auto residual = difference(measured_drift(input.series, input.axis), drift, input.valid);
  auto known = known_parameters(input.model, input.axis, input.playback);
  for (KnownParameter& found : free_columns_of(beside, input)) known.push_back(std::move(found));
  const double duration_s = input.series.interval_s * static_cast<double>(input.series.size);
  SearchProblem problem = problem_of(residual, known, input.model, input);
  // As if nothing wandered but what the model states.
  if (input.slow_noise == SlowNoise::kAsStated && !problem.noise.known.empty())
    problem.noise.unlisted = UnlistedNoise::kExcluded;
  problem.groups = lineup.groups(input.series, input.playback);
  for (std::size_t g = 0; g < problem.groups.size(); ++g) {
    const auto places = lags_of(*lineup.named[g].definition);
    calibration.has_free_lags = calibration.has_free_lags || !places.empty();
    if (lags == Lags::kAtDefault) {
      hold_lags(problem.groups[g], places);
    } else {
      widen_lags(problem.groups[g], places, duration_s);
    }
  }
  const SearchOptions options = search_options(input.options);
  if (problem.reason_to_refuse(options.least_valid_share)) return calibration;
  ListedFit fit(problem, options);
  if (!fit.is_possible()) return calibration;
  const std::optional<Ending> ending = fit.run();
  if (!ending) return calibration;
  calibration.score = ending->score - cost_of_lags(fit.shapes(ending->state), lineup, options);
  const auto fitted = fit.fitted(ending->state);
  for (std::size_t g = 0; g < fitted.size(); ++g) {
    if (!fitted[g]) continue;
    calibration.fitted.push_back(specs[g]);
    give_coefficients(calibration.trial.repaired.effects[specs[g]], lineup.named[g],
                      lineup.effect_of({*fitted[g]}), calibration.trial.recalibrated);
  }
  finish(calibration, input);
  return calibration;
}

bool same_shapes(const Calibration& a, const Calibration& b) {
  constexpr double kAlike = 0.1;
  if (a.fitted != b.fitted) return false;
  for (const std::size_t i : a.fitted) {
    const EffectSpec& one = a.drift_alone.effects[i];
    const EffectSpec& other = b.drift_alone.effects[i];
    if (one.inputs != other.inputs) return false;
    const twin::DefinitionPtr definition = twin::definition_of(one);
    for (const twin::ParameterDefinition& parameter : definition->parameters) {
      if (parameter.role != ParameterRole::kShape) continue;
      const double x = one.parameters.at(parameter.name);
      const double y = other.parameters.at(parameter.name);
      if (std::abs(x - y) > kAlike * std::max(std::abs(x), std::abs(y))) return false;
    }
  }
  return true;
}

}  // namespace zerodrift::diagnosis
