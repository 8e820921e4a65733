// SPDX-License-Identifier: Apache-2.0
#include "common/allan/coefficients.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <utility>
#include <vector>

#include "common/allan/chi_square.h"

namespace zerodrift::allan {
namespace {

constexpr double kBiasVariance = 2.0 * std::numbers::ln2 / std::numbers::pi;  // 0.664²

using TermSet = unsigned;  // bit index(term)

constexpr bool contains(TermSet set, NoiseTerm term) {
  return (set >> index(term) & 1u) != 0;
}

TermSet term_set(const PerNoiseTerm<bool>& fitted) {
  TermSet set = 0;
  for (const NoiseTerm term : kNoiseTerms) set |= fitted[index(term)] ? 1u << index(term) : 0u;
  return set;
}

std::vector<NoiseTerm> members(TermSet set) {
  std::vector<NoiseTerm> terms;
  for (const NoiseTerm term : kNoiseTerms) {
    if (contains(set, term)) terms.push_back(term);
  }
  return terms;
}

std::vector<AllanPoint> usable(std::span<const AllanPoint> points, double min_degrees_of_freedom) {
  std::vector<AllanPoint> result;
  std::copy_if(points.begin(), points.end(), std::back_inserter(result), [&](const AllanPoint& p) {
    return p.degrees_of_freedom >= min_degrees_of_freedom && p.deviation_radps > 0.0 &&
           std::isfinite(p.deviation_radps);
  });
  return result;
}

// Squared coefficients; 0 for terms outside the set.
using Squares = PerNoiseTerm<double>;

double squared_model(const Squares& squares, double tau_s) {
  double sum = 0.0;
  for (const NoiseTerm term : kNoiseTerms) sum += squares[index(term)] * unit_variance(term, tau_s);
  return sum;
}

// Rows scaled to unit variance: x minimises |A x - b|².
struct Weighted {
  Eigen::MatrixXd a;  // points x all terms
  Eigen::VectorXd b;
};

Weighted weigh(const std::vector<AllanPoint>& points, const std::vector<double>& variances) {
  const auto rows = static_cast<Eigen::Index>(points.size());
  Weighted w{Eigen::MatrixXd(rows, Eigen::Index{kNoiseTermCount}), Eigen::VectorXd(rows)};
  for (Eigen::Index i = 0; i < rows; ++i) {
    const AllanPoint& p = points[static_cast<std::size_t>(i)];
    const double scale =
        std::sqrt(0.5 * p.degrees_of_freedom) / variances[static_cast<std::size_t>(i)];
    for (const NoiseTerm term : kNoiseTerms) {
      w.a(i, static_cast<Eigen::Index>(index(term))) = scale * unit_variance(term, p.tau_s);
    }
    w.b(i) = scale * p.deviation_radps * p.deviation_radps;
  }
  return w;
}

// Columns of the set, each scaled to length 1 so that the normal equations are well conditioned.
struct Columns {
  std::vector<NoiseTerm> terms;
  Eigen::MatrixXd a;
  Eigen::VectorXd lengths;
  Eigen::LDLT<Eigen::MatrixXd> normal;

  Columns(const Weighted& w, TermSet set) : terms(members(set)) {
    const auto n = static_cast<Eigen::Index>(terms.size());
    a.resize(w.a.rows(), n);
    lengths.resize(n);
    for (Eigen::Index j = 0; j < n; ++j) {
      const auto column =
          w.a.col(static_cast<Eigen::Index>(index(terms[static_cast<std::size_t>(j)])));
      lengths(j) = column.norm();
      a.col(j) = column / lengths(j);
    }
    normal.compute(a.transpose() * a);
  }

  [[nodiscard]] Squares solve(const Eigen::VectorXd& b) const {
    const Eigen::VectorXd x = normal.solve(a.transpose() * b);
    Squares squares{};
    for (std::size_t j = 0; j < terms.size(); ++j) {
      const auto row = static_cast<Eigen::Index>(j);
      squares[index(terms[j])] = x(row) / lengths(row);
    }
    return squares;
  }
};

struct Solution {
  TermSet active = 0;
  Squares squares{};
  double residual = std::numeric_limits<double>::infinity();
};

double squared_residual(const Weighted& w, const Squares& squares) {
  const Eigen::Map<const Eigen::VectorXd> x(squares.data(), Eigen::Index{kNoiseTermCount});
  return (w.a * x - w.b).squaredNorm();
}

// Exact for so few terms: the best of all subsets whose unconstrained solution is positive.
Solution non_negative_least_squares(const Weighted& w, TermSet allowed) {
  Solution best;
  for (TermSet set = allowed; set != 0; set = (set - 1) & allowed) {
    Solution candidate{set, Columns(w, set).solve(w.b), 0.0};
    const auto positive = [&](NoiseTerm term) {
      return !contains(set, term) || candidate.squares[index(term)] > 0.0;
    };
    if (!std::all_of(kNoiseTerms.begin(), kNoiseTerms.end(), positive)) continue;
    candidate.residual = squared_residual(w, candidate.squares);
    if (candidate.residual < best.residual) best = candidate;
  }
  return best;
}

std::vector<double> measured_variances(const std::vector<AllanPoint>& points) {
  std::vector<double> variances;
  variances.reserve(points.size());
  for (const AllanPoint& p : points) variances.push_back(p.deviation_radps * p.deviation_radps);
  return variances;
}

std::vector<double> modelled_variances(const std::vector<AllanPoint>& points,
                                       const Squares& squares) {
  std::vector<double> variances;
  variances.reserve(points.size());
  for (const AllanPoint& p : points) variances.push_back(squared_model(squares, p.tau_s));
  return variances;
}

double largest_relative_change(const std::vector<double>& before,
                               const std::vector<double>& after) {
  double largest = 0.0;
  for (std::size_t i = 0; i < before.size(); ++i)
    largest = std::max(largest, std::abs(after[i] / before[i] - 1.0));
  return largest;
}

// Correlation of two points of a mixture: amplitudes of the pure noises' correlations, weighed by
// their share of the variance at both taus (exact for a pure noise and for equal taus).
double mixed_correlation(const Squares& squares, double tau_a_s, double tau_b_s) {
  const double norm = std::sqrt(squared_model(squares, tau_a_s) * squared_model(squares, tau_b_s));
  double amplitude = 0.0;
  for (const NoiseTerm term : kNoiseTerms) {
    const double share = squares[index(term)] *
                         std::sqrt(unit_variance(term, tau_a_s) * unit_variance(term, tau_b_s)) /
                         norm;
    if (share > 0.0) amplitude += share * std::sqrt(variance_correlation(term, tau_b_s / tau_a_s));
  }
  return amplitude * amplitude;
}

Eigen::MatrixXd correlation_matrix(const std::vector<AllanPoint>& points, const Squares& squares) {
  const auto n = static_cast<Eigen::Index>(points.size());
  Eigen::MatrixXd c = Eigen::MatrixXd::Identity(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < i; ++j) {
      c(i, j) = c(j, i) = mixed_correlation(squares, points[static_cast<std::size_t>(j)].tau_s,
                                            points[static_cast<std::size_t>(i)].tau_s);
    }
  }
  return c;
}

// Standard errors of the squared coefficients where the true ones are `truth` and the rows were
// scaled by `variances`: the sandwich (A'A)^-1 A' S C S A (A'A)^-1. 0 for terms outside the set.
Squares standard_errors(const Columns& columns, const std::vector<AllanPoint>& points,
                        const std::vector<double>& variances, const Squares& truth) {
  Eigen::MatrixXd gain = columns.normal.solve(columns.a.transpose());
  for (std::size_t i = 0; i < points.size(); ++i) {
    gain.col(static_cast<Eigen::Index>(i)) *= squared_model(truth, points[i].tau_s) / variances[i];
  }
  const Eigen::MatrixXd covariance = gain * correlation_matrix(points, truth) * gain.transpose();
  Squares errors{};
  for (std::size_t j = 0; j < columns.terms.size(); ++j) {
    const auto row = static_cast<Eigen::Index>(j);
    errors[index(columns.terms[j])] =
        std::sqrt(std::max(covariance(row, row), 0.0)) / columns.lengths(row);
  }
  return errors;
}

// With the term kept in the fit whatever its sign: the largest value that would leave an estimate
// this small with the probability 1 - confidence. Its own noise widens the standard error, hence
// the iteration.
Coefficient upper_bound(const Weighted& w, const Solution& best, NoiseTerm term,
                        const std::vector<AllanPoint>& points, const std::vector<double>& variances,
                        double confidence) {
  constexpr int kRounds = 20;
  const Columns columns(w, best.active | 1u << index(term));
  const double estimate = std::max(columns.solve(w.b)[index(term)], 0.0);
  const double z = normal_quantile(confidence);
  Squares bound = best.squares;
  for (int round = 0; round < kRounds; ++round) {
    const double error = standard_errors(columns, points, variances, bound)[index(term)];
    const double before = std::exchange(bound[index(term)], estimate + z * error);
    if (std::abs(bound[index(term)] - before) <= 1e-3 * bound[index(term)]) break;
  }
  Coefficient c;
  c.identification = Identification::kUpperBound;
  c.value = std::sqrt(best.squares[index(term)]);
  c.upper = std::sqrt(bound[index(term)]);
  return c;
}

Coefficient interval(double square, double error, double z) {
  const double value = std::sqrt(square);
  const double factor = std::exp(0.5 * z * error / square);
  return {Identification::kInterval, value, value / factor, value * factor};
}

struct TabulatedCorrelation {
  std::array<double, 25> quarter_octaves;
  double decay_per_octave;  // beyond the table

  [[nodiscard]] double at(double octaves) const {
    const double position = 4.0 * octaves;
    const double last = static_cast<double>(quarter_octaves.size() - 1);
    if (position >= last)
      return quarter_octaves.back() * std::exp2(-decay_per_octave * (position - last) / 4.0);
    const auto i = static_cast<std::size_t>(position);
    const double fraction = position - static_cast<double>(i);
    return quarter_octaves[i] + fraction * (quarter_octaves[i + 1] - quarter_octaves[i]);
  }
};

constexpr TabulatedCorrelation kWhite{
    {1.0000, 0.9511, 0.8321, 0.6803, 0.5303, 0.4089, 0.3153, 0.2431, 0.1875,
     0.1446, 0.1115, 0.0860, 0.0663, 0.0511, 0.0394, 0.0304, 0.0234, 0.0181,
     0.0139, 0.0107, 0.0083, 0.0064, 0.0049, 0.0038, 0.0029},
    1.5};
constexpr TabulatedCorrelation kFlicker{
    {1.0000, 0.9744, 0.9038, 0.8031, 0.6894, 0.5772, 0.4746, 0.3851, 0.3094,
     0.2466, 0.1954, 0.1540, 0.1210, 0.0947, 0.0740, 0.0576, 0.0448, 0.0348,
     0.0270, 0.0209, 0.0162, 0.0125, 0.0097, 0.0075, 0.0058},
    1.5};
constexpr TabulatedCorrelation kRandomWalk{
    {1.0000, 0.9919, 0.9686, 0.9327, 0.8877, 0.8369, 0.7833, 0.7292, 0.6760,
     0.6249, 0.5763, 0.5307, 0.4881, 0.4485, 0.4119, 0.3781, 0.3470, 0.3184,
     0.2921, 0.2679, 0.2457, 0.2254, 0.2067, 0.1895, 0.1738},
    0.5};

struct SlopeReading {
  double slope;
  double reading_tau_s;
};

SlopeReading reading_point(NoiseTerm term) {
  switch (term) {
    case NoiseTerm::kQuantization:
      return {-1.0, std::numbers::sqrt3};
    case NoiseTerm::kAngleRandomWalk:
      return {-0.5, 1.0};
    case NoiseTerm::kRateRandomWalk:
      return {0.5, 3.0};
    case NoiseTerm::kRateRamp:
      return {1.0, std::numbers::sqrt2};
    case NoiseTerm::kBiasInstability:
      break;
  }
  assert(false && "bias instability is read at the minimum, not along a slope");
  return {0.0, 1.0};
}

std::optional<double> read_along_slope(const std::vector<AllanPoint>& points,
                                       const SlopeReading& reading) {
  constexpr double kSlopeTolerance = 0.25;
  double nearest = kSlopeTolerance;
  std::optional<double> value;
  for (std::size_t i = 1; i < points.size(); ++i) {
    const AllanPoint& a = points[i - 1];
    const AllanPoint& b = points[i];
    const double slope =
        std::log(b.deviation_radps / a.deviation_radps) / std::log(b.tau_s / a.tau_s);
    const double distance = std::abs(slope - reading.slope);
    if (distance >= nearest) continue;
    nearest = distance;
    const double middle_tau = std::sqrt(a.tau_s * b.tau_s);
    const double middle = std::sqrt(a.deviation_radps * b.deviation_radps);
    value = middle * std::pow(reading.reading_tau_s / middle_tau, reading.slope);
  }
  return value;
}

}  // namespace

double unit_variance(NoiseTerm term, double tau_s) noexcept {
  switch (term) {
    case NoiseTerm::kQuantization:
      return 3.0 / (tau_s * tau_s);
    case NoiseTerm::kAngleRandomWalk:
      return 1.0 / tau_s;
    case NoiseTerm::kBiasInstability:
      return kBiasVariance;
    case NoiseTerm::kRateRandomWalk:
      return tau_s / 3.0;
    case NoiseTerm::kRateRamp:
      return 0.5 * tau_s * tau_s;
  }
  assert(false && "no such noise term");
  return 0.0;
}

double model_variance(const PerNoiseTerm<double>& coefficients, double tau_s) noexcept {
  Squares squares{};
  for (const NoiseTerm term : kNoiseTerms)
    squares[index(term)] = coefficients[index(term)] * coefficients[index(term)];
  return squared_model(squares, tau_s);
}

std::optional<std::string> CoefficientOptions::validate() const {
  if (term_set(fitted) == 0) return "fitted names no term, must name at least one";
  if (!(confidence > 0.5 && confidence < 1.0)) {
    return "confidence is " + std::to_string(confidence) + ", must be inside (0.5, 1)";
  }
  if (!(min_degrees_of_freedom > 0.0)) {
    return "min_degrees_of_freedom is " + std::to_string(min_degrees_of_freedom) + ", must be > 0";
  }
  if (max_iterations < 1)
    return "max_iterations is " + std::to_string(max_iterations) + ", must be >= 1";
  return std::nullopt;
}

double variance_correlation(NoiseTerm noise, double tau_ratio) noexcept {
  assert(tau_ratio > 0.0);
  const double octaves = std::abs(std::log2(tau_ratio));
  switch (noise) {
    case NoiseTerm::kQuantization:
      return octaves == 0.0 ? 1.0 : 0.0;  // white angle: no angle shared, none alike
    case NoiseTerm::kAngleRandomWalk:
      return kWhite.at(octaves);
    case NoiseTerm::kBiasInstability:
      return kFlicker.at(octaves);
    case NoiseTerm::kRateRandomWalk:
      return kRandomWalk.at(octaves);
    case NoiseTerm::kRateRamp:
      return 1.0;  // one number decides every point
  }
  assert(false && "no such noise term");
  return 0.0;
}

CoefficientReport fit_coefficients(std::span<const AllanPoint> all_points,
                                   const CoefficientOptions& options) {
  if (const auto error = options.validate()) throw std::invalid_argument(*error);
  constexpr double kSettled = 1e-10;
  const TermSet wanted = term_set(options.fitted);
  const std::vector<AllanPoint> points = usable(all_points, options.min_degrees_of_freedom);
  CoefficientReport report;
  report.points = points.size();
  if (points.size() < members(wanted).size()) return report;

  std::vector<double> variances = measured_variances(points);
  Weighted weighted;
  Solution best;
  report.status = FitStatus::kIterationLimit;
  while (report.status == FitStatus::kIterationLimit &&
         report.iterations < options.max_iterations) {
    if (report.iterations++ > 0) variances = modelled_variances(points, best.squares);
    weighted = weigh(points, variances);
    best = non_negative_least_squares(weighted, wanted);
    const double change =
        largest_relative_change(variances, modelled_variances(points, best.squares));
    if (change < kSettled) report.status = FitStatus::kConverged;
  }

  const Squares errors =
      standard_errors(Columns(weighted, best.active), points, variances, best.squares);
  const double two_sided = normal_quantile(0.5 + 0.5 * options.confidence);
  const double one_sided = normal_quantile(options.confidence);
  for (const NoiseTerm term : members(wanted)) {
    const double square = best.squares[index(term)];
    const double error = errors[index(term)];
    report.coefficients[index(term)] =
        square > one_sided * error
            ? interval(square, error, two_sided)
            : upper_bound(weighted, best, term, points, variances, options.confidence);
  }
  const std::size_t spare = points.size() - members(best.active).size();
  report.reduced_chi_square = spare > 0 ? best.residual / static_cast<double>(spare) : 0.0;
  return report;
}

PerNoiseTerm<std::optional<double>> read_slopes(std::span<const AllanPoint> all_points,
                                                double min_degrees_of_freedom) {
  const std::vector<AllanPoint> points = usable(all_points, min_degrees_of_freedom);
  PerNoiseTerm<std::optional<double>> values;
  if (points.empty()) return values;
  for (const NoiseTerm term : kNoiseTerms) {
    if (term != NoiseTerm::kBiasInstability)
      values[index(term)] = read_along_slope(points, reading_point(term));
  }
  const auto lowest =
      std::min_element(points.begin(), points.end(), [](const AllanPoint& a, const AllanPoint& b) {
        return a.deviation_radps < b.deviation_radps;
      });
  values[index(NoiseTerm::kBiasInstability)] = lowest->deviation_radps / std::sqrt(kBiasVariance);
  return values;
}

}  // namespace zerodrift::allan
