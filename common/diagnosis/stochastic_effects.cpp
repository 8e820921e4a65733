// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/stochastic_effects.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "common/core/units.h"
#include "common/diagnosis/noise_of_model.h"
#include "common/diagnosis/posterior.h"
#include "common/diagnosis/search_board.h"
#include "common/diagnosis/two_levels.h"
#include "common/twin/effect_catalogue.h"

namespace zerodrift::diagnosis {

using twin::EffectSpec;

namespace {

// Relative sigma of a square that is held. It enters as 2 / sigma² degrees of freedom, which must
// be far more than a record has values.
constexpr double kHeld = 1e-4;

struct Hypothesis {
  double log_likelihood = 0.0;
  std::vector<NoiseTerm> terms{};
  std::vector<double> squares{};
};

class Likelihoods {
 public:
  Likelihoods(const NoiseQuestion& question, const SearchOptions& options)
      : Likelihoods(question.problem.interval_s, options.noise_fit,
                    Board(without_groups(question.problem), options)) {}

  [[nodiscard]] Hypothesis of(const std::vector<KnownNoise>& known) const {
    const NoiseDictionary dictionary = dictionary_of(known);
    const NoiseFit fit = fit_noise(rows_, dictionary, options_);
    return {fit.log_likelihood,
            dictionary.terms(),
            {fit.squares.data(), fit.squares.data() + fit.squares.size()}};
  }

  // Log likelihood of these squares.
  [[nodiscard]] double at(const std::vector<KnownNoise>& known,
                          const std::vector<double>& squares) const {
    const Eigen::Map<const Eigen::VectorXd> values(squares.data(),
                                                   static_cast<Eigen::Index>(squares.size()));
    return restricted_log_likelihood(rows_, dictionary_of(known), values);
  }

  // What holding the first `held` terms at their values costs, nats: the likelihood that the free
  // hypothesis has at the coefficients fitted under the constraint.
  [[nodiscard]] double cost_of_holding(const std::vector<KnownNoise>& free,
                                       const Hypothesis& free_fit, std::size_t held,
                                       double relative_sigma) const {
    std::vector<KnownNoise> constrained = free;
    constrained[held].relative_sigma = relative_sigma;
    const Hypothesis fit = of(constrained);
    return free_fit.log_likelihood - at(free, fit.squares);
  }

 private:
  Likelihoods(double interval_s, const NoiseFitOptions& options, const Board& board)
      : interval_s_(interval_s),
        options_(options),
        bands_(board.bands()),
        rows_(board.rows(board.known())) {}

  static SearchProblem without_groups(SearchProblem problem) {
    problem.groups.clear();
    return problem;
  }

  [[nodiscard]] NoiseDictionary dictionary_of(const std::vector<KnownNoise>& known) const {
    return {bands_, interval_s_, {known, UnlistedNoise::kExcluded}};
  }

  double interval_s_;
  const NoiseFitOptions& options_;
  SpectralBands bands_;
  RowSystem rows_;  // of the series and the known columns
};

// Variance of the valid samples; 0 where they stand still.
double variance_of(const SearchProblem& problem) {
  constexpr double kRounding = 1e-12;  // of the largest value
  double mean = 0.0, squares = 0.0, count = 0.0, largest = 0.0;
  for (std::size_t i = 0; i < problem.series.size(); ++i) {
    if (problem.valid[i] == 0) continue;
    count += 1.0;
    const double from_mean = problem.series[i] - mean;
    mean += from_mean / count;
    squares += from_mean * (problem.series[i] - mean);
    largest = std::max(largest, std::abs(problem.series[i]));
  }
  const double variance = count > 0.0 ? squares / count : 0.0;
  return std::sqrt(variance) > kRounding * largest ? variance : 0.0;
}

// Of a white noise with the series' own variance: where a free coefficient begins.
double typical_square(const NoiseQuestion& question, const NoiseTerm& term) {
  constexpr double kMiddleEigenvalue = 0.01;
  return 0.1 * variance_of(question.problem) /
         unit_spectrum(term, kMiddleEigenvalue, question.problem.interval_s);
}

std::vector<NoiseTerm> missing_terms(const std::vector<KnownNoise>& present,
                                     const NoiseQuestion& question) {
  const auto has = [&](NoiseKind kind) {
    return std::any_of(present.begin(), present.end(),
                       [kind](const KnownNoise& n) { return n.term.kind == kind; });
  };
  std::vector<NoiseTerm> missing;
  for (const NoiseTerm& term :
       usual_noise_terms(question.problem.series.size(), question.problem.interval_s)) {
    if (!has(term.kind)) missing.push_back(term);
  }
  return missing;
}

struct Addition {
  NoiseTerm term;
  Hypothesis hypothesis;
  double evidence = 0.0;  // nats, after what its freedom costs
};

// Probabilities of the kinds; Markov at its best correlation time.
std::vector<Addition> best_of_each_kind(std::vector<Addition> additions) {
  std::sort(additions.begin(), additions.end(),
            [](const Addition& a, const Addition& b) { return a.evidence > b.evidence; });
  std::vector<Addition> best;
  for (const Addition& addition : additions) {
    const bool seen = std::any_of(best.begin(), best.end(), [&](const Addition& b) {
      return b.term.kind == addition.term.kind;
    });
    if (!seen) best.push_back(addition);
  }
  return best;
}

NamedEffect named(const Addition& addition, const std::vector<Addition>& rivals, double share,
                  const SearchOptions& options) {
  NamedEffect effect;
  const twin::EffectDefinition& definition = noise_effect(addition.term.kind);
  effect.name = definition.kind;
  const double value = value_in_file(definition, addition.hypothesis.squares.back(), share);
  effect.parameters = definition.spectrum.parameters_of
                          ? definition.spectrum.parameters_of({value, addition.term.correlation_s})
                          : twin::Parameters{{definition.spectrum.scale, value}};
  effect.log_evidence = addition.evidence;
  std::vector<double> nats;
  for (const Addition& rival : rivals) nats.push_back(rival.evidence);
  const std::vector<double> probability = probabilities(nats, addition.evidence, options);
  const double enough = options.credible_mass * (1.0 - options.unlisted_share);
  double mass = 0.0;
  for (std::size_t r = 0; r < rivals.size(); ++r) {
    if (rivals[r].term.kind == addition.term.kind) {
      effect.probability = probability[r];
    } else if (mass < enough) {
      effect.alternatives.push_back({noise_effect(rivals[r].term.kind).kind, probability[r]});
    }
    mass += probability[r];
  }
  return effect;
}

// Whether a model file may say it.
bool is_within_limits(const std::string& kind, const twin::Parameters& parameters) {
  return !EffectSpec{.kind = kind, .parameters = parameters}.find_problem();
}

struct TwoLevels {
  SwitchingFit fit;
  double nats = 0.0;    // over a first-order noise of the same spectrum, priors included
  double dwells = 0.0;  // expected in the record

  [[nodiscard]] twin::Parameters parameters() const {
    return noise_effect(twin::NoiseLaw::kTwoLevel)
        .spectrum.parameters_of_levels(
            {core::deg_h_from_radps(fit.amplitude_radps), fit.up_s, fit.down_s});
  }
};

TwoLevels two_levels_like(const NoiseQuestion& question, const Addition& markov) {
  const SearchProblem& problem = question.problem;
  const double sigma_radps = std::sqrt(markov.hypothesis.squares.back());
  const double correlation_s = markov.term.correlation_s;
  const CourseBlocks blocks =
      course_blocks(problem.series, problem.valid, problem.interval_s, correlation_s);
  const SwitchingFit switching = fit_switching(blocks, sigma_radps, correlation_s);
  const WanderingFit wandering = fit_wandering(blocks, sigma_radps, correlation_s);
  const double duration_s = problem.interval_s * static_cast<double>(problem.series.size());
  const double dwells = std::max(1.0, 2.0 * duration_s / (switching.up_s + switching.down_s));
  constexpr double kPriorNats = -1.5;  // a Markov noise is the commoner one
  // Two levels have a parameter more.
  return {switching,
          kPriorNats + switching.log_likelihood - wandering.log_likelihood - 0.5 * std::log(dwells),
          dwells};
}

// Levels that hold for about the whole record may be one step of the bias as well.
void level_with_a_step(NamedEffect& effect, const TwoLevels& levels) {
  constexpr double kFewestDwells = 4.0;
  if (levels.dwells >= kFewestDwells) return;
  const auto all = twin::effect_catalogue();
  const auto step = std::find_if(all.begin(), all.end(), [](const twin::EffectDefinition& d) {
    return d.search.happens_once;
  });
  if (step == all.end()) return;
  effect.probability *= 0.5;
  effect.alternatives.insert(effect.alternatives.begin(), {step->kind, effect.probability});
}

// Turns a first-order noise into one of two levels where that is likelier.
void consider_two_levels(NamedEffect& effect, const NoiseQuestion& question,
                         const Addition& markov) {
  const twin::EffectDefinition& two_levels = noise_effect(twin::NoiseLaw::kTwoLevel);
  const TwoLevels levels = two_levels_like(question, markov);
  const double probability = 1.0 / (1.0 + std::exp(-levels.nats));
  if (probability <= 0.5) {
    if (probability > 0.05)
      effect.alternatives.insert(effect.alternatives.begin(),
                                 {two_levels.kind, probability * effect.probability});
    effect.probability *= 1.0 - probability;
    return;
  }
  if (probability < 0.95) {
    effect.alternatives.insert(effect.alternatives.begin(),
                               {effect.name, (1.0 - probability) * effect.probability});
  }
  effect.name = two_levels.kind;
  effect.probability *= probability;
  effect.parameters = levels.parameters();
  level_with_a_step(effect, levels);
}

std::vector<KnownNoise> free_noise(const std::vector<ListedNoise>& listed) {
  std::vector<KnownNoise> known;
  for (const ListedNoise& entry : listed) {
    known.push_back(entry.noise);
    known.back().relative_sigma = kAnyValue;
  }
  return known;
}

constexpr double kNatsToBeWrong = 7.0;
constexpr double kKinds = 5.0;  // of noise, any of which may be missing

// Of a coefficient, relative: from what the likelihood loses where its square is held off the best
// one by a tenth; NaN where it loses nothing.
double relative_error(const Likelihoods& likelihoods, const std::vector<KnownNoise>& free,
                      const Hypothesis& fit, std::size_t which) {
  constexpr double kOff = 1.1;
  std::vector<KnownNoise> known = free;
  known[which].square = kOff * fit.squares[which];
  const double lost = likelihoods.cost_of_holding(known, fit, which, kHeld);
  return lost > 0.0 ? (std::sqrt(kOff) - 1.0) / std::sqrt(2.0 * lost)
                    : std::numeric_limits<double>::quiet_NaN();
}

// The twin makes none of a noise listed without coefficients. One that the record has is reported
// as recalibrated from 0.
std::optional<Recalibration> fitted_from_nothing(const Likelihoods& likelihoods,
                                                 const std::vector<KnownNoise>& free,
                                                 const Hypothesis& fit, std::size_t which,
                                                 const twin::EffectDefinition& definition,
                                                 double share) {
  std::vector<KnownNoise> others = free;
  others.erase(others.begin() + static_cast<std::ptrdiff_t>(which));
  if (!(fit.squares[which] > 0.0)) return std::nullopt;
  if (!others.empty() &&
      fit.log_likelihood - likelihoods.of(others).log_likelihood < kNatsToBeWrong) {
    return std::nullopt;
  }
  const double to = value_in_file(definition, fit.squares[which], share);
  if (!is_within_limits(definition.kind, {{definition.spectrum.scale, to}})) return std::nullopt;
  return Recalibration{definition.kind, definition.spectrum.scale, 0.0, to,
                       to * relative_error(likelihoods, free, fit, which)};
}

// A coefficient of the model is wrong where the likelihood falls by more than the threshold when it
// is held at the model's value.
std::vector<Recalibration> wrong_coefficients(const NoiseQuestion& question,
                                              const Likelihoods& likelihoods,
                                              const std::vector<ListedNoise>& listed,
                                              const std::vector<KnownNoise>& extra,
                                              const Hypothesis& free) {
  const double share = valid_share(question.problem.valid);
  auto known = free_noise(listed);
  known.insert(known.end(), extra.begin(), extra.end());
  std::vector<Recalibration> wrong;
  for (std::size_t i = 0; i < listed.size(); ++i) {
    const EffectSpec& spec = question.model.effects[listed[i].effect];
    const twin::EffectDefinition& definition = *twin::find_effect(spec.kind);
    if (!has_one_coefficient(definition) || !(listed[i].noise.square > 0.0)) continue;
    if (spec.parameters.empty()) {
      if (auto found = fitted_from_nothing(likelihoods, known, free, i, definition, share))
        wrong.push_back(std::move(*found));
      continue;
    }
    const double lost = likelihoods.cost_of_holding(known, free, i, kHeld);
    if (lost < kNatsToBeWrong) continue;
    const double from = value_in_file(definition, listed[i].noise.square, share);
    const double to = value_in_file(definition, free.squares[i], share);
    if (!is_within_limits(spec.kind, {{definition.spectrum.scale, to}})) continue;
    wrong.push_back({spec.kind, definition.spectrum.scale, from, to,
                     std::abs(to - from) / std::sqrt(2.0 * lost)});
  }
  return wrong;
}

// Each kind that is missing beside those present, and what it gains over `base`.
std::vector<Addition> additions_to(const std::vector<KnownNoise>& present, const Hypothesis& base,
                                   const Likelihoods& likelihoods, const NoiseQuestion& question,
                                   const SearchOptions& options) {
  const double of_freedom = 0.5 * std::log(static_cast<double>(options.single_coefficients));
  const auto missing = missing_terms(present, question);
  const auto markovs = std::count_if(missing.begin(), missing.end(), [](const NoiseTerm& term) {
    return term.kind == NoiseKind::kMarkov;
  });
  std::vector<Addition> additions;
  for (const NoiseTerm& term : missing) {
    auto known = present;
    known.push_back({term, typical_square(question, term), kAnyValue});
    Hypothesis with = likelihoods.of(known);
    const double looked_at =
        term.kind == NoiseKind::kMarkov ? std::log(static_cast<double>(markovs)) : 0.0;
    const double evidence = with.log_likelihood - base.log_likelihood - of_freedom - looked_at;
    additions.push_back({term, std::move(with), evidence});
  }
  return additions;
}

// The same where the model's coefficients are as well known as its file says. Free ones take in
// what another kind explains, as a random walk does a telegraph; so a kind counts that explains the
// record better than any other values of the coefficients (`free`).
std::vector<Addition> additions_to_the_files(const std::vector<KnownNoise>& present,
                                             const Hypothesis& free, const Likelihoods& likelihoods,
                                             const NoiseQuestion& question,
                                             const SearchOptions& options) {
  std::vector<KnownNoise> known;
  const double share = valid_share(question.problem.valid);
  for (const ListedNoise& entry :
       listed_noise(question.model, question.axis, kModelNoiseSigma, share)) {
    if (entry.noise.square > 0.0) known.push_back(entry.noise);
  }
  if (known.empty()) return {};
  auto additions = additions_to(known, likelihoods.of(known), likelihoods, question, options);
  std::erase_if(additions, [&](const Addition& addition) {
    auto with = present;
    with.push_back({addition.term, addition.hypothesis.squares.back(), kAnyValue});
    return likelihoods.at(with, addition.hypothesis.squares) < free.log_likelihood;
  });
  return best_of_each_kind(std::move(additions));
}

bool waits(const EffectSpec& spec) {
  return spec.parameters.empty();
}

struct HiddenLevels {
  NamedEffect effect;
  Hypothesis hypothesis;
  KnownNoise noise;
};

// Slow noise that is listed without a coefficient takes in two levels between which something
// switches: their spectra differ in the slowest octaves alone. So what a first-order noise in its
// place would be is asked for levels, which have to win against all that wanders.
std::optional<HiddenLevels> levels_in_what_waits(const NoiseQuestion& question,
                                                 const Likelihoods& likelihoods,
                                                 const std::vector<ListedNoise>& listed,
                                                 const std::vector<KnownNoise>& present,
                                                 double threshold, const SearchOptions& options) {
  std::vector<KnownNoise> others;
  for (std::size_t i = 0; i < present.size(); ++i) {
    const bool may_hide = i < listed.size() && waits(question.model.effects[listed[i].effect]) &&
                          (present[i].term.kind == NoiseKind::kRandomWalk ||
                           present[i].term.kind == NoiseKind::kFlicker);
    if (!may_hide) others.push_back(present[i]);
  }
  if (others.size() == present.size() || others.empty()) return std::nullopt;
  auto additions = additions_to(others, likelihoods.of(others), likelihoods, question, options);
  std::erase_if(additions, [](const Addition& a) { return a.term.kind != NoiseKind::kMarkov; });
  const auto rivals = best_of_each_kind(std::move(additions));
  if (rivals.empty() || rivals.front().evidence < threshold) return std::nullopt;
  const Addition& markov = rivals.front();
  const TwoLevels levels = two_levels_like(question, markov);
  if (levels.nats < threshold) return std::nullopt;
  const std::array nats{levels.nats, 0.0};
  HiddenLevels found;
  found.effect.name = noise_effect(twin::NoiseLaw::kTwoLevel).kind;
  found.effect.parameters = levels.parameters();
  found.effect.log_evidence = levels.nats;
  found.effect.probability = probabilities(nats, levels.nats, options).front();
  level_with_a_step(found.effect, levels);
  found.noise = {markov.term, markov.hypothesis.squares.back(), kAnyValue};
  std::vector<KnownNoise> with = present;
  with.push_back(found.noise);
  found.hypothesis = likelihoods.of(with);
  return found;
}

}  // namespace

NoiseFindings examine_noise(const NoiseQuestion& question, const SearchOptions& options) {
  if (!(variance_of(question.problem) > 0.0)) return {};
  const Likelihoods likelihoods(question, options);
  const double share = valid_share(question.problem.valid);
  auto listed = listed_noise(question.model, question.axis, kAnyValue, share);
  std::erase_if(listed, [](const ListedNoise& l) { return !(l.noise.square > 0.0); });
  std::vector<KnownNoise> present = free_noise(listed);
  NoiseFindings findings;
  if (present.empty()) {  // something has to be there
    const NoiseTerm white{NoiseKind::kWhite, 0.0};
    present.push_back({white, typical_square(question, white), kAnyValue});
  }
  Hypothesis best = likelihoods.of(present);
  const double threshold = std::log(kKinds / question.false_alarm);
  bool trusts_file = false;
  while (findings.effects.size() < options.max_effects) {
    auto rivals = best_of_each_kind(additions_to(present, best, likelihoods, question, options));
    if (rivals.empty()) break;
    if (rivals.front().evidence < threshold && findings.effects.empty()) {
      rivals = additions_to_the_files(present, best, likelihoods, question, options);
      trusts_file = true;
    }
    if (rivals.empty() || rivals.front().evidence < threshold) break;
    NamedEffect effect = named(rivals.front(), rivals, share, options);
    if (rivals.front().term.kind == NoiseKind::kMarkov)
      consider_two_levels(effect, question, rivals.front());
    if (!is_within_limits(effect.name, effect.parameters)) break;
    findings.effects.push_back(std::move(effect));
    best = rivals.front().hypothesis;
    present.push_back({rivals.front().term, best.squares.back(), kAnyValue});
    if (trusts_file) break;
  }
  const bool has_levels_or_markov =
      std::any_of(present.begin(), present.end(),
                  [](const KnownNoise& n) { return n.term.kind == NoiseKind::kMarkov; });
  const bool took_from_file = trusts_file && !findings.effects.empty();
  if (!took_from_file && !has_levels_or_markov && findings.effects.size() < options.max_effects) {
    auto levels = levels_in_what_waits(question, likelihoods, listed, present, threshold, options);
    if (levels && is_within_limits(levels->effect.name, levels->effect.parameters)) {
      findings.effects.push_back(std::move(levels->effect));
      best = std::move(levels->hypothesis);
      present.push_back(levels->noise);
    }
  }
  const std::vector<KnownNoise> extra(present.begin() + static_cast<std::ptrdiff_t>(listed.size()),
                                      present.end());
  findings.recalibrated = wrong_coefficients(question, likelihoods, listed, extra, best);
  if (took_from_file)  // what the file states stands, what it only lists gets its value
    std::erase_if(findings.recalibrated, [](const Recalibration& r) { return r.from != 0.0; });
  findings.terms = best.terms;
  findings.squares = best.squares;
  for (std::size_t t = 0; t < findings.terms.size(); ++t)
    findings.squares[t] /= seen_share(findings.terms[t].kind, share);
  return findings;
}

const Recalibration* inflated_noise(const std::vector<Recalibration>& changes) {
  constexpr double kWithinWhatIsStated = 3.0;
  const auto inflated =
      std::find_if(changes.begin(), changes.end(), [](const Recalibration& change) {
        return is_slow_noise(change.name) &&
               std::abs(change.to) > kWithinWhatIsStated * std::abs(change.from);
      });
  return inflated == changes.end() ? nullptr : &*inflated;
}

void adopt_noise(twin::Model& model, core::Axis axis, const NoiseFindings& findings,
                 const twin::Origin& origin) {
  for (const Recalibration& change : findings.recalibrated) {
    for (EffectSpec& spec : model.effects) {
      if (spec.axis != axis || spec.kind != change.name) continue;
      spec.parameters[change.parameter] = change.to;
      spec.standard_errors.erase(change.parameter);
      if (std::isfinite(change.standard_error))
        spec.standard_errors[change.parameter] = change.standard_error;
    }
  }
  for (const NamedEffect& effect : findings.effects) {
    model.effects.push_back({.kind = effect.name,
                             .axis = axis,
                             .parameters = effect.parameters,
                             .standard_errors = effect.standard_errors,
                             .origin = origin});
  }
}

}  // namespace zerodrift::diagnosis
