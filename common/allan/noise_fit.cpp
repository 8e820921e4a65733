// SPDX-License-Identifier: Apache-2.0
#include "common/allan/noise_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

#include "common/allan/chi_square.h"
#include "common/core/golden_section.h"

namespace zerodrift::allan {
namespace {

constexpr double kNugget = 0.02;

Eigen::LLT<Eigen::MatrixXd> factored(Eigen::MatrixXd correlation) {
  correlation.diagonal().array() += kNugget;
  return Eigen::LLT<Eigen::MatrixXd>(correlation);
}

PointCovariance before_a_model(const std::vector<AllanPoint>& points) {
  const auto n = static_cast<Eigen::Index>(points.size());
  PointCovariance c{Eigen::VectorXd(n), measured(points), Eigen::MatrixXd::Identity(n, n)};
  for (Eigen::Index i = 0; i < n; ++i) {
    c.degrees_of_freedom(i) = points[static_cast<std::size_t>(i)].degrees_of_freedom;
    c.deviation(i) *= std::sqrt(2.0 / c.degrees_of_freedom(i));
  }
  return c;
}

template <typename F>
Eigen::VectorXd at_taus(const std::vector<AllanPoint>& points, const F& f) {
  Eigen::VectorXd values(static_cast<Eigen::Index>(points.size()));
  for (std::size_t i = 0; i < points.size(); ++i)
    values(static_cast<Eigen::Index>(i)) = f(points[i].tau_s);
  return values;
}

Eigen::VectorXd modelled(const std::vector<AllanPoint>& points, const NoiseModel& model) {
  return at_taus(points, [&](double tau_s) { return model.variance(tau_s); });
}

std::vector<Shape> members(ShapeSet set) {
  std::vector<Shape> shapes;
  for (const Shape shape : kShapes) {
    if (contains(set, shape)) shapes.push_back(shape);
  }
  return shapes;
}

struct Solution {
  ShapeSet active = 0;
  PerShape<double> squares{};
  double residual = std::numeric_limits<double>::infinity();
};

// Exact for so few terms: the best of all subsets whose unconstrained solution is positive. Nothing
// (active = 0) where there is none, which independent points exclude.
Solution non_negative_least_squares(const std::vector<AllanPoint>& points,
                                    const Whitening& whitening, const NoiseModel& model,
                                    ShapeSet allowed) {
  const Design all(points, whitening, model, allowed, false);
  const Eigen::VectorXd b = whitening.of(measured(points));
  const Eigen::MatrixXd normal = all.columns.transpose() * all.columns;
  const Eigen::VectorXd right = all.columns.transpose() * b;
  const double square = b.squaredNorm();
  const std::size_t n = all.shapes.size();
  Solution best;
  for (unsigned subset = (1u << n) - 1u; subset != 0; --subset) {
    std::vector<Eigen::Index> chosen;
    for (std::size_t j = 0; j < n; ++j) {
      if ((subset >> j & 1u) != 0) chosen.push_back(static_cast<Eigen::Index>(j));
    }
    const Eigen::MatrixXd part = normal(chosen, chosen);
    const Eigen::VectorXd part_right = right(chosen);
    const Eigen::VectorXd x = part.ldlt().solve(part_right);
    if (!(x.minCoeff() > 0.0)) continue;
    const double residual = square - x.dot(part_right);
    if (residual >= best.residual) continue;
    best = Solution{0, {}, residual};
    for (std::size_t k = 0; k < chosen.size(); ++k) {
      const Shape shape = all.shapes[static_cast<std::size_t>(chosen[k])];
      best.active |= only(shape);
      best.squares[index(shape)] = x(static_cast<Eigen::Index>(k)) / all.lengths(chosen[k]);
    }
  }
  return best;
}

// Cube roots of variances are close to normal even with two degrees of freedom (Wilson & Hilferty
// 1931): residuals of unit variance without the skew that would pass for evidence at long taus.
Eigen::VectorXd normal_residual(const std::vector<AllanPoint>& points, const FittedModel& fit) {
  const Eigen::VectorXd y = measured(points);
  const Eigen::VectorXd m = modelled(points, fit.model);
  const Eigen::VectorXd& edf = fit.whitening.covariance().degrees_of_freedom;
  Eigen::VectorXd u(y.size());
  for (Eigen::Index i = 0; i < y.size(); ++i) {
    const double spread = 2.0 / (9.0 * edf(i));
    u(i) = (std::cbrt(y(i) / m(i)) - (1.0 - spread)) / std::sqrt(spread);
  }
  return u;
}

double& parameter(NoiseModel& model, Shape shape) {
  return shape == Shape::kSinusoid ? model.frequency_hz : model.time_constant_s;
}

bool has_parameter(Shape shape) {
  return shape == Shape::kSinusoid || shape == Shape::kMarkov;
}

struct Resolvable {
  double least = 1.0;
  double most = 1.0;
};

// Where the curve can show the shape and tell it from the power laws. A sinusoid: the first two
// peaks, at tau f = 0.37 and 1.47, and rates that are not far from means over the sampling
// interval. A Markov noise: rise, peak at 1.9 T and fall; one of T near the shortest tau is white
// noise to all points but the first, and the two would share N as the first points like.
Resolvable resolvable(const std::vector<AllanPoint>& points, Shape shape) {
  const double shortest = points.front().tau_s;
  const double longest = points.back().tau_s;
  if (shape == Shape::kSinusoid) return {1.5 / longest, 0.2 / shortest};
  return {8.0 * shortest, 0.2 * longest};
}

std::vector<double> parameter_grid(const std::vector<AllanPoint>& points, Shape shape) {
  if (!has_parameter(shape)) return {1.0};
  const Resolvable range = resolvable(points, shape);
  const double step = std::exp2(shape == Shape::kSinusoid ? 0.125 : 0.5);
  std::vector<double> grid;
  for (double value = range.least; value <= range.most; value *= step) grid.push_back(value);
  return grid;
}

// Score of a shape that the model lacks: its column's share of the normal residual that the shapes
// of the model cannot take up, in standard deviations under the model without it.
class ScoreTest {
 public:
  ScoreTest(const std::vector<AllanPoint>& points, const FittedModel& fit)
      : points_(points),
        fit_(fit),
        known_(points, fit.whitening, fit.model, fit.allowed, true),
        residual_(fit.whitening.of(
            normal_residual(points, fit).cwiseProduct(fit.whitening.covariance().deviation))) {}

  [[nodiscard]] double score(Shape shape, double value) const {
    NoiseModel candidate = fit_.model;
    if (has_parameter(shape)) parameter(candidate, shape) = value;
    const Eigen::VectorXd column = fit_.whitening.of(
        at_taus(points_, [&](double tau_s) { return candidate.unit_variance(shape, tau_s); }));
    const Eigen::VectorXd own = column - known_.columns * known_.solve_scaled(column);
    if (own.squaredNorm() < 1e-8 * column.squaredNorm()) return 0.0;
    const double variance =
        fit_.whitening.propagated(own.transpose(), fit_.whitening.covariance())(0, 0);
    return own.dot(residual_) / std::sqrt(variance);
  }

 private:
  const std::vector<AllanPoint>& points_;
  const FittedModel& fit_;
  Design known_;
  Eigen::VectorXd residual_;
};

// Standard deviations at which a shape is believed. A one-sided chance of 0.1 % for each shape,
// shared among the independent values of its parameter that a record offers - some 20 frequencies,
// 6 time constants - would be 3.1, 3.9 and 3.6; what is above that answers for the tabulated
// correlations and their tails. Tuned on simulated records (5 h, 20 Hz): with 3.3 and 4.3, 1 of 300
// of N, B and K, 5 of 300 of N and 7 of 300 of N and K got a further term, each time a sinusoid;
// with these, on other records, 0, 2 and 1.
double believed_at(Shape shape) {
  switch (shape) {
    case Shape::kSinusoid: return 4.8;
    case Shape::kMarkov: return 4.3;
    default: return 3.3;
  }
}

struct Candidate {
  Shape shape = Shape::kQuantization;
  double value = 1.0;
  double excess = 0.0;
};

}  // namespace

double misfit(const std::vector<AllanPoint>& points, const FittedModel& fit) {
  const PointCovariance& c = fit.whitening.covariance();
  const Eigen::VectorXd u = normal_residual(points, fit);
  const Eigen::VectorXd m = modelled(points, fit.model);
  return fit.whitening.of(u.cwiseProduct(c.deviation)).squaredNorm() +
         fit.whitening.log_determinant() + 2.0 / 3.0 * m.array().log().sum() -
         c.degrees_of_freedom.array().log().sum();
}

Eigen::VectorXd measured(const std::vector<AllanPoint>& points) {
  Eigen::VectorXd y(static_cast<Eigen::Index>(points.size()));
  for (std::size_t i = 0; i < points.size(); ++i)
    y(static_cast<Eigen::Index>(i)) = points[i].deviation_radps * points[i].deviation_radps;
  return y;
}

Whitening::Whitening(const std::vector<AllanPoint>& points, const NoiseModel& model)
    : covariance_(point_covariance(points, model, ShapeTrust::kCautious)),
      factor_(factored(covariance_.correlation)) {}

Whitening::Whitening(const std::vector<AllanPoint>& points)
    : covariance_(before_a_model(points)), factor_(factored(covariance_.correlation)) {}

Eigen::VectorXd Whitening::of(const Eigen::VectorXd& values) const {
  return factor_.matrixL().solve(values.cwiseQuotient(covariance_.deviation));
}

double Whitening::log_determinant() const {
  return 2.0 * factor_.matrixLLT().diagonal().array().log().sum();
}

Eigen::MatrixXd Whitening::propagated(const Eigen::MatrixXd& gain,
                                      const PointCovariance& truth) const {
  // gain L⁻¹ D⁻¹ D_t C_t D_t D⁻¹ L⁻ᵀ gain'
  Eigen::MatrixXd weights = factor_.matrixU().solve(gain.transpose());
  weights.array().colwise() *= truth.deviation.cwiseQuotient(covariance_.deviation).array();
  return weights.transpose() * truth.correlation * weights;
}

Design::Design(const std::vector<AllanPoint>& points, const Whitening& whitening,
               const NoiseModel& model, ShapeSet set, bool with_parameters)
    : shapes(members(set)) {
  for (const Shape shape : shapes) {
    if (with_parameters && has_parameter(shape) && model.squares[index(shape)] > 0.0)
      parameters.push_back(shape);
  }
  const auto rows = static_cast<Eigen::Index>(points.size());
  columns.resize(rows, static_cast<Eigen::Index>(shapes.size() + parameters.size()));
  Eigen::Index j = 0;
  for (const Shape shape : shapes) {
    columns.col(j++) = whitening.of(
        at_taus(points, [&](double tau_s) { return model.unit_variance(shape, tau_s); }));
  }
  for (const Shape shape : parameters) {
    columns.col(j++) = whitening.of(at_taus(
        points, [&](double tau_s) { return model.variance_by_log_parameter(shape, tau_s); }));
  }
  lengths = columns.colwise().norm();
  columns.array().rowwise() /= lengths.transpose().array();
  normal.compute(columns.transpose() * columns);
}

Eigen::VectorXd Design::solve_scaled(const Eigen::VectorXd& whitened) const {
  return normal.solve(columns.transpose() * whitened);
}

Eigen::VectorXd Design::solve(const Eigen::VectorXd& whitened) const {
  return solve_scaled(whitened).cwiseQuotient(lengths);
}

Eigen::MatrixXd Design::gain() const {
  Eigen::MatrixXd g = normal.solve(columns.transpose());
  g.array().colwise() /= lengths.array();
  return g;
}

FittedModel fit_model(const std::vector<AllanPoint>& points, ShapeSet allowed,
                      const NoiseModel& start, int max_iterations) {
  constexpr double kConverged = 1e-7;
  constexpr int kUndampedRounds = 10;
  const bool has_start = start.variance(points.front().tau_s) > 0.0;
  FittedModel fit{start, allowed, 0, has_start ? Whitening(points, start) : Whitening(points)};
  NoiseModel weights = start;
  Eigen::VectorXd before = has_start ? modelled(points, start) : measured(points);
  while (!fit.converged && fit.iterations < max_iterations) {
    if (fit.iterations++ > 0) fit.whitening = Whitening(points, weights);
    const Solution solution = non_negative_least_squares(points, fit.whitening, start, allowed);
    if (solution.active == 0) break;  // the last model stands
    fit.active = solution.active;
    fit.model.squares = solution.squares;
    fit.residual = std::max(solution.residual, 0.0);
    const Eigen::VectorXd after = modelled(points, fit.model);
    fit.converged = (after.cwiseQuotient(before).array() - 1.0).abs().maxCoeff() < kConverged;
    // A term that comes and goes at the boundary makes the weights swing: meet in the middle.
    const double step = fit.iterations < kUndampedRounds ? 1.0 : 0.5;
    for (std::size_t i = 0; i < kShapeCount; ++i)
      weights.squares[i] += step * (fit.model.squares[i] - weights.squares[i]);
    before = modelled(points, weights);
  }
  return fit;
}

namespace {

// The last digits of the frequency or time constant, from the linearised fit.
FittedModel newton_steps(const std::vector<AllanPoint>& points, FittedModel fit, Shape shape,
                         int max_iterations) {
  constexpr int kSteps = 3;
  constexpr double kLargest = 0.01;
  for (int step = 0; step < kSteps && contains(fit.active, shape); ++step) {
    const Design design(points, fit.whitening, fit.model, fit.active, true);
    const auto at = std::find(design.parameters.begin(), design.parameters.end(), shape);
    const auto column = static_cast<Eigen::Index>(design.shapes.size()) +
                        std::distance(design.parameters.begin(), at);
    const double change = design.solve(fit.whitening.of(measured(points)))(column);
    NoiseModel start = fit.model;
    parameter(start, shape) *= std::exp(std::clamp(change, -kLargest, kLargest));
    fit = fit_model(points, fit.allowed, start, max_iterations);
  }
  return fit;
}

}  // namespace

FittedModel refined(const std::vector<AllanPoint>& points, FittedModel fit, int max_iterations) {
  constexpr double kFine = 5e-3;
  constexpr int kRoughRounds = 8;
  for (const Shape shape : {Shape::kSinusoid, Shape::kMarkov}) {
    if (!contains(fit.active, shape)) continue;
    // Octaves. The score is taken from a model that other terms have bent: most where a slow hump
    // was taken for K.
    const double range = shape == Shape::kMarkov ? 2.0 : 0.5;
    const double coarse = shape == Shape::kMarkov ? 0.25 : 0.125;
    const auto moved = [&](double octaves, int rounds) {
      NoiseModel start = fit.model;
      parameter(start, shape) *= std::exp2(octaves);
      start.squares = {};  // a model bent by a wrong parameter would justify itself
      return fit_model(points, fit.allowed, start, rounds);
    };
    const auto cost = [&](double octaves) { return misfit(points, moved(octaves, kRoughRounds)); };
    double best = 0.0;
    double lowest = std::numeric_limits<double>::infinity();
    for (double octaves = -range; octaves <= range; octaves += coarse) {
      const double c = cost(octaves);
      if (!(c < lowest)) continue;
      lowest = c;
      best = octaves;
    }
    const double narrowings = std::log(kFine / (2.0 * coarse)) / std::log(core::kGoldenRatio);
    const auto found = core::golden_section(best - coarse, best + coarse,
                                            2 + static_cast<int>(std::ceil(narrowings)), cost);
    fit = moved(0.5 * (found.low + found.high), max_iterations);
    fit = newton_steps(points, std::move(fit), shape, max_iterations);
  }
  return fit;
}

bool is_resolved(const std::vector<AllanPoint>& points, const FittedModel& fit) {
  const auto inside = [&](Shape shape, double value) {
    const Resolvable range = resolvable(points, shape);
    return !contains(fit.active, shape) || (value >= range.least && value <= range.most);
  };
  return inside(Shape::kSinusoid, fit.model.frequency_hz) &&
         inside(Shape::kMarkov, fit.model.time_constant_s);
}

std::optional<FittedModel> with_missing_shape(const std::vector<AllanPoint>& points,
                                              const FittedModel& fit, ShapeSet candidates,
                                              int max_iterations) {
  const ScoreTest test(points, fit);
  std::optional<Candidate> best;
  for (const Shape shape : kShapes) {
    if (!contains(candidates & ~fit.allowed, shape)) continue;
    for (const double value : parameter_grid(points, shape)) {
      const double excess = test.score(shape, value) - believed_at(shape);
      if (excess > (best ? best->excess : 0.0)) best = Candidate{shape, value, excess};
    }
  }
  if (!best) return std::nullopt;
  NoiseModel start = fit.model;
  start.squares = {};
  if (has_parameter(best->shape)) parameter(start, best->shape) = best->value;
  return refined(points, fit_model(points, fit.allowed | only(best->shape), start, max_iterations),
                 max_iterations);
}

bool is_too_high(const std::vector<AllanPoint>& points, const FittedModel& fit) {
  constexpr double kChance = 1e-4;
  const Eigen::VectorXd y = measured(points);
  const Eigen::VectorXd m = modelled(points, fit.model);
  const Eigen::VectorXd& edf = fit.whitening.covariance().degrees_of_freedom;
  for (Eigen::Index i = 0; i < y.size(); ++i) {
    if (edf(i) * y(i) < chi_square_quantile(kChance, edf(i)) * m(i)) return true;
  }
  return false;
}

std::optional<FittedModel> with_markov_for_growth(const std::vector<AllanPoint>& points,
                                                  const FittedModel& fit, int max_iterations) {
  const ShapeSet with = fit.allowed | only(Shape::kMarkov);
  const ShapeSet without = with & ~(only(Shape::kRateRandomWalk) | only(Shape::kRateRamp));
  std::optional<FittedModel> best;
  double lowest = std::numeric_limits<double>::infinity();
  for (const double time_constant_s : parameter_grid(points, Shape::kMarkov)) {
    NoiseModel start = fit.model;
    start.squares = {};
    start.time_constant_s = time_constant_s;
    FittedModel one = fit_model(points, without, start, max_iterations);
    const double cost = misfit(points, one);
    if (!contains(one.active, Shape::kMarkov) || !(cost < lowest)) continue;
    lowest = cost;
    best = std::move(one);
  }
  if (!best) return std::nullopt;
  *best = refined(points, *std::move(best), max_iterations);
  *best = fit_model(points, with, best->model, max_iterations);
  return contains(best->active, Shape::kMarkov) ? std::move(best) : std::nullopt;
}

}  // namespace zerodrift::allan
