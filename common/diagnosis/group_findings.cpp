// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/group_findings.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <utility>

namespace zerodrift::diagnosis {
namespace {

Testability testability_of(std::size_t group, const Board& board, const Evaluation& first) {
  Testability best = Testability::kUnusable;
  for (const std::size_t i : board.members(group)) {
    Testability t = board.variant(i).testability();
    if (t == Testability::kTestable && !std::isfinite(first.variants[i].log_evidence)) {
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

std::string nearest_known(std::size_t group, const Board& board, const Evaluation& first) {
  std::string nearest;
  double largest = 0.0;
  const auto p = static_cast<Eigen::Index>(board.known().size());
  for (const std::size_t i : board.members(group)) {
    const BoardVariant& v = board.variant(i);
    if (v.testability() != Testability::kTestable) continue;
    const Eigen::MatrixXd gram = weighted_gram(board.rows(board.known(), &v),
                                               board.dictionary().spectra() * first.null.squares);
    for (Eigen::Index j = 0; j < p; ++j) {
      const double correlation = gram(j, p) * gram(j, p) / (gram(j, j) * gram(p, p));
      if (!(correlation > largest)) continue;
      largest = correlation;
      nearest = board.active_name(board.known()[static_cast<std::size_t>(j)]);
    }
  }
  return nearest;
}

double square_of_unit_rms(const ProjectedColumns& projected, const BoardVariant& v,
                          const Board& board, std::size_t samples) {
  constexpr double kRidge = 1e-9;  // columns may depend on each other
  Eigen::MatrixXd plain = v.made->plain_gram;
  plain.diagonal().array() += kRidge;
  const double mean = Eigen::LLT<Eigen::MatrixXd>(plain).solve(projected.gram).trace() /
                      static_cast<double>(v.columns().size());
  return mean * static_cast<double>(samples) * board.coefficient_weight();
}

}  // namespace

GroupFinding group_finding(std::size_t group, const SearchProblem& problem,
                           const SearchOptions& options, const Board& board,
                           const Evaluation& first) {
  GroupFinding f;
  f.group = problem.groups[group].id;
  f.kind = problem.groups[group].kind;
  f.testability = testability_of(group, board, first);
  if (f.testability == Testability::kCollinear)
    f.collinear_with = nearest_known(group, board, first);
  if (f.testability != Testability::kTestable) return f;
  const GroupScore& score = first.groups[group];
  const BoardVariant& best = board.variant(score.best_variant);
  f.log_evidence = score.log_evidence;
  f.separation = std::sqrt(std::max(score.chi_square, 0.0));
  f.shape = best.definition.shape;
  const Eigen::VectorXd spectrum =
      board.dictionary().spectra() * first.noises[first.variants[score.best_variant].noise];
  const ColumnEvidence e = column_evidence(
      board.project(board.known(), {score.best_variant}, spectrum).front(), options.evidence);
  const double power =
      e.amplitudes.dot(best.made->plain_gram * e.amplitudes) / board.coefficient_weight();
  f.rms = std::sqrt(std::max(power, 0.0) / static_cast<double>(problem.series.size()));
  return f;
}

void add_power(GroupFinding& finding, const SearchProblem& problem, const SearchOptions& options,
               const Board& board, const Base& base, const Eigen::VectorXd& spectrum) {
  if (finding.testability != Testability::kTestable) return;
  const auto group =
      static_cast<std::size_t>(&problem.group(finding.group) - problem.groups.data());
  std::vector<std::size_t> variants;
  for (const std::size_t i : board.members(group)) {
    if (board.variant(i).testability() == Testability::kTestable) variants.push_back(i);
  }
  const auto projected = board.project(base, variants, spectrum);
  std::vector<std::pair<double, std::size_t>> squares;  // d² of unit RMS, variant
  for (std::size_t i = 0; i < variants.size(); ++i) {
    const double square =
        square_of_unit_rms(projected[i], board.variant(variants[i]), board, problem.series.size());
    if (square > 0.0) squares.emplace_back(square, variants[i]);
  }
  if (squares.empty()) return;
  std::sort(squares.begin(), squares.end());
  const auto [square, variant] = squares[squares.size() / 2];
  finding.smallest_rms = options.power_separation / std::sqrt(square);
  const BoardVariant& v = board.variant(variant);
  if (v.columns().size() != 1) return;
  finding.smallest_amplitude = finding.smallest_rms *
                               std::sqrt(static_cast<double>(problem.series.size())) /
                               v.columns().front().norm;
}

}  // namespace zerodrift::diagnosis
