// SPDX-License-Identifier: Apache-2.0
#include "common/regression/kernel_selection.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "common/core/golden_section.h"
#include "common/regression/kernel_samples.h"
#include "common/regression/tridiagonal.h"

namespace zerodrift::regression {
namespace {

// Ridges are searched relative to the mean of the contrasts' Gram diagonal. Targets of 100 with a
// noise of 0.01 have a ratio of variances of 1e-8; at 10 the noise is all there is.
constexpr double kLowestRelativeRidge = 1e-9;
constexpr double kHighestRelativeRidge = 10.0;
constexpr std::size_t kRidgeGridPoints = 2 * kRidgesAtOnce;
constexpr int kRidgeRefinements = 2;       // to a factor of 10^(10 / 15 (2 / 9)^2) = 1.08
constexpr double kGammasInADecade = 2.0;   // of the grid; of polynomials, whose terms gamma only
constexpr double kPolynomialGammas = 1.0;  // weighs, fewer
constexpr int kGammaRefinements = 6;       // to a factor of 10^(0.618^6) = 1.14

// Below this the tridiagonal factor is rounding.
constexpr double kSmallestRelativeRidge = 1e-12;

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// I - tau v v' with v_0 = 1: maps the roots of the weights to a multiple of the first axis, so that
// what is left without that axis are the contrasts.
struct Reflection {
  VectorXd essential;
  double tau = 0.0;

  template <typename Matrix>
  void apply_on_the_left(Matrix&& matrix) const {
    VectorXd workspace(matrix.cols());
    matrix.applyHouseholderOnTheLeft(essential, tau, workspace.data());
  }
  template <typename Matrix>
  void apply_on_the_right(Matrix&& matrix) const {
    VectorXd workspace(matrix.rows());
    matrix.applyHouseholderOnTheRight(essential, tau, workspace.data());
  }
};

// A batch made ready: the dictionary, and its targets scaled to unit variance as contrasts of unit
// noise.
struct Problem {
  Cells dictionary;
  VectorXd root_weights;
  Reflection reflection;
  VectorXd contrasts;
  double target_scale = 0.0;    // standard deviation of the dictionary's targets
  double noise_variance = 0.0;  // of a single label, in scaled units
};

Problem make_problem(const KernelSelectionOptions& options, Cells dictionary) {
  Problem problem;
  const auto n = static_cast<Index>(dictionary.size());
  problem.root_weights = Eigen::Map<const VectorXd>(dictionary.weights.data(), n).cwiseSqrt();
  problem.reflection.essential.resize(n - 1);
  double norm = 0.0;
  problem.root_weights.makeHouseholder(problem.reflection.essential, problem.reflection.tau, norm);

  const Eigen::Map<const VectorXd> targets(dictionary.targets.data(), n);
  const VectorXd centred = targets.array() - targets.mean();
  problem.target_scale = std::sqrt(centred.squaredNorm() / static_cast<double>(n - 1));
  if (problem.target_scale > 0.0) {
    VectorXd whitened = centred.cwiseProduct(problem.root_weights) / problem.target_scale;
    problem.reflection.apply_on_the_left(whitened);
    problem.contrasts = whitened.tail(n - 1);
    const double noise = options.label_noise / problem.target_scale;
    problem.noise_variance = noise * noise;
  }
  problem.dictionary = std::move(dictionary);
  return problem;
}

// Weighted Gram matrix, reflected; its first row and column belong to the mean.
MatrixXd reflected_gram(const Problem& problem, const Kernel& kernel) {
  const Cells& dictionary = problem.dictionary;
  const auto n = static_cast<Index>(dictionary.size());
  MatrixXd gram(n, n);
  double x[kMaxDimension];
  for (Index i = 0; i < n; ++i) {
    const auto first = static_cast<std::size_t>(i);
    dictionary.gather(first, x);
    SampleColumns below = dictionary.columns();
    below.data += first;
    below.count -= first;
    evaluate_row(kernel, below, x, &gram(i, i));
    gram.col(i).tail(n - i).array() *=
        problem.root_weights.tail(n - i).array() * problem.root_weights[i];
    gram.row(i).tail(n - i) = gram.col(i).tail(n - i);
  }
  problem.reflection.apply_on_the_left(gram);
  problem.reflection.apply_on_the_right(gram);
  return gram;
}

// Q' B Q / scale = T tridiagonal, B the contrasts' Gram matrix.
struct Reduced {
  VectorXd diagonal, subdiagonal;
  VectorXd targets;     // Q' contrasts
  MatrixXd directions;  // row i: sample i in the coordinates of T; leave one out only
  double scale = 0.0;   // mean of B's diagonal; 0 if the kernel can't be used
};

Reduced reduce(const Problem& problem, const Kernel& kernel, bool with_directions) {
  Reduced reduced;
  const MatrixXd gram = reflected_gram(problem, kernel);
  const Index n = gram.rows(), m = n - 1;
  const double scale = gram.diagonal().tail(m).mean();
  if (!(scale > 0.0) || !gram.allFinite()) return reduced;
  const Eigen::Tridiagonalization<MatrixXd> tridiagonal(gram.bottomRightCorner(m, m) / scale);
  reduced.scale = scale;
  reduced.diagonal = tridiagonal.diagonal();
  reduced.subdiagonal = tridiagonal.subDiagonal();
  reduced.targets = tridiagonal.matrixQ().adjoint() * problem.contrasts;
  if (with_directions) {
    reduced.directions = MatrixXd::Zero(n, m);
    reduced.directions.bottomRows(m) = MatrixXd(tridiagonal.matrixQ());
    problem.reflection.apply_on_the_left(reduced.directions);
  }
  return reduced;
}

// No kernel at all: noise around a mean.
Reduced reduce_constant(const Problem& problem, bool with_directions) {
  Reduced reduced;
  const Index m = problem.contrasts.size();
  reduced.scale = 1.0;
  reduced.diagonal = VectorXd::Zero(m);
  reduced.subdiagonal = VectorXd::Zero(m - 1);
  reduced.targets = problem.contrasts;
  if (with_directions) {
    reduced.directions = MatrixXd::Zero(m + 1, m);
    reduced.directions.bottomRows(m).setIdentity();
    problem.reflection.apply_on_the_left(reduced.directions);
  }
  return reduced;
}

struct Cost {
  double nats = std::numeric_limits<double>::infinity();
  double signal_variance = 0.0;  // s², of the scaled targets, for T
};

// The mean square that minimises the cost, unless the noise would fall below the label noise.
double signal_variance(const Problem& problem, double mean_square, double relative_ridge) {
  return std::max(
      {mean_square, problem.noise_variance / relative_ridge, std::numeric_limits<double>::min()});
}

// L D L' of T + ridge, on the way through it c = L^-1 targets.
struct Elimination {
  VectorXd pivots;   // D
  VectorXd factors;  // below the diagonal of L
  VectorXd targets;  // c
};

Elimination eliminate(const Reduced& reduced, double relative_ridge) {
  const Index m = reduced.diagonal.size();
  Elimination result{VectorXd(m), VectorXd(m - 1), VectorXd(m)};
  result.pivots[0] = reduced.diagonal[0] + relative_ridge;
  result.targets[0] = reduced.targets[0];
  for (Index k = 1; k < m; ++k) {
    const double below = reduced.subdiagonal[k - 1];
    const double factor = below / result.pivots[k - 1];
    result.factors[k - 1] = factor;
    result.pivots[k] = (reduced.diagonal[k] + relative_ridge) - below * factor;
    result.targets[k] = reduced.targets[k] - factor * result.targets[k - 1];
  }
  return result;
}

double squared_norm(const Elimination& elimination) {
  return (elimination.targets.array().square() / elimination.pivots.array()).sum();
}

Cost paper_cost(const Reduced& reduced, double relative_ridge) {
  const double norm = squared_norm(eliminate(reduced, relative_ridge));
  const auto m = static_cast<double>(reduced.diagonal.size());
  return {0.5 * m * std::log(norm / reduced.scale), norm / m};
}

// Of log |T + ridge| and y' (T + ridge)^-1 y.
Cost marginal_likelihood_cost(const Problem& problem, double log_determinant, double norm,
                              double relative_ridge) {
  const auto m = static_cast<double>(problem.contrasts.size());
  const double variance = signal_variance(problem, norm / m, relative_ridge);
  return {0.5 * (m * std::log(variance) + log_determinant + norm / variance), variance};
}

Cost marginal_likelihood_cost(const Problem& problem, const Reduced& reduced,
                              double relative_ridge) {
  const Elimination elimination = eliminate(reduced, relative_ridge);
  return marginal_likelihood_cost(problem, elimination.pivots.array().log().sum(),
                                  squared_norm(elimination), relative_ridge);
}

// P_ii = sum_k g_ik² / D_k and (P y)_i = sum_k g_ik c_k / D_k with g_i = L^-1 directions_i.
double leave_one_out_nats(const Reduced& reduced, double relative_ridge) {
  const Elimination elimination = eliminate(reduced, relative_ridge);
  const Index n = reduced.directions.rows(), m = reduced.directions.cols();
  Eigen::ArrayXd column = reduced.directions.col(0).array();
  Eigen::ArrayXd precision = column.square() / elimination.pivots[0];
  Eigen::ArrayXd product = column * (elimination.targets[0] / elimination.pivots[0]);
  for (Index k = 1; k < m; ++k) {
    column = reduced.directions.col(k).array() - elimination.factors[k - 1] * column;
    precision += column.square() / elimination.pivots[k];
    product += column * (elimination.targets[k] / elimination.pivots[k]);
  }
  const double sum_of_squares = (product / precision).square().sum();
  return 0.5 * static_cast<double>(n) * std::log(sum_of_squares / static_cast<double>(n));
}

// A minimum on a logarithmic grid, then on finer ones between the best point's neighbours: ridges
// side by side cost little more than one.
double likeliest_ridge(const Problem& problem, const Reduced& reduced) {
  const auto size = static_cast<std::size_t>(reduced.diagonal.size());
  double best = kLowestRelativeRidge;
  double least = std::numeric_limits<double>::infinity();
  const auto consider = [&](const ByRidge& ridges) {
    const RidgeFigures figures =
        figures_of({{reduced.diagonal.data(), size}, {reduced.subdiagonal.data(), size - 1}},
                   {reduced.targets.data(), size}, ridges);
    for (std::size_t i = 0; i < kRidgesAtOnce; ++i) {
      const double nats = marginal_likelihood_cost(problem, figures.log_determinant[i],
                                                   figures.squared_norm[i], ridges[i])
                              .nats;
      if (!(nats < least)) continue;
      least = nats;
      best = ridges[i];
    }
  };
  const double low = std::log(kLowestRelativeRidge), high = std::log(kHighestRelativeRidge);
  double spacing = (high - low) / static_cast<double>(kRidgeGridPoints - 1);
  ByRidge ridges{};
  for (std::size_t i = 0; i < kRidgeGridPoints; ++i) {
    ridges[i % kRidgesAtOnce] = std::exp(low + spacing * static_cast<double>(i));
    if ((i + 1) % kRidgesAtOnce == 0) consider(ridges);
  }
  for (int refinement = 0; refinement < kRidgeRefinements; ++refinement) {
    const double lowest = std::max(low, std::log(best) - spacing);
    const double highest = std::min(high, std::log(best) + spacing);
    spacing = (highest - lowest) / static_cast<double>(kRidgesAtOnce + 1);
    for (std::size_t i = 0; i < kRidgesAtOnce; ++i)
      ridges[i] = std::exp(lowest + spacing * static_cast<double>(i + 1));
    consider(ridges);
  }
  return best;
}

// The known one for the paper's criterion, otherwise that of the largest marginal likelihood.
double relative_ridge_of(const KernelSelectionOptions& options, const Problem& problem,
                         const Reduced& reduced) {
  if (options.criterion == SelectionCriterion::kPaper) {
    return std::max(problem.noise_variance / reduced.scale, kSmallestRelativeRidge);
  }
  return likeliest_ridge(problem, reduced);
}

Cost cost_at(const KernelSelectionOptions& options, const Problem& problem, const Reduced& reduced,
             double relative_ridge) {
  if (options.criterion == SelectionCriterion::kPaper) return paper_cost(reduced, relative_ridge);
  Cost cost = marginal_likelihood_cost(problem, reduced, relative_ridge);
  if (options.criterion == SelectionCriterion::kLeaveOneOut) {
    cost.nats = leave_one_out_nats(reduced, relative_ridge);
  }
  return cost;
}

KernelChoice scored(const KernelSelectionOptions& options, const Problem& problem,
                    const Kernel& kernel) {
  KernelChoice choice;
  choice.kernel = kernel;
  const bool with_directions = options.criterion == SelectionCriterion::kLeaveOneOut;
  const Reduced reduced = reduce(problem, kernel, with_directions);
  if (!(reduced.scale > 0.0)) return choice;
  const double relative_ridge = relative_ridge_of(options, problem, reduced);
  const Cost cost = cost_at(options, problem, reduced, relative_ridge);
  if (!std::isfinite(cost.nats)) return choice;
  choice.score = cost.nats;
  choice.ridge = relative_ridge * reduced.scale;
  choice.signal_sigma = problem.target_scale * std::sqrt(cost.signal_variance / reduced.scale);
  choice.noise_sigma = problem.target_scale * std::sqrt(cost.signal_variance * relative_ridge);
  return choice;
}

// Of a logarithmic grid; if that is below refined_below, by golden section between the best point's
// neighbours, where it has two: what falls up to an end of the range is least there. A cost that
// isn't finite never wins.
KernelChoice best_gamma(const KernelSelectionOptions& options, const Problem& problem,
                        Kernel kernel, double refined_below) {
  KernelChoice best;
  best.kernel = kernel;
  best.kernel.gamma = options.gamma_lowest;
  const auto score_at = [&](double gamma) {
    kernel.gamma = gamma;
    const KernelChoice choice = scored(options, problem, kernel);
    if (choice.score < best.score) best = choice;
    return choice.score;
  };
  const double decades = std::log10(options.gamma_highest / options.gamma_lowest);
  const double in_a_decade = kernel.is_stationary() ? kGammasInADecade : kPolynomialGammas;
  const double intervals = std::max(1.0, std::ceil(in_a_decade * decades));
  const double low = std::log(options.gamma_lowest), high = std::log(options.gamma_highest);
  const double spacing = (high - low) / intervals;
  score_at(options.gamma_lowest);
  for (double i = 1.0; i < intervals; i += 1.0) score_at(std::exp(low + spacing * i));
  score_at(options.gamma_highest);
  const bool is_between =
      best.kernel.gamma > options.gamma_lowest && best.kernel.gamma < options.gamma_highest;
  if (!is_between || !(best.score < refined_below)) return best;

  const double around = std::log(best.kernel.gamma);
  core::golden_section(around - spacing, around + spacing, kGammaRefinements + 1,
                       [&](double argument) { return score_at(std::exp(argument)); });
  return best;
}

double constant_score(const KernelSelectionOptions& options, const Problem& problem) {
  const bool with_directions = options.criterion == SelectionCriterion::kLeaveOneOut;
  const Reduced reduced = reduce_constant(problem, with_directions);
  return cost_at(options, problem, reduced, relative_ridge_of(options, problem, reduced)).nats;
}

struct Preparation {
  SelectionStatus status = SelectionStatus::kRefused;
  Problem problem;
};

Preparation prepare(const KernelSelectionOptions& options, const SampleColumns& samples,
                    std::span<const double> targets) {
  Preparation preparation;
  if (options.validate() || !is_acceptable(samples, targets)) return preparation;
  const Cells singles = sorted(samples, targets);
  const Partition partition = spread_partition(singles, options.dictionary_capacity);
  preparation.status = SelectionStatus::kTooFewSamples;
  if (partition.cell_count < kFewestSamples) return preparation;
  preparation.problem = make_problem(options, condensed(singles, partition));
  // A spread below this is the rounding of the means.
  const double largest =
      Eigen::Map<const VectorXd>(targets.data(), static_cast<Index>(targets.size()))
          .cwiseAbs()
          .maxCoeff();
  const bool varies = preparation.problem.target_scale > 1e-12 * largest;
  preparation.status = varies ? SelectionStatus::kSelected : SelectionStatus::kDegenerateTargets;
  return preparation;
}

constexpr std::array<Kernel, kFamilySize> kFamily{{
    {KernelKind::kRbf},
    {KernelKind::kMatern32},
    {KernelKind::kMatern52},
    {KernelKind::kPolynomial, 1.0, 2},
    {KernelKind::kPolynomial, 1.0, 3},
    {KernelKind::kLinear},
}};

}  // namespace

std::optional<std::string> KernelSelectionOptions::validate() const {
  if (!(std::isfinite(label_noise) && label_noise >= 0.0)) {
    return "label_noise: found " + std::to_string(label_noise) +
           ", expected a number of at least 0";
  }
  if (dictionary_capacity < kFewestSamples || dictionary_capacity > 1000) {
    return "dictionary_capacity: found " + std::to_string(dictionary_capacity) + ", expected " +
           std::to_string(kFewestSamples) + " to 1000";
  }
  if (!(std::isfinite(gamma_lowest) && gamma_lowest > 0.0)) {
    return "gamma_lowest: found " + std::to_string(gamma_lowest) + ", expected a number above 0";
  }
  if (!(std::isfinite(gamma_highest) && gamma_highest > gamma_lowest)) {
    return "gamma_highest: found " + std::to_string(gamma_highest) +
           ", expected a number above gamma_lowest, " + std::to_string(gamma_lowest);
  }
  if (!(std::isfinite(margin_nats) && margin_nats >= 0.0)) {
    return "margin_nats: found " + std::to_string(margin_nats) +
           ", expected a number of at least 0";
  }
  return std::nullopt;
}

KernelSelection select_kernel(const KernelSelectionOptions& options, const SampleColumns& samples,
                              std::span<const double> targets,
                              const std::optional<Kernel>& present) {
  KernelSelection selection;
  const Preparation preparation = prepare(options, samples, targets);
  selection.status = preparation.status;
  if (selection.status != SelectionStatus::kSelected) return selection;
  const Problem& problem = preparation.problem;
  selection.dictionary_size = problem.dictionary.size();
  selection.constant_score = constant_score(options, problem);
  if (present && !present->validate()) selection.present = scored(options, problem, *present);
  double refined_below = selection.present.score;
  for (std::size_t i = 0; i < kFamilySize; ++i) {
    selection.family[i] = kFamily[i].kind == KernelKind::kLinear
                              ? scored(options, problem, kFamily[i])
                              : best_gamma(options, problem, kFamily[i], refined_below);
    // Of the others, those that can still beat the RBF.
    refined_below = std::min(refined_below, selection.family[0].score + options.margin_nats);
  }
  selection.best = selection.family[0];
  const double score_to_beat = selection.family[0].score - options.margin_nats;
  for (const KernelChoice& choice : selection.family) {
    if (choice.score < std::min(score_to_beat, selection.best.score)) selection.best = choice;
  }
  if (!(selection.best.score < selection.constant_score - options.margin_nats)) {
    selection.status = SelectionStatus::kNoSignal;
  }
  return selection;
}

bool is_materially_better(const KernelSelectionOptions& options,
                          const KernelSelection& selection) noexcept {
  return selection.status == SelectionStatus::kSelected &&
         selection.best.score < selection.present.score - options.margin_nats;
}

}  // namespace zerodrift::regression
