// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/search.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "common/diagnosis/search_board.h"

namespace zerodrift::diagnosis {
namespace {

constexpr std::size_t kFewestPoints = 16;
constexpr std::size_t kNone = static_cast<std::size_t>(-1);

struct Chosen {
  std::size_t group = 0;
  std::size_t variant = 0;
  Base places;
  double log_evidence = 0.0;
  double chi_square = 0.0;
};

void check(const SearchProblem& problem) {
  const std::size_t n = problem.series.size();
  if (problem.valid.size() != n) {
    throw std::invalid_argument("valid has " + std::to_string(problem.valid.size()) +
                                " entries, the series " + std::to_string(n));
  }
  if (!(problem.interval_s > 0.0)) {
    throw std::invalid_argument("interval_s is " + std::to_string(problem.interval_s) +
                                ", must be > 0");
  }
  if (const auto error = problem.noise.validate()) throw std::invalid_argument(*error);
  for (const CandidateGroup& g : problem.groups) {
    if (!g.columns) throw std::invalid_argument("group '" + g.name + "' can't make its columns");
  }
}

std::optional<std::string> reason_to_refuse(const SearchProblem& problem,
                                            const SearchOptions& options) {
  const std::size_t n = problem.series.size();
  if (n < kFewestPoints) {
    return "the series has " + std::to_string(n) + " points, needs " +
           std::to_string(kFewestPoints);
  }
  std::size_t valid = 0;
  for (std::size_t i = 0; i < n; ++i) {
    if (problem.valid[i] == 0) continue;
    ++valid;
    if (!std::isfinite(problem.series[i])) {
      return "the series is not finite at point " + std::to_string(i);
    }
  }
  const double share = static_cast<double>(valid) / static_cast<double>(n);
  if (!(share >= options.least_valid_share)) {
    return "only " + std::to_string(std::lround(100.0 * share)) + " % of the series is valid";
  }
  return std::nullopt;
}

class Searcher {
 public:
  Searcher(const SearchProblem& problem, const SearchOptions& options)
      : problem_(problem), options_(options), board_(problem, options) {
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
      report.groups = groups_at_first();
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

  // Everything beside the chosen ones but one.
  [[nodiscard]] Evaluation evaluate(std::size_t left_out = kNone) const {
    return board_.evaluate(base_without(left_out), chosen_groups(left_out), first_.null.squares);
  }

  [[nodiscard]] double score(const Evaluation& e, std::size_t group) const {
    return e.groups[group].log_evidence + problem_.groups[group].log_prior;
  }

  // d² of the chosen effects that a group could be the remainder of.
  [[nodiscard]] double explained_in_family(std::size_t group, std::size_t left_out) const {
    const std::string& family = problem_.groups[group].family;
    double sum = 0.0;
    for (std::size_t i = 0; i < chosen_.size(); ++i) {
      if (i == left_out) continue;
      const std::string& other = problem_.groups[chosen_[i].group].family;
      if (family.empty() || other.empty() || family == other) sum += chosen_[i].chi_square;
    }
    return sum;
  }

  [[nodiscard]] bool is_mismatch(const Evaluation& e, std::size_t group,
                                 std::size_t left_out = kNone) const {
    const GroupScore& g = e.groups[group];
    const double share = options_.form_mismatch_share;
    return (g.chi_square - g.rank) * (1.0 - share) < share * explained_in_family(group, left_out);
  }

  [[nodiscard]] std::size_t best_of(const Evaluation& e, CandidateKind kind,
                                    std::size_t left_out = kNone) const {
    std::size_t best = kNone;
    for (std::size_t g = 0; g < problem_.groups.size(); ++g) {
      if (problem_.groups[g].kind != kind || !std::isfinite(e.groups[g].log_evidence)) continue;
      if (best != kNone && score(e, g) <= score(e, best)) continue;
      if (is_mismatch(e, g, left_out)) continue;
      best = g;
    }
    return best;
  }

  // The simpler effect, where the record doesn't tell it from the one found.
  [[nodiscard]] std::size_t simplest(const Evaluation& e, std::size_t group) const {
    const std::string& parent = problem_.groups[group].parent;
    if (parent.empty()) return group;
    for (std::size_t g = 0; g < problem_.groups.size(); ++g) {
      const bool as_good = problem_.groups[g].name == parent &&
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

  // Log probabilities, not normalised, of groups in place of a chosen one. What a group leaves of
  // what the best one explains counts as the remainder of a form, Student distributed.
  [[nodiscard]] std::vector<double> tempered(const Evaluation& e, std::size_t place) const {
    double best = -std::numeric_limits<double>::infinity();
    for (std::size_t g = 0; g < e.groups.size(); ++g) best = std::max(best, score(e, g));
    const double freedom = options_.mismatch_freedom;
    std::vector<double> logarithms(e.groups.size(), -std::numeric_limits<double>::infinity());
    for (std::size_t g = 0; g < e.groups.size(); ++g) {
      if (problem_.groups[g].kind != CandidateKind::kNamed) continue;
      if (!(e.groups[g].log_evidence > 0.0)) continue;  // explains nothing
      // What couldn't have been chosen is no alternative either.
      if (g != chosen_[place].group && is_mismatch(e, g, place)) continue;
      const double remainder = 2.0 * (best - score(e, g));
      logarithms[g] = -0.5 * (freedom + 1.0) * std::log1p(remainder / freedom);
    }
    return logarithms;
  }

  [[nodiscard]] std::vector<RankedName> credible_set(const Evaluation& e, std::size_t place) const {
    const std::size_t named = chosen_[place].group;
    const std::vector<double> logarithms = tempered(e, place);
    const double total = log_sum(logarithms);
    std::vector<RankedName> ranked;
    std::vector<std::size_t> order(logarithms.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return logarithms[a] > logarithms[b]; });
    for (const std::size_t g : order) {
      const double probability = std::exp(logarithms[g] - total);
      if (!(probability > 0.0)) break;
      ranked.push_back({problem_.groups[g].name, probability, {}});
    }
    merge_nested(e, ranked);
    std::stable_sort(ranked.begin(), ranked.end(), [](const RankedName& a, const RankedName& b) {
      return a.probability > b.probability;
    });
    double mass = 0.0;
    std::vector<RankedName> set;
    for (RankedName& r : ranked) {
      const bool is_named = r.name == problem_.groups[named].name;
      if (mass < options_.credible_mass || is_named) set.push_back(r);
      mass += r.probability;
    }
    return set;
  }

  void merge_nested(const Evaluation& e, std::vector<RankedName>& ranked) const {
    for (std::size_t g = 0; g < problem_.groups.size(); ++g) {
      const std::size_t parent = simplest(e, g);
      if (parent == g || !std::isfinite(e.groups[g].log_evidence)) continue;
      const auto find = [&](std::size_t group) {
        return std::find_if(ranked.begin(), ranked.end(), [&](const RankedName& r) {
          return r.name == problem_.groups[group].name;
        });
      };
      const auto child = find(g);
      const auto into = find(parent);
      if (child == ranked.end() || into == ranked.end()) continue;
      into->probability += child->probability;
      into->nested.push_back(child->name);
      ranked.erase(child);
    }
  }

  void finish(SearchReport& report) {
    const Base base = base_without(kNone);
    const RowSystem rows = board_.rows(base);
    const NoiseFit noise =
        fit_noise(rows, board_.dictionary(), options_.noise_fit, remainder_.null.squares);
    report.noise_status = noise.status;
    if (noise.status == NoiseFitStatus::kNoPower) {
      report.corrections = corrections(std::nullopt);
      return;
    }
    report.noise_squares.assign(noise.squares.begin(), noise.squares.end());
    const std::optional<Amplitudes> joint = fit_amplitudes(rows, noise.spectrum);
    if (joint) {
      for (std::size_t i = 0; i < chosen_.size(); ++i) {
        report.effects.push_back(describe(chosen_[i], base, *joint));
        const Evaluation e = evaluate(i);
        FoundEffect& effect = report.effects.back();
        effect.credible_set = credible_set(e, i);
        effect.log_evidence = e.groups[chosen_[i].group].log_evidence;
        for (const RankedName& r : effect.credible_set) {
          if (r.name == effect.name) effect.probability = r.probability;
        }
      }
      if (report.outcome == SearchOutcome::kUnknown) {
        unknown_.places = unknown_places_;
        report.unknown = describe(unknown_, base, *joint);
      }
    }
    report.corrections = corrections(joint);
    report.groups = groups_at_first();
    add_power(report, noise.spectrum);
    const Eigen::VectorXd known_spectrum =
        board_.dictionary().spectra() * board_.dictionary().prior_square();
    report.octaves = power_by_octave(rows, board_.bands(),
                                     problem_.noise.known.empty() ? noise.spectrum : known_spectrum,
                                     problem_.interval_s);
  }

  [[nodiscard]] FoundEffect describe(const Chosen& c, const Base& base,
                                     const Amplitudes& joint) const {
    FoundEffect effect;
    const BoardVariant& v = board_.variant(c.variant);
    effect.name = problem_.groups[c.group].name;
    effect.shape = v.definition.shape;
    effect.log_evidence = c.log_evidence;
    effect.separation = std::sqrt(c.chi_square);
    const auto columns = problem_.groups[c.group].columns(effect.shape);
    // From the joint fit's values to the group's own columns; none to those that took no part.
    Eigen::MatrixXd to_columns =
        Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(columns.size()), joint.values.size());
    for (std::size_t j = 0; j < c.places.size(); ++j) {
      const auto at = std::find(base.begin(), base.end(), c.places[j]);
      if (at == base.end()) continue;
      to_columns(static_cast<Eigen::Index>(v.which[j]), at - base.begin()) =
          1.0 / board_.active(*at).norm;
    }
    const Eigen::VectorXd amplitudes = to_columns * joint.values;
    effect.amplitudes.assign(amplitudes.begin(), amplitudes.end());
    effect.covariance = to_columns * joint.covariance * to_columns.transpose();
    effect.waveform.assign(problem_.series.size(), 0.0);
    for (std::size_t j = 0; j < columns.size(); ++j) {
      for (std::size_t i = 0; i < effect.waveform.size(); ++i) {
        effect.waveform[i] += effect.amplitudes[j] * columns[j][i];
      }
    }
    const double n = static_cast<double>(effect.waveform.size());
    const double mean = std::accumulate(effect.waveform.begin(), effect.waveform.end(), 0.0) / n;
    double squares = 0.0;
    for (double& w : effect.waveform) {
      w -= mean;
      squares += w * w;
    }
    effect.rms = std::sqrt(squares / n);
    return effect;
  }

  // One for each known column; without a joint fit each is 0 and may be anything.
  [[nodiscard]] std::vector<CorrectionFinding> corrections(
      const std::optional<Amplitudes>& joint) const {
    std::vector<CorrectionFinding> findings;
    const double threshold =
        std::log(static_cast<double>(problem_.known.size()) / options_.false_alarm);
    std::size_t counted = 0;
    for (std::size_t k = 0; k < problem_.known.size(); ++k) {
      CorrectionFinding f;
      f.name = problem_.known[k].name;
      f.testability = board_.known_testability()[k];
      f.standard_error = joint ? 0.0 : std::numeric_limits<double>::infinity();
      if (joint && f.testability == Testability::kTestable) {
        const auto i = static_cast<Eigen::Index>(counted);
        const double norm = board_.active(board_.known()[counted++]).norm;
        f.value = joint->values(i) / norm;
        const double variance = joint->covariance(i, i) / (norm * norm);
        f.standard_error = std::sqrt(variance);
        f.log_evidence = evidence_of_correction(f.value, variance, problem_.known[k].prior_sd);
        f.significant = f.log_evidence > threshold;
      }
      findings.push_back(std::move(f));
    }
    return findings;
  }

  [[nodiscard]] double evidence_of_correction(double value, double variance,
                                              double prior_sd) const {
    if (std::isfinite(prior_sd)) {  // Savage-Dickey (Dickey 1971)
      return 0.5 * std::log(variance) - std::log(prior_sd) + 0.5 * value * value / variance;
    }
    ProjectedColumns one;
    one.gram.setConstant(1, 1, 1.0 / variance);
    one.products.setConstant(1, value / variance);
    one.unprojected.setConstant(1, 1.0 / variance);
    return column_evidence(one, options_.evidence).log_bayes_factor;
  }

  [[nodiscard]] std::vector<GroupFinding> groups_at_first() const {
    std::vector<GroupFinding> findings(problem_.groups.size());
    for (std::size_t g = 0; g < findings.size(); ++g) {
      GroupFinding& f = findings[g];
      f.name = problem_.groups[g].name;
      f.kind = problem_.groups[g].kind;
      f.testability = testability(g);
      if (f.testability == Testability::kCollinear) f.collinear_with = nearest_known(g);
      if (f.testability != Testability::kTestable) continue;
      const GroupScore& score = first_.groups[g];
      f.log_evidence = score.log_evidence;
      f.separation = std::sqrt(std::max(score.chi_square, 0.0));
      f.shape = board_.variant(score.best_variant).definition.shape;
      const std::vector<std::size_t> best{score.best_variant};
      const Eigen::VectorXd spectrum =
          board_.dictionary().spectra() * first_.noises[first_.variants[score.best_variant].noise];
      const ColumnEvidence e = column_evidence(
          board_.project(board_.known(), best, spectrum).front(), options_.evidence);
      const double power =
          e.amplitudes.dot(board_.variant(score.best_variant).plain_gram * e.amplitudes) /
          board_.coefficient_weight();
      f.rms = std::sqrt(std::max(power, 0.0) / static_cast<double>(problem_.series.size()));
      const double remaining = remainder_.groups.empty() ? 0.0 : remainder_.groups[g].log_evidence;
      f.remaining_log_evidence = std::isfinite(remaining) ? remaining : 0.0;
    }
    return findings;
  }

  [[nodiscard]] Testability testability(std::size_t group) const {
    Testability best = Testability::kUnusable;
    for (const std::size_t i : board_.members(group)) {
      Testability t = board_.variant(i).testability;
      if (t == Testability::kTestable && !std::isfinite(first_.variants[i].log_evidence)) {
        t = Testability::kCollinear;
      }
      const auto better = [](Testability a) {
        switch (a) {
          case Testability::kTestable:
            return 3;
          case Testability::kCollinear:
            return 2;
          case Testability::kNotExcited:
            return 1;
          case Testability::kUnusable:
            break;
        }
        return 0;
      };
      if (better(t) > better(best)) best = t;
    }
    return best;
  }

  [[nodiscard]] std::string nearest_known(std::size_t group) const {
    std::string nearest;
    double largest = 0.0;
    const auto p = static_cast<Eigen::Index>(board_.known().size());
    for (const std::size_t i : board_.members(group)) {
      const BoardVariant& v = board_.variant(i);
      if (v.testability != Testability::kTestable) continue;
      const Eigen::MatrixXd gram = weighted_gram(
          board_.rows(board_.known(), &v), board_.dictionary().spectra() * first_.null.squares);
      for (Eigen::Index j = 0; j < p; ++j) {
        const double correlation = gram(j, p) * gram(j, p) / (gram(j, j) * gram(p, p));
        if (!(correlation > largest)) continue;
        largest = correlation;
        nearest = board_.active_name(board_.known()[static_cast<std::size_t>(j)]);
      }
    }
    return nearest;
  }

  void add_power(SearchReport& report, const Eigen::VectorXd& spectrum) const {
    for (std::size_t g = 0; g < problem_.groups.size(); ++g) {
      if (report.groups[g].testability != Testability::kTestable) continue;
      std::size_t own = kNone;
      for (std::size_t i = 0; i < chosen_.size(); ++i) own = chosen_[i].group == g ? i : own;
      std::vector<std::size_t> variants;
      for (const std::size_t i : board_.members(g)) {
        if (board_.variant(i).testability == Testability::kTestable) variants.push_back(i);
      }
      const auto projected = board_.project(base_without(own), variants, spectrum);
      std::vector<std::pair<double, std::size_t>> squares;  // d² of unit RMS, variant
      for (std::size_t i = 0; i < variants.size(); ++i) {
        const double square = square_of_unit_rms(projected[i], board_.variant(variants[i]));
        if (square > 0.0) squares.emplace_back(square, variants[i]);
      }
      if (squares.empty()) continue;
      std::sort(squares.begin(), squares.end());
      const auto [square, variant] = squares[squares.size() / 2];
      report.groups[g].smallest_rms = options_.power_separation / std::sqrt(square);
      const BoardVariant& v = board_.variant(variant);
      if (v.columns.size() == 1) {
        report.groups[g].smallest_amplitude =
            report.groups[g].smallest_rms * std::sqrt(static_cast<double>(problem_.series.size())) /
            v.columns.front().norm;
      }
    }
  }

  [[nodiscard]] double square_of_unit_rms(const ProjectedColumns& projected,
                                          const BoardVariant& v) const {
    constexpr double kRidge = 1e-9;  // columns may depend on each other
    Eigen::MatrixXd plain = v.plain_gram;
    plain.diagonal().array() += kRidge;
    const double mean = Eigen::LLT<Eigen::MatrixXd>(plain).solve(projected.gram).trace() /
                        static_cast<double>(v.columns.size());
    return mean * static_cast<double>(problem_.series.size()) * board_.coefficient_weight();
  }

  const SearchProblem& problem_;
  const SearchOptions& options_;
  Board board_;
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
    case SearchOutcome::kRefused:
      return "refused";
    case SearchOutcome::kNothingMissing:
      return "nothing missing";
    case SearchOutcome::kNamed:
      return "named";
    case SearchOutcome::kUnknown:
      return "unknown";
  }
  assert(false && "no such outcome");
  return "";
}

std::optional<std::string> SearchOptions::validate() const {
  const auto share = [](const char* key, double value) -> std::optional<std::string> {
    if (value > 0.0 && value < 1.0) return std::nullopt;
    return std::string(key) + " is " + std::to_string(value) + ", must be inside (0, 1)";
  };
  if (auto e = share("false_alarm", false_alarm)) return e;
  if (auto e = share("credible_mass", credible_mass)) return e;
  if (auto e = share("form_mismatch_share", form_mismatch_share)) return e;
  if (auto e = share("least_valid_share", least_valid_share)) return e;
  if (!(mismatch_freedom > 0.0)) {
    return "mismatch_freedom is " + std::to_string(mismatch_freedom) + ", must be > 0";
  }
  if (!(power_separation > 0.0)) {
    return "power_separation is " + std::to_string(power_separation) + ", must be > 0";
  }
  if (single_coefficients < 1) return "single_coefficients is 0, must be >= 1";
  if (refits < 1) return "refits is 0, must be >= 1";
  if (auto e = evidence.validate()) return "evidence: " + *e;
  if (auto e = noise_fit.validate()) return "noise_fit: " + *e;
  return std::nullopt;
}

SearchReport search(const SearchProblem& problem, const SearchOptions& options) {
  if (const auto error = options.validate()) throw std::invalid_argument(*error);
  check(problem);
  if (auto reason = reason_to_refuse(problem, options)) {
    SearchReport report;
    report.reason = std::move(*reason);
    return report;
  }
  return Searcher(problem, options).run();
}

}  // namespace zerodrift::diagnosis
