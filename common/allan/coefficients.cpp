// SPDX-License-Identifier: Apache-2.0
#include "common/allan/coefficients.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <iterator>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <utility>
#include <vector>

#include "common/allan/chi_square.h"
#include "common/allan/noise_fit.h"
#include "common/allan/noise_model.h"
#include "common/allan/point_covariance.h"

namespace zerodrift::allan {
namespace {

constexpr double kExplained = 3.0;          // reduced chi-square; 1 where the model is right
constexpr double kExplainedChance = 0.999;  // ... which few points exceed by chance
constexpr std::size_t kSparePoints = 4;     // beyond the terms, for a chi-square
constexpr double kBiasVariance = 2.0 * std::numbers::ln2 / std::numbers::pi;  // 0.664²

ShapeSet shape_set(const PerNoiseTerm<bool>& fitted) {
  ShapeSet set = 0;
  for (const NoiseTerm term : kNoiseTerms) set |= fitted[index(term)] ? only(shape_of(term)) : 0u;
  return set;
}

ShapeSet shape_set(const TermsOnEvidence& terms) {
  return (terms.quantization ? only(Shape::kQuantization) : 0u) |
         (terms.rate_ramp ? only(Shape::kRateRamp) : 0u) |
         (terms.sinusoid ? only(Shape::kSinusoid) : 0u) |
         (terms.markov ? only(Shape::kMarkov) : 0u);
}

std::vector<AllanPoint> usable(std::span<const AllanPoint> points, double min_degrees_of_freedom) {
  std::vector<AllanPoint> result;
  std::copy_if(points.begin(), points.end(), std::back_inserter(result), [&](const AllanPoint& p) {
    return p.degrees_of_freedom >= min_degrees_of_freedom && p.deviation_radps > 0.0 &&
           std::isfinite(p.deviation_radps);
  });
  return result;
}

// The model with every term the curve asks for and can resolve.
FittedModel fitted_on_evidence(const std::vector<AllanPoint>& points, ShapeSet candidates,
                               FittedModel fit, int max_iterations) {
  for (std::size_t i = size(candidates & ~fit.allowed); i > 0; --i) {
    auto next = with_missing_shape(points, fit, candidates, max_iterations);
    if (!next) break;
    const ShapeSet added = next->allowed & ~fit.allowed;
    if ((next->active & added) != 0 && is_resolved(points, *next)) {
      fit = std::move(*next);
    } else {
      candidates &= ~added;  // at its own optimum it is not there, or does another shape's work
    }
  }
  return fit;
}

// Standard errors of the squared coefficients, and of ln f and ln T, where the true model is
// `truth`; 0 for shapes outside the design.
struct StandardErrors {
  PerShape<double> squares{};
  PerShape<double> log_parameters{};

  StandardErrors(const Design& design, const Whitening& whitening, const PointCovariance& truth) {
    const Eigen::MatrixXd covariance = whitening.propagated(design.gain(), truth);
    const auto error = [&](Eigen::Index j) { return std::sqrt(std::max(covariance(j, j), 0.0)); };
    Eigen::Index j = 0;
    for (const Shape shape : design.shapes) squares[index(shape)] = error(j++);
    for (const Shape shape : design.parameters) log_parameters[index(shape)] = error(j++);
  }
};

// Distinguishable from zero, so that an interval is stated and no bound.
bool is_stated(const FittedModel& fit, const StandardErrors& errors, Shape shape,
               const CoefficientOptions& options) {
  return fit.model.squares[index(shape)] >
         normal_quantile(options.confidence) * errors.squares[index(shape)];
}

// Gauss-Markov noise rises like a random walk and then stays: stated as one, it makes the last
// points of the curve scatter so much, by its own account, that least squares don't miss the fall.
// Likelihood does. Of 66 simulated records of an hour and of four with a random walk it gained 4.1
// at most by the other model, and never with a time constant that the curve shows; of 45 of a
// Markov noise that shows its own, 5.6 to 37.
FittedModel without_false_growth(const std::vector<AllanPoint>& points, FittedModel fit,
                                 const CoefficientOptions& options) {
  constexpr double kBelieved = 6.0;  // of -2 ln likelihood
  if (contains(fit.active, Shape::kMarkov)) return fit;
  const Design design(points, fit.whitening, fit.model, fit.active, true);
  const StandardErrors errors(design, fit.whitening, point_covariance(points, fit.model));
  const bool grows = is_stated(fit, errors, Shape::kRateRandomWalk, options) ||
                     is_stated(fit, errors, Shape::kRateRamp, options);
  if (!grows) return fit;
  auto other = with_markov_for_growth(points, fit, options.max_iterations);
  const bool is_believed = other && is_resolved(points, *other) &&
                           misfit(points, fit) - misfit(points, *other) > kBelieved;
  return is_believed ? *std::move(other) : fit;
}

// Points beyond those that the parameters take; 0: none.
double spare_points(const FittedModel& fit, std::size_t points) {
  std::size_t spent = size(fit.active);
  for (const Shape shape : {Shape::kSinusoid, Shape::kMarkov})
    spent += contains(fit.active, shape) ? 1u : 0u;
  return points > spent ? static_cast<double>(points - spent) : 0.0;
}

double reduced_chi_square(const FittedModel& fit, std::size_t points) {
  const double spare = spare_points(fit, points);
  return spare > 0.0 ? fit.residual / spare : 0.0;
}

bool is_explained(const FittedModel& fit, const std::vector<AllanPoint>& points) {
  const double spare = spare_points(fit, points.size());
  if (spare == 0.0) return true;
  return fit.residual <=
             std::max(kExplained * spare, chi_square_quantile(kExplainedChance, spare)) &&
         !is_too_high(points, fit);
}

struct Explained {
  std::vector<AllanPoint> points;
  FittedModel fit;
};

// Where the fit may begin.
struct Begin {
  ShortTaus short_taus = ShortTaus::kMixture;
  std::vector<AllanPoint> points;
};

Begin begin_of(const std::vector<AllanPoint>& points, ShapeSet wanted,
               const CoefficientOptions& options) {
  if (options.most_octaves_left_out == 0) return {ShortTaus::kMixture, points};
  const WhitePart white = white_part(points);
  if (white.short_taus != ShortTaus::kBandLimited) return {white.short_taus, points};
  if (points.size() - white.first < size(wanted) + kSparePoints)
    return {ShortTaus::kNeverWhite, points};
  return {ShortTaus::kBandLimited,
          {points.begin() + static_cast<std::ptrdiff_t>(white.first), points.end()}};
}

// All points; where the model cannot explain these, those from the shortest tau on that it can, and
// an octave less, since what chi-square does not see yet bends N all the same; where there are
// none, all again.
Explained explained(const std::vector<AllanPoint>& points, ShapeSet wanted,
                    const CoefficientOptions& options) {
  const ShapeSet candidates = shape_set(options.on_evidence);
  const auto fitted = [&](std::vector<AllanPoint> some) {
    FittedModel fit =
        fitted_on_evidence(some, candidates, fit_model(some, wanted, {}, options.max_iterations),
                           options.max_iterations);
    if (options.on_evidence.markov) fit = without_false_growth(some, std::move(fit), options);
    return Explained{std::move(some), std::move(fit)};
  };
  const auto without = [&](int octaves) {
    std::vector<AllanPoint> left;
    const double from_s = 0.999 * points.front().tau_s * std::exp2(octaves);
    std::copy_if(points.begin(), points.end(), std::back_inserter(left),
                 [&](const AllanPoint& p) { return p.tau_s >= from_s; });
    return left;
  };
  Explained all = fitted(points);
  if (is_explained(all.fit, all.points)) return all;
  for (int octaves = 1; octaves <= options.most_octaves_left_out; ++octaves) {
    std::vector<AllanPoint> left = without(octaves);
    if (left.size() < size(wanted) + kSparePoints) break;
    Explained some = fitted(std::move(left));
    if (!is_explained(some.fit, some.points)) continue;
    left = without(octaves + 1);
    return left.size() < size(wanted) + kSparePoints ? some : fitted(std::move(left));
  }
  return all;
}

// What the term could be at most if it alone made a point of the curve, and that one came out as
// small as chance lets it in one of a thousand records: the smallest of all points.
double largest_square(const std::vector<AllanPoint>& points, const NoiseModel& model, Shape shape) {
  constexpr double kSmallestByChance = 1e-3;
  double largest = std::numeric_limits<double>::infinity();
  for (const AllanPoint& p : points) {
    const double smallest = chi_square_quantile(kSmallestByChance, p.degrees_of_freedom);
    const double variance = p.deviation_radps * p.deviation_radps * p.degrees_of_freedom / smallest;
    largest = std::min(largest, variance / model.unit_variance(shape, p.tau_s));
  }
  return largest;
}

// With the term kept in the fit whatever its sign: the largest value that would leave an estimate
// this small with the probability 1 - confidence. Its own noise widens the standard error, hence
// the iteration.
Coefficient upper_bound(const std::vector<AllanPoint>& points, const FittedModel& fit, Shape shape,
                        double confidence) {
  constexpr int kRounds = 20;
  const Design design(points, fit.whitening, fit.model, fit.active | only(shape), true);
  const Eigen::VectorXd solution = design.solve(fit.whitening.of(measured(points)));
  const auto at = std::find(design.shapes.begin(), design.shapes.end(), shape);
  const double estimate = std::max(solution(std::distance(design.shapes.begin(), at)), 0.0);
  const double z = normal_quantile(confidence);
  NoiseModel bound = fit.model;
  double& square = bound.squares[index(shape)];
  for (int round = 0; round < kRounds; ++round) {
    const StandardErrors errors(design, fit.whitening, point_covariance(points, bound));
    const double before = std::exchange(square, estimate + z * errors.squares[index(shape)]);
    if (std::abs(square - before) <= 1e-3 * square) break;
  }
  Coefficient c;
  c.identification = Identification::kUpperBound;
  c.value = std::sqrt(fit.model.squares[index(shape)]);
  c.upper = std::sqrt(std::min(square, largest_square(points, bound, shape)));
  return c;
}

Coefficient log_interval(double value, double log_error, double z) {
  const double factor = std::exp(z * log_error);
  return {Identification::kInterval, value, value / factor, value * factor};
}

// What a fit says, and how sure.
CoefficientReport described(const Explained& found, const CoefficientOptions& options) {
  const auto& points = found.points;  // no structured binding: clang 14 captures none in a lambda
  const auto& fit = found.fit;
  CoefficientReport report;
  report.points = points.size();
  report.shortest_tau_s = points.front().tau_s;
  report.status = fit.converged ? FitStatus::kConverged : FitStatus::kIterationLimit;
  report.iterations = fit.iterations;

  const Design design(points, fit.whitening, fit.model, fit.active, true);
  const StandardErrors errors(design, fit.whitening, point_covariance(points, fit.model));
  const double two_sided = normal_quantile(0.5 + 0.5 * options.confidence);
  const auto coefficient = [&](Shape shape) {
    const double square = fit.model.squares[index(shape)];
    const double error = errors.squares[index(shape)];
    return is_stated(fit, errors, shape, options)
               ? log_interval(std::sqrt(square), 0.5 * error / square, two_sided)
               : upper_bound(points, fit, shape, options.confidence);
  };
  const auto parameter = [&](Shape shape, double value) {
    return log_interval(value, errors.log_parameters[index(shape)], two_sided);
  };
  for (const NoiseTerm term : kNoiseTerms) {
    if (contains(fit.allowed, shape_of(term)))
      report.coefficients[index(term)] = coefficient(shape_of(term));
  }
  if (contains(fit.active, Shape::kSinusoid)) {
    report.sinusoid = Sinusoid{coefficient(Shape::kSinusoid),
                               parameter(Shape::kSinusoid, fit.model.frequency_hz)};
  }
  if (contains(fit.active, Shape::kMarkov)) {
    report.markov = MarkovNoise{coefficient(Shape::kMarkov),
                                parameter(Shape::kMarkov, fit.model.time_constant_s)};
  }
  report.reduced_chi_square = reduced_chi_square(fit, points.size());
  return report;
}

// N of the white part of a curve that no model explains as a whole, fitted with B, which may begin
// there. Changes nothing where N isn't asked for, or that part is too short or not white enough.
void state_white_alone(const std::vector<AllanPoint>& points, const CoefficientOptions& options,
                       CoefficientReport& report) {
  const ShapeSet shapes = only(Shape::kAngleRandomWalk) | only(Shape::kBiasInstability);
  const WhitePart white = white_part(points);
  if (!options.fitted[index(NoiseTerm::kAngleRandomWalk)] ||
      white.end - white.first < size(shapes) + kSparePoints)
    return;
  std::vector<AllanPoint> part(points.begin() + static_cast<std::ptrdiff_t>(white.first),
                               points.begin() + static_cast<std::ptrdiff_t>(white.end));
  FittedModel fit = fit_model(part, shapes, {}, options.max_iterations);
  while (!is_explained(fit, part)) {
    part.pop_back();  // where the white part ends, something else begins
    if (part.size() < size(shapes) + kSparePoints) return;
    fit = fit_model(part, shapes, {}, options.max_iterations);
  }
  const Explained found{std::move(part), std::move(fit)};
  const Coefficient n = described(found, options)[NoiseTerm::kAngleRandomWalk];
  if (n.identification != Identification::kInterval) return;
  report.coefficients[index(NoiseTerm::kAngleRandomWalk)] = n;
  report.white_alone = TauRange{found.points.front().tau_s, found.points.back().tau_s};
}

// A model that is wrong bounds nothing.
void withhold(CoefficientReport& report) {
  report.status = FitStatus::kUnexplained;
  for (Coefficient& c : report.coefficients) {
    if (c.identification != Identification::kNotFitted)
      c = {Identification::kWithheld, c.value, 0.0, 0.0};
  }
  report.sinusoid.reset();
  report.markov.reset();
}

struct SlopeReading {
  double slope;
  double reading_tau_s;
};

SlopeReading reading_point(NoiseTerm term) {
  switch (term) {
    case NoiseTerm::kQuantization: return {-1.0, std::numbers::sqrt3};
    case NoiseTerm::kAngleRandomWalk: return {-0.5, 1.0};
    case NoiseTerm::kRateRandomWalk: return {0.5, 3.0};
    case NoiseTerm::kRateRamp: return {1.0, std::numbers::sqrt2};
    case NoiseTerm::kBiasInstability: break;
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
    case NoiseTerm::kQuantization: return 3.0 / (tau_s * tau_s);
    case NoiseTerm::kAngleRandomWalk: return 1.0 / tau_s;
    case NoiseTerm::kBiasInstability: return kBiasVariance;
    case NoiseTerm::kRateRandomWalk: return tau_s / 3.0;
    case NoiseTerm::kRateRamp: return 0.5 * tau_s * tau_s;
  }
  assert(false && "no such noise term");
  return 0.0;
}

double sinusoid_unit_variance(double frequency_hz, double tau_s) noexcept {
  const double x = std::numbers::pi * frequency_hz * tau_s;
  const double sine = std::sin(x);
  const double root = sine * sine / x;
  return root * root;
}

// The bracket by its series where it would cancel: x (2/3 - x/2 + ...), x = tau/T.
double markov_unit_variance(double time_constant_s, double tau_s) noexcept {
  const double x = tau_s / time_constant_s;
  const double cubed = time_constant_s * time_constant_s / tau_s;
  if (x < 1e-3) return cubed * x * x * (1.0 / 3.0 - 0.25 * x);
  const double bracket = 1.0 - (3.0 - 4.0 * std::exp(-x) + std::exp(-2.0 * x)) / (2.0 * x);
  return cubed * bracket;
}

double model_variance(const PerNoiseTerm<double>& coefficients, double tau_s) noexcept {
  double sum = 0.0;
  for (const NoiseTerm term : kNoiseTerms)
    sum += coefficients[index(term)] * coefficients[index(term)] * unit_variance(term, tau_s);
  return sum;
}

double model_variance(const CoefficientReport& report, double tau_s) noexcept {
  PerNoiseTerm<double> coefficients{};
  for (const NoiseTerm term : kNoiseTerms) coefficients[index(term)] = report[term].value;
  double sum = model_variance(coefficients, tau_s);
  if (report.sinusoid) {
    const double amplitude = report.sinusoid->amplitude_radps.value;
    sum +=
        amplitude * amplitude * sinusoid_unit_variance(report.sinusoid->frequency_hz.value, tau_s);
  }
  if (report.markov) {
    const double drive = report.markov->drive_radps_rts.value;
    sum += drive * drive * markov_unit_variance(report.markov->time_constant_s.value, tau_s);
  }
  return sum;
}

std::optional<std::string> CoefficientOptions::validate() const {
  if (shape_set(fitted) == 0) return "fitted names no term, must name at least one";
  if (!(confidence > 0.5 && confidence < 1.0)) {
    return "confidence is " + std::to_string(confidence) + ", must be inside (0.5, 1)";
  }
  if (!(min_degrees_of_freedom > 0.0)) {
    return "min_degrees_of_freedom is " + std::to_string(min_degrees_of_freedom) + ", must be > 0";
  }
  if (most_octaves_left_out < 0) {
    return "most_octaves_left_out is " + std::to_string(most_octaves_left_out) + ", must be >= 0";
  }
  if (max_iterations < 1)
    return "max_iterations is " + std::to_string(max_iterations) + ", must be >= 1";
  return std::nullopt;
}

CoefficientReport fit_coefficients(std::span<const AllanPoint> all_points,
                                   const CoefficientOptions& options) {
  if (const auto error = options.validate()) throw std::invalid_argument(*error);
  const ShapeSet wanted = shape_set(options.fitted);
  const std::vector<AllanPoint> all = usable(all_points, options.min_degrees_of_freedom);
  if (all.size() < size(wanted)) {
    CoefficientReport none;
    none.points = all.size();
    return none;
  }

  const Begin begin = begin_of(all, wanted, options);
  const Explained found = explained(begin.points, wanted, options);
  CoefficientReport report = described(found, options);
  report.short_taus = begin.short_taus;
  if (begin.short_taus == ShortTaus::kNeverWhite) {
    withhold(report);
  } else if (!is_explained(found.fit, found.points)) {
    withhold(report);
    state_white_alone(begin.points, options, report);
  }
  return report;
}

CoefficientReport identify_noise(std::span<const AllanPoint> points, CoefficientOptions options) {
  options.on_evidence = kEveryTermOnEvidence;
  options.most_octaves_left_out = kMostOctavesLeftOut;
  return fit_coefficients(points, options);
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
