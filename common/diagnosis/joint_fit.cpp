// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/joint_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>
#include <utility>

namespace zerodrift::diagnosis {
namespace {

double evidence_of_correction(double value, double variance, double prior_sd,
                              const EvidenceOptions& options) {
  if (std::isfinite(prior_sd)) {  // Savage-Dickey (Dickey 1971)
    return 0.5 * std::log(variance) - std::log(prior_sd) + 0.5 * value * value / variance;
  }
  return log_evidence_of_any_value(value, variance, options);
}

// The problem with these groups alone, each at its shape.
SearchProblem narrowed(const SearchProblem& problem, std::span<const ChosenShape> chosen) {
  SearchProblem narrow{.series = problem.series,
                       .valid = problem.valid,
                       .interval_s = problem.interval_s,
                       .known = problem.known,
                       .noise = problem.noise};
  for (const ChosenShape& choice : chosen) {
    narrow.groups.push_back(problem.group(choice.group));
    narrow.groups.back().variants = {{.shape = choice.shape}};
  }
  return narrow;
}

bool has_powers(const SearchProblem& problem, const std::string& group) {
  return std::any_of(problem.groups.begin(), problem.groups.end(),
                     [&](const CandidateGroup& g) { return g.has_powers && g.name == group; });
}

// Whether the column at `i` may be left out while the others stay.
bool may_go(const SearchProblem& problem, const Board& board, const Base& base, std::size_t i,
            Idle idle) {
  const std::string& group = board.active_name(base[i]);
  if (!has_powers(problem, group)) return idle == Idle::kAnyColumn;
  const bool is_highest = i + 1 == base.size() || board.active_name(base[i + 1]) != group;
  const bool is_first = i == 0 || board.active_name(base[i - 1]) != group;
  return is_highest && (idle == Idle::kAnyColumn || !is_first);
}

}  // namespace

Base with_evidence(const SearchProblem& problem, const SearchOptions& options, const Board& board,
                   Base base, const Eigen::VectorXd& squares, Idle idle) {
  const std::size_t known = board.known().size();
  while (base.size() > known) {
    const NoiseFit noise = board.fit(base, squares);
    const auto joint = fit_amplitudes(board.rows(base), noise.spectrum);
    if (!joint) return base;
    std::size_t weakest = base.size();
    double least = 0.0;
    for (std::size_t i = known; i < base.size(); ++i) {
      if (!may_go(problem, board, base, i, idle)) continue;
      const auto row = static_cast<Eigen::Index>(i);
      const double evidence = log_evidence_of_any_value(
          joint->values(row), joint->covariance(row, row), options.evidence);
      if (!(evidence < least)) continue;
      least = evidence;
      weakest = i;
    }
    if (weakest == base.size()) break;
    base.erase(base.begin() + static_cast<std::ptrdiff_t>(weakest));
  }
  return base;
}

FittedEffect fitted_effect(const SearchProblem& problem, const Board& board, std::size_t variant,
                           const Base& places, const Base& base, const Amplitudes& joint) {
  FittedEffect effect;
  const BoardVariant& v = board.variant(variant);
  effect.group = problem.groups[v.group].id;
  effect.shape = v.definition.shape;
  const auto columns = problem.groups[v.group].columns(effect.shape);
  // From the joint fit's values to the group's own columns; none to those that took no part.
  Eigen::MatrixXd to_columns =
      Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(columns.size()), joint.values.size());
  for (std::size_t j = 0; j < places.size(); ++j) {
    const auto at = std::find(base.begin(), base.end(), places[j]);
    if (at == base.end()) continue;
    to_columns(static_cast<Eigen::Index>(v.made->which[j]), at - base.begin()) =
        1.0 / board.active(*at).norm;
  }
  const Eigen::VectorXd amplitudes = to_columns * joint.values;
  effect.amplitudes.assign(amplitudes.begin(), amplitudes.end());
  effect.covariance = to_columns * joint.covariance * to_columns.transpose();
  effect.waveform.assign(problem.series.size(), 0.0);
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

std::vector<CorrectionFinding> corrections_of(const SearchProblem& problem,
                                              const SearchOptions& options, const Board& board,
                                              const std::optional<Amplitudes>& joint) {
  std::vector<CorrectionFinding> findings;
  const double threshold =
      std::log(static_cast<double>(problem.known.size()) / options.false_alarm);
  std::size_t counted = 0;
  for (std::size_t k = 0; k < problem.known.size(); ++k) {
    CorrectionFinding f;
    f.name = problem.known[k].name;
    f.testability = board.known_testability()[k];
    f.standard_error = joint ? 0.0 : std::numeric_limits<double>::infinity();
    if (joint && f.testability == Testability::kTestable) {
      const auto i = static_cast<Eigen::Index>(counted);
      const double norm = board.active(board.known()[counted++]).norm;
      f.value = joint->values(i) / norm;
      const double variance = joint->covariance(i, i) / (norm * norm);
      f.standard_error = std::sqrt(variance);
      f.log_evidence =
          evidence_of_correction(f.value, variance, problem.known[k].prior_sd, options.evidence);
      f.significant = f.log_evidence > threshold;
    }
    findings.push_back(std::move(f));
  }
  return findings;
}

std::optional<JointFit> fit_jointly(const SearchProblem& problem,
                                    std::span<const ChosenShape> chosen,
                                    const SearchOptions& options) {
  problem.check();
  if (problem.reason_to_refuse(options.least_valid_share)) return std::nullopt;
  const SearchProblem narrow = narrowed(problem, chosen);
  Board board(narrow, options);
  NoiseFit noise = board.fit(board.known());
  if (!(board.series_power() > 0.0) || noise.status == NoiseFitStatus::kNoPower)
    return std::nullopt;
  Base base = board.known();
  std::vector<Base> places;
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    if (board.variant(i).testability() != Testability::kTestable) return std::nullopt;
    places.push_back(board.activate(i));
    base.insert(base.end(), places.back().begin(), places.back().end());
  }
  base = board.independent(base);
  if (!chosen.empty())
    base = with_evidence(narrow, options, board, base, noise.squares, Idle::kHigherPowers);
  // First from what the known columns leave, then to the end.
  if (!chosen.empty()) noise = board.fit(base, noise.squares);
  noise = board.fit(base, noise.squares);
  if (noise.status == NoiseFitStatus::kNoPower) return std::nullopt;
  JointFit fit;
  fit.noise_terms = board.dictionary().terms();
  fit.noise_squares.assign(noise.squares.begin(), noise.squares.end());
  const std::optional<Amplitudes> joint = fit_amplitudes(board.rows(base), noise.spectrum);
  if (!joint && !chosen.empty()) return std::nullopt;
  for (std::size_t i = 0; i < chosen.size(); ++i)
    fit.effects.push_back(fitted_effect(narrow, board, i, places[i], base, *joint));
  fit.corrections = corrections_of(narrow, options, board, joint);
  return fit;
}

std::optional<JointFit> fit_noise_beside(const SearchProblem& problem,
                                         const SearchOptions& options) {
  return fit_jointly(problem, {}, options);
}

}  // namespace zerodrift::diagnosis
