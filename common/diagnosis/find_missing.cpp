// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/find_missing.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <map>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "common/diagnosis/group_findings.h"
#include "common/diagnosis/joint_fit.h"
#include "common/diagnosis/noise_weight.h"
#include "common/diagnosis/posterior.h"
#include "common/diagnosis/search_board.h"

namespace zerodrift::diagnosis {
namespace {

constexpr std::size_t kNone = static_cast<std::size_t>(-1);

struct Chosen {
  std::size_t group = 0;
  std::size_t variant = 0;
  Base places;
  double log_evidence = 0.0;
  double chi_square = 0.0;
};

// Heat is on its way for as long as a coil takes, and time has no place of its own.
bool acts_at_once(twin::InputFamily family) {
  using twin::InputFamily;
  return family != InputFamily::kNone && family != InputFamily::kTime &&
         family != InputFamily::kTemperature;
}

// Of two courses about their means: (sum |a b|)² / (sum a² sum b²).
double common_share(const std::vector<double>& a, const std::vector<double>& b) {
  double both = 0.0;
  double of_a = 0.0;
  double of_b = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    both += std::abs(a[i] * b[i]);
    of_a += a[i] * a[i];
    of_b += b[i] * b[i];
  }
  return of_a > 0.0 && of_b > 0.0 ? both * both / (of_a * of_b) : 0.0;
}

class Searcher {
 public:
  Searcher(const SearchProblem& problem, const SearchOptions& options, ColumnMemory* memory)
      : problem_(problem), options_(options), board_(problem, options, memory) {
    const std::size_t groups = std::max<std::size_t>(problem.groups.size(), 1);
    threshold_ = std::log(static_cast<double>(groups) / options.false_alarm);
  }

  SearchReport run() {
    SearchReport report;
    report.threshold_nats = threshold_;
    report.missing_share = board_.missing_share();
    report.noise_terms = board_.dictionary().terms();
    first_ = board_.evaluate(board_.known(), {}, {});
    if (!(board_.series_power() > 0.0) || first_.null.status == NoiseFitStatus::kNoPower) {
      report.reason = "nothing is left of the series beside its mean and the model's columns";
      report.groups = groups();
      return report;
    }
    add_greedily();
    judge_generics(report);
    if (report.outcome != SearchOutcome::kUnknown) {
      report.outcome = chosen_.empty() ? SearchOutcome::kNothingMissing : SearchOutcome::kNamed;
    }
    finish(report);
    return report;
  }

 private:
  [[nodiscard]] Base base_without(std::size_t left_out) const {
    Base base = board_.known();
    for (std::size_t i = 0; i < chosen_.size(); ++i) {
      if (i != left_out)
        base.insert(base.end(), chosen_[i].places.begin(), chosen_[i].places.end());
    }
    base.insert(base.end(), unknown_places_.begin(), unknown_places_.end());
    return board_.independent(base);
  }

  [[nodiscard]] std::vector<std::size_t> chosen_groups(std::size_t left_out = kNone) const {
    std::vector<std::size_t> groups;
    for (std::size_t i = 0; i < chosen_.size(); ++i) {
      if (i != left_out) groups.push_back(chosen_[i].group);
    }
    return groups;
  }

  // Everything beside the chosen ones but one. What was asked before, with shapes as they are now,
  // isn't evaluated again.
  [[nodiscard]] Evaluation evaluate(std::size_t left_out = kNone) {
    const auto [place, is_new] =
        evaluations_.try_emplace({base_without(left_out), chosen_groups(left_out)});
    auto& [question, answer] = *place;
    if (is_new) answer = board_.evaluate(question.first, question.second, first_.null.squares);
    return answer;
  }

  [[nodiscard]] double score(const Evaluation& e, std::size_t group) const {
    return e.groups[group].log_evidence + problem_.groups[group].log_prior;
  }

  [[nodiscard]] bool is_of_family(std::size_t group, std::size_t other) const {
    constexpr auto kAny = twin::InputFamily::kNone;
    const twin::InputFamily family = problem_.groups[group].family;
    const twin::InputFamily of_other = problem_.groups[other].family;
    return family == kAny || of_other == kAny || family == of_other;
  }

  // What a variant does in the record beside a base, about its mean.
  [[nodiscard]] std::vector<double> course(std::size_t variant, const Base& beside,
                                           const Eigen::VectorXd& squares) const {
    const BoardVariant& v = board_.variant(variant);
    const Eigen::VectorXd spectrum = board_.dictionary().spectra() * squares;
    const ColumnEvidence fit =
        column_evidence(board_.project(beside, {variant}, spectrum).front(), options_.evidence);
    const auto columns = problem_.groups[v.group].columns(v.definition.shape);
    std::vector<double> course(problem_.series.size(), 0.0);
    for (std::size_t j = 0; j < v.columns().size(); ++j) {
      const double amplitude = fit.amplitudes(static_cast<Eigen::Index>(j)) / v.columns()[j].norm;
      const std::vector<double>& column = columns[v.made->which[j]];
      for (std::size_t i = 0; i < course.size(); ++i) course[i] += amplitude * column[i];
    }
    centre(course, problem_.valid);
    return course;
  }

  // Whether a group explains no more than a mismatch of form of the chosen effects of its family
  // could. Of a form z that remembers nothing it acts where that does: it is z delta, and along a
  // course c it has the share (sum |z c|)² / (sum z² sum c²) of |delta|² z's d² at most.
  [[nodiscard]] bool is_mismatch(const Evaluation& e, std::size_t group,
                                 std::size_t left_out = kNone) const {
    const GroupScore& g = e.groups[group];
    const double share = options_.form_mismatch_share;
    const double excess = (g.chi_square - g.rank) * (1.0 - share);
    double in_family = 0.0;
    for (std::size_t i = 0; i < chosen_.size(); ++i) {
      if (i != left_out && is_of_family(group, chosen_[i].group))
        in_family += chosen_[i].chi_square;
    }
    if (excess >= share * in_family) return false;
    if (g.rank == 0 || !acts_at_once(problem_.groups[group].family)) return true;
    const Eigen::VectorXd& squares = e.noises[e.variants[g.best_variant].noise];
    const std::vector<double> own = course(g.best_variant, base_without(left_out), squares);
    double within_reach = 0.0;
    for (std::size_t i = 0; i < chosen_.size(); ++i) {
      if (i == left_out || !is_of_family(group, chosen_[i].group)) continue;
      const bool at_once =
          problem_.groups[chosen_[i].group].family == problem_.groups[group].family &&
          acts_at_once(problem_.groups[group].family);
      const double common =
          at_once ? common_share(course(chosen_[i].variant, base_without(i), squares), own) : 1.0;
      within_reach += chosen_[i].chi_square * common;
    }
    return excess < share * within_reach;
  }

  [[nodiscard]] bool may_be_of_an_input(const Evaluation& e, std::size_t group) const {
    if (!problem_.groups[group].happens_once) return false;
    for (std::size_t g = 0; g < problem_.groups.size(); ++g) {
      if (problem_.groups[g].kind == CandidateKind::kGeneric && score(e, g) >= score(e, group))
        return true;
    }
    return false;
  }

  [[nodiscard]] std::size_t best_of(const Evaluation& e, CandidateKind kind,
                                    std::size_t left_out = kNone) const {
    std::size_t best = kNone;
    for (std::size_t g = 0; g < problem_.groups.size(); ++g) {
      if (problem_.groups[g].kind != kind || !std::isfinite(e.groups[g].log_evidence)) continue;
      if (best != kNone && score(e, g) <= score(e, best)) continue;
      if (is_mismatch(e, g, left_out) || may_be_of_an_input(e, g)) continue;
      best = g;
    }
    return best;
  }

  // The simpler effect, where the record doesn't tell it from the one found.
  [[nodiscard]] std::size_t simplest(const Evaluation& e, std::size_t group) const {
    const std::optional<GroupId> parent = problem_.groups[group].parent;
    if (!parent) return group;
    for (std::size_t g = 0; g < problem_.groups.size(); ++g) {
      const bool as_good = problem_.groups[g].id == *parent &&
                           score(e, g) >= score(e, group) - options_.nested_margin_nats;
      if (as_good) return g;
    }
    return group;
  }

  // Sharpens the shapes of the groups that may be chosen.
  void refine_leaders(const Evaluation& e, const Base& base) {
    constexpr double kInReachNats = 15.0;
    const std::size_t best = best_of(e, CandidateKind::kNamed);
    if (best == kNone || score(e, best) < threshold_ - kInReachNats) return;
    std::vector<std::size_t> order;
    for (std::size_t g = 0; g < problem_.groups.size(); ++g) {
      const bool in_reach = problem_.groups[g].kind == CandidateKind::kNamed &&
                            !problem_.groups[g].ranges.empty() &&
                            score(e, g) > score(e, best) - kInReachNats;
      if (in_reach) order.push_back(g);
    }
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return score(e, a) > score(e, b); });
    order.resize(std::min(order.size(), options_.refined_groups));
    if (!order.empty()) evaluations_.clear();
    for (const std::size_t g : order) {
      const std::size_t variant = e.groups[g].best_variant;
      board_.refine(variant, base, e.noises[e.variants[variant].noise]);
    }
    refined_ = !order.empty();
  }

  void add(const Evaluation& e, std::size_t group) {
    const GroupScore& g = e.groups[group];
    chosen_.push_back(
        {group, g.best_variant, board_.activate(g.best_variant), g.log_evidence, g.chi_square});
  }

  void add_greedily() {
    remainder_ = first_;
    while (chosen_.size() < options_.max_effects) {
      refined_ = false;
      refine_leaders(remainder_, base_without(kNone));
      if (refined_) remainder_ = evaluate();
      if (chosen_.empty()) first_ = remainder_;
      std::size_t best = best_of(remainder_, CandidateKind::kNamed);
      if (best == kNone || score(remainder_, best) < threshold_) return;
      best = simplest(remainder_, best);
      add(remainder_, best);
      if (chosen_.size() > 1) exchange();
      const bool kept = std::any_of(chosen_.begin(), chosen_.end(),
                                    [&](const Chosen& c) { return c.group == best; });
      remainder_ = evaluate();
      if (!kept) return;
    }
  }

  // Replaces or drops each chosen effect in the light of the others.
  void exchange() {
    constexpr int kRounds = 2;
    for (int round = 0; round < kRounds; ++round) {
      bool changed = false;
      for (std::size_t i = 0; i < chosen_.size();) {
        const Evaluation e = evaluate(i);
        Chosen& c = chosen_[i];
        std::size_t best = best_of(e, CandidateKind::kNamed, i);
        if (best != kNone) best = simplest(e, best);
        const bool better = best != kNone && best != c.group &&
                            score(e, best) > score(e, c.group) + options_.swap_margin_nats;
        const std::size_t now = better ? best : c.group;
        if (score(e, now) < threshold_) {
          chosen_.erase(chosen_.begin() + static_cast<std::ptrdiff_t>(i));
          changed = true;
          continue;
        }
        if (better || e.groups[now].best_variant != c.variant) {
          c.group = now;
          c.variant = e.groups[now].best_variant;
          c.places = board_.activate(c.variant);
          changed = true;
        }
        c.log_evidence = e.groups[now].log_evidence;
        c.chi_square = e.groups[now].chi_square;
        ++i;
      }
      if (!changed) return;
    }
  }

  // A generic group beside all that was chosen, or in place of it.
  void judge_generics(SearchReport& report) {
    std::size_t generic = best_of(remainder_, CandidateKind::kGeneric);
    const Evaluation* seen = &remainder_;
    if (generic != kNone && score(remainder_, generic) >= threshold_) {
      report.reason = "a generic dependence remains significant beside the named effects";
      if (chosen_.empty()) report.reason = "no named effect explains a significant dependence";
    } else {
      generic = generic_that_beats_the_named();
      seen = &first_;
      if (generic == kNone) return;
      report.reason = "a generic dependence explains more than the named effects together";
    }
    report.outcome = SearchOutcome::kUnknown;
    unknown_ = {generic,
                seen->groups[generic].best_variant,
                {},
                seen->groups[generic].log_evidence,
                seen->groups[generic].chi_square};
    unknown_places_ = board_.activate(unknown_.variant);
    drop_what_the_unknown_explains();
    if (!chosen_.empty()) exchange();  // beside the unknown another name may be the better one
  }

  [[nodiscard]] std::size_t generic_that_beats_the_named() const {
    if (chosen_.empty()) return kNone;
    double named_evidence = 0.0;
    double named_chi_square = 0.0;
    for (const Chosen& c : chosen_) {
      named_evidence += c.log_evidence - threshold_;
      named_chi_square += c.chi_square;
    }
    for (std::size_t g = 0; g < problem_.groups.size(); ++g) {
      const GroupScore& s = first_.groups[g];
      const bool beats =
          problem_.groups[g].kind == CandidateKind::kGeneric &&
          score(first_, g) - threshold_ > named_evidence + threshold_ &&
          named_chi_square < (1.0 - options_.form_mismatch_share) * (s.chi_square - s.rank);
      if (beats) return g;
    }
    return kNone;
  }

  void drop_what_the_unknown_explains() {
    for (std::size_t i = 0; i < chosen_.size();) {
      const Evaluation e = evaluate(i);
      if (score(e, chosen_[i].group) < threshold_) {
        chosen_.erase(chosen_.begin() + static_cast<std::ptrdiff_t>(i));
      } else {
        ++i;
      }
    }
  }

  // Of groups in place of a chosen one.
  [[nodiscard]] std::vector<RankedGroup> credible_set(const Evaluation& e,
                                                      std::size_t place) const {
    double best = -std::numeric_limits<double>::infinity();
    std::vector<double> nats(e.groups.size(), -std::numeric_limits<double>::infinity());
    for (std::size_t g = 0; g < e.groups.size(); ++g) {
      best = std::max(best, score(e, g));
      if (problem_.groups[g].kind != CandidateKind::kNamed) continue;
      if (!(e.groups[g].log_evidence > 0.0)) continue;  // explains nothing
      // What couldn't have been chosen is no alternative either.
      const bool out = is_mismatch(e, g, place) || may_be_of_an_input(e, g);
      if (g != chosen_[place].group && out) continue;
      nats[g] = score(e, g);
    }
    const std::vector<double> probability = probabilities(nats, best, options_);
    std::vector<std::size_t> order(probability.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return probability[a] > probability[b]; });
    const double enough = options_.credible_mass * (1.0 - options_.unlisted_share);
    double mass = 0.0;
    std::vector<RankedGroup> set;
    for (const std::size_t g : order) {
      if (!(probability[g] > 0.0)) break;
      if (mass < enough || g == chosen_[place].group)
        set.push_back({problem_.groups[g].id, probability[g]});
      mass += probability[g];
    }
    return set;
  }

  void finish(SearchReport& report) {
    const Base base = base_without(kNone);
    const RowSystem rows = board_.rows(base);
    const NoiseFit noise =
        fit_noise(rows, board_.dictionary(), options_.noise_fit, remainder_.null.squares);
    report.noise_status = noise.status;
    if (noise.status == NoiseFitStatus::kNoPower) {
      report.corrections = corrections_of(problem_, options_, board_, std::nullopt);
      return;
    }
    report.noise_squares.assign(noise.squares.begin(), noise.squares.end());
    const std::optional<Amplitudes> joint = fit_amplitudes(rows, noise.spectrum);
    if (joint) {
      for (std::size_t i = 0; i < chosen_.size(); ++i) {
        report.effects.push_back(found(chosen_[i], base, *joint));
        const Evaluation e = evaluate(i);
        FoundEffect& effect = report.effects.back();
        effect.credible_set = credible_set(e, i);
        effect.log_evidence = e.groups[chosen_[i].group].log_evidence;
        for (const RankedGroup& r : effect.credible_set) {
          if (r.group == effect.group) effect.probability = r.probability;
        }
      }
      if (report.outcome == SearchOutcome::kUnknown) {
        unknown_.places = unknown_places_;
        report.unknown = found(unknown_, base, *joint);
      }
    }
    report.corrections = corrections_of(problem_, options_, board_, joint);
    report.groups = groups();
    for (std::size_t g = 0; g < report.groups.size(); ++g)
      add_power(report.groups[g], problem_, options_, board_, base_without(place_of(g)),
                noise.spectrum);
    const Eigen::VectorXd known_spectrum =
        board_.dictionary().spectra() * board_.dictionary().prior_square();
    report.octaves = power_by_octave(rows, board_.bands(),
                                     problem_.noise.known.empty() ? noise.spectrum : known_spectrum,
                                     problem_.interval_s);
  }

  [[nodiscard]] FoundEffect found(const Chosen& c, const Base& base,
                                  const Amplitudes& joint) const {
    FoundEffect effect{fitted_effect(problem_, board_, c.variant, c.places, base, joint)};
    effect.log_evidence = c.log_evidence;
    effect.separation = std::sqrt(c.chi_square);
    return effect;
  }

  [[nodiscard]] std::vector<GroupFinding> groups() const {
    std::vector<GroupFinding> findings;
    for (std::size_t g = 0; g < problem_.groups.size(); ++g)
      findings.push_back(group_finding(g, problem_, options_, board_, first_));
    return findings;
  }

  // Of a group among the chosen ones, or kNone.
  [[nodiscard]] std::size_t place_of(std::size_t group) const {
    std::size_t place = kNone;
    for (std::size_t i = 0; i < chosen_.size(); ++i) place = chosen_[i].group == group ? i : place;
    return place;
  }

  using Question = std::pair<Base, std::vector<std::size_t>>;  // beside what, without which groups

  const SearchProblem& problem_;
  const SearchOptions& options_;
  Board board_;
  std::map<Question, Evaluation> evaluations_;
  double threshold_ = 0.0;
  Evaluation first_;      // beside the known columns
  Evaluation remainder_;  // beside all chosen
  std::vector<Chosen> chosen_;
  Chosen unknown_;
  Base unknown_places_;
  bool refined_ = false;
};

}  // namespace

std::string_view name(SearchOutcome outcome) noexcept {
  switch (outcome) {
    case SearchOutcome::kRefused: return "refused";
    case SearchOutcome::kNothingMissing: return "nothing missing";
    case SearchOutcome::kNamed: return "named";
    case SearchOutcome::kUnknown: return "unknown";
  }
  assert(false && "no such outcome");
  return "";
}

SearchReport find_missing(const SearchProblem& problem, const SearchOptions& options,
                          ColumnMemory* memory) {
  if (const auto error = options.validate()) throw std::invalid_argument(*error);
  problem.check();
  if (auto reason = problem.reason_to_refuse(options.least_valid_share)) {
    SearchReport report;
    report.reason = std::move(*reason);
    return report;
  }
  return Searcher(problem, options, memory).run();
}

}  // namespace zerodrift::diagnosis
