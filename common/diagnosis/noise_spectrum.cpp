// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/noise_spectrum.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "common/allan/chi_square.h"
#include "common/core/require.h"
#include "common/diagnosis/cosine_transform.h"

namespace zerodrift::diagnosis {
namespace {

bool is_same(const NoiseTerm& a, const NoiseTerm& b) {
  return a.kind == b.kind && (a.kind != NoiseKind::kMarkov || a.correlation_s == b.correlation_s);
}

// The regression at one noise spectrum.
struct Solved {
  double log_likelihood = -std::numeric_limits<double>::infinity();  // without the noise's prior
  Eigen::VectorXd amplitudes;
  Eigen::VectorXd scale;
  Eigen::LLT<Eigen::MatrixXd> factor;  // of diag(scale) A diag(scale)

  [[nodiscard]] Eigen::MatrixXd inverse() const {  // A^-1
    const Eigen::Index p = scale.size();
    return scale.asDiagonal() * factor.solve(Eigen::MatrixXd::Identity(p, p)) * scale.asDiagonal();
  }
};

Solved solve(const RowSystem& rows, const Eigen::VectorXd& spectrum) {
  const Eigen::Index p = rows.columns();
  const Eigen::MatrixXd gram = weighted_gram(rows, spectrum);
  Solved solved{};
  double quadratic = gram(p, p);
  double log_determinant = 0.0;
  if (p > 0) {
    Eigen::MatrixXd a = gram.topLeftCorner(p, p);
    a.diagonal() += rows.ridge;
    solved.scale = a.diagonal().cwiseSqrt().cwiseInverse();
    solved.factor.compute(solved.scale.asDiagonal() * a * solved.scale.asDiagonal());
    if (solved.factor.info() != Eigen::Success) return solved;
    const Eigen::VectorXd rhs = solved.scale.cwiseProduct(gram.col(p).head(p));
    const Eigen::VectorXd solution = solved.factor.solve(rhs);
    solved.amplitudes = solved.scale.cwiseProduct(solution);
    quadratic -= rhs.dot(solution);
    const Eigen::MatrixXd& l = solved.factor.matrixLLT();
    log_determinant = 2.0 * (l.diagonal().array().log().sum() - solved.scale.array().log().sum());
  }
  const double log_spectrum = rows.counts.dot(spectrum.array().log().matrix());
  solved.log_likelihood = -0.5 * (log_spectrum + log_determinant + quadratic);
  return solved;
}

// Per row: squares of the residual, and the coefficients that the amplitudes used up.
struct Residual {
  Eigen::VectorXd power;
  Eigen::VectorXd leverage;
};

Residual residual(const RowSystem& rows, const Eigen::VectorXd& spectrum, const Solved& solved) {
  const Eigen::Index singles = rows.singles.rows();
  const Eigen::Index bins = rows.products.rows();
  const Eigen::Index p = rows.columns();
  Eigen::VectorXd contrast(p + 1);  // residual = rows * contrast
  if (p > 0) contrast.head(p) = -solved.amplitudes;
  contrast(p) = 1.0;
  Residual r{Eigen::VectorXd(singles + bins), Eigen::VectorXd::Zero(singles + bins)};
  r.power.head(singles) = (rows.singles * contrast).cwiseAbs2();
  if (bins > 0) {
    const Eigen::MatrixXd outer = contrast * contrast.transpose();
    r.power.tail(bins) =
        rows.products * Eigen::Map<const Eigen::VectorXd>(outer.data(), outer.size());
  }
  if (p > 0) {
    const auto x = rows.singles.leftCols(p);
    const Eigen::MatrixXd inverse = solved.inverse();
    const Eigen::MatrixXd gain = x * inverse;
    r.leverage.head(singles) = gain.cwiseProduct(x).rowwise().sum();
    if (bins > 0) {
      Eigen::MatrixXd padded = Eigen::MatrixXd::Zero(p + 1, p + 1);
      padded.topLeftCorner(p, p) = inverse;
      r.leverage.tail(bins) =
          rows.products * Eigen::Map<const Eigen::VectorXd>(padded.data(), padded.size());
    }
    r.leverage = r.leverage.cwiseQuotient(spectrum);
  }
  r.power = r.power.cwiseMax(0.0);
  return r;
}

double prior_log_density(const NoiseDictionary& dictionary, const Eigen::VectorXd& squares) {
  double sum = 0.0;
  for (Eigen::Index m = 0; m < squares.size(); ++m) {
    const double freedom = dictionary.prior_freedom()(m);
    if (freedom <= 0.0) continue;
    const double ratio = squares(m) / dictionary.prior_square()(m);
    if (!(ratio > 0.0)) return -std::numeric_limits<double>::infinity();
    sum -= 0.5 * freedom * (std::log(ratio) + 1.0 / ratio);
  }
  return sum;
}

// The regression at squares of the dictionary's terms, and what it is worth with their prior.
struct Point {
  Eigen::VectorXd squares;
  Eigen::VectorXd spectrum;
  Solved solved{};
  double penalised = -std::numeric_limits<double>::infinity();
};

Point point_at(const RowSystem& rows, const NoiseDictionary& dictionary,
               const Eigen::VectorXd& squares) {
  Point point{.squares = squares, .spectrum = dictionary.spectra() * squares};
  if (!(point.spectrum.minCoeff() > 0.0)) return point;
  point.solved = solve(rows, point.spectrum);
  point.penalised = point.solved.log_likelihood + prior_log_density(dictionary, squares);
  return point;
}

// Gradient split into what pulls a square up and what pulls it down, and the Fisher information.
struct Derivatives {
  Eigen::VectorXd up, down;
  Eigen::MatrixXd information;
};

Derivatives derivatives(const RowSystem& rows, const NoiseDictionary& dictionary,
                        const Point& point) {
  const Eigen::MatrixXd& d = dictionary.spectra();
  const Eigen::VectorXd& squares = point.squares;
  const Eigen::VectorXd& spectrum = point.spectrum;
  if (!std::isfinite(point.solved.log_likelihood)) return {};
  const Residual r = residual(rows, spectrum, point.solved);
  const Eigen::VectorXd freedom = (rows.counts - r.leverage).cwiseMax(1e-6 * rows.counts);
  Derivatives v;
  v.up = 0.5 * d.transpose() * r.power.cwiseQuotient(spectrum.cwiseAbs2());
  v.down = 0.5 * d.transpose() * freedom.cwiseQuotient(spectrum);
  const Eigen::VectorXd weight = (0.5 * freedom.array()).sqrt() / spectrum.array();
  const Eigen::MatrixXd weighted = weight.asDiagonal() * d;
  v.information = weighted.transpose() * weighted;
  for (Eigen::Index m = 0; m < squares.size(); ++m) {
    const double prior_freedom = dictionary.prior_freedom()(m);
    if (prior_freedom <= 0.0) continue;
    const double square = squares(m);
    const double ratio = dictionary.prior_square()(m) / square;
    const double unit = 0.5 * prior_freedom / (square * square);
    v.up(m) += unit * ratio * square;
    v.down(m) += unit * square;
    // Far below its prior a square is held far more stiffly than its expected information says:
    // steps by that alone go too far by as much.
    v.information(m, m) += unit * std::max(1.0, 2.0 * ratio - 1.0);
  }
  return v;
}

// Step that maximises g's - s'Hs/2 with x + s >= 0, by coordinates; the dictionary is small.
Eigen::VectorXd bounded_step(const Eigen::VectorXd& gradient, Eigen::MatrixXd information,
                             const Eigen::VectorXd& squares) {
  constexpr int kSweeps = 300;
  constexpr double kDamping = 1e-9;
  information.diagonal() *= 1.0 + kDamping;
  Eigen::VectorXd step = Eigen::VectorXd::Zero(squares.size());
  Eigen::VectorXd slope = gradient;
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    double gain = 0.0;
    for (Eigen::Index m = 0; m < squares.size(); ++m) {
      const double curvature = information(m, m);
      if (!(curvature > 0.0)) continue;
      const double next = std::max(step(m) + slope(m) / curvature, -squares(m));
      const double change = next - step(m);
      if (change == 0.0) continue;
      step(m) = next;
      slope -= change * information.col(m);
      gain += change * change * curvature;
    }
    if (gain < 1e-14) break;
  }
  return step;
}

// Power of the series alone, spread evenly over the terms: each explains its share of the log mean.
Eigen::VectorXd even_start(const RowSystem& rows, const NoiseDictionary& dictionary) {
  const Eigen::Index p = rows.columns();
  const Eigen::Index singles = rows.singles.rows();
  Eigen::VectorXd power(rows.counts.size());
  power.head(singles) = rows.singles.col(p).cwiseAbs2();
  if (rows.products.rows() > 0) power.tail(rows.products.rows()) = rows.products.rightCols(1);
  const double mean = power.sum() / rows.counts.sum();
  const Eigen::Index terms = dictionary.size();
  Eigen::VectorXd squares(terms);
  for (Eigen::Index m = 0; m < terms; ++m) {
    const double unit = dictionary.spectra().col(m).dot(rows.counts) / rows.counts.sum();
    squares(m) = mean / (unit * static_cast<double>(terms));
    if (dictionary.prior_freedom()(m) > 0.0) squares(m) = dictionary.prior_square()(m);
  }
  return squares;
}

bool has_power(const RowSystem& rows, const Eigen::VectorXd& squares) {
  return rows.counts.sum() > static_cast<double>(rows.columns()) && squares.allFinite() &&
         squares.maxCoeff() > 0.0;
}

}  // namespace

std::string_view name(NoiseKind kind) noexcept {
  switch (kind) {
    case NoiseKind::kWhite: return "white";
    case NoiseKind::kFlicker: return "flicker";
    case NoiseKind::kRandomWalk: return "random walk";
    case NoiseKind::kQuantization: return "quantisation";
    case NoiseKind::kMarkov: return "Markov";
  }
  assert(false && "no such noise");
  return "";
}

UnitSpectrum::UnitSpectrum(const NoiseTerm& term, double interval_s) noexcept
    : kind_(term.kind),
      interval_s_(interval_s),
      memory_(kind_ == NoiseKind::kMarkov ? std::exp(-interval_s / term.correlation_s) : 0.0),
      forgets_(kind_ == NoiseKind::kMarkov ? -std::expm1(-interval_s / term.correlation_s) : 1.0) {}

double UnitSpectrum::operator()(double eigenvalue) const noexcept {
  switch (kind_) {
    case NoiseKind::kWhite: return 1.0 / interval_s_;
    case NoiseKind::kFlicker: return 1.0 / std::sqrt(eigenvalue);
    case NoiseKind::kRandomWalk: return interval_s_ / eigenvalue;
    case NoiseKind::kQuantization: return eigenvalue / (interval_s_ * interval_s_);
    case NoiseKind::kMarkov:
      return forgets_ * (1.0 + memory_) / (forgets_ * forgets_ + memory_ * eigenvalue);
  }
  assert(false && "no such noise");
  return 0.0;
}

std::vector<NoiseTerm> usual_noise_terms(std::size_t samples, double interval_s) {
  std::vector<NoiseTerm> terms{{NoiseKind::kWhite, 0.0},
                               {NoiseKind::kFlicker, 0.0},
                               {NoiseKind::kRandomWalk, 0.0},
                               {NoiseKind::kQuantization, 0.0}};
  const double longest_s = static_cast<double>(samples) * interval_s / 8.0;
  for (double t = 10.0 * interval_s; t <= longest_s; t *= 4.0) {
    terms.push_back({NoiseKind::kMarkov, t});
  }
  return terms;
}

std::optional<std::string> NoisePrior::validate() const {
  for (const KnownNoise& k : known) {
    const std::string which = "known noise '" + std::string(name(k.term.kind)) + "': ";
    if (!(k.square > 0.0) || !std::isfinite(k.square)) {
      return which + "square is " + std::to_string(k.square) + ", must be > 0";
    }
    if (!(k.relative_sigma > 0.0)) {
      return which + "relative_sigma is " + std::to_string(k.relative_sigma) + ", must be > 0";
    }
    if (k.term.kind == NoiseKind::kMarkov && !(k.term.correlation_s > 0.0)) {
      return which + "correlation_s is " + std::to_string(k.term.correlation_s) + ", must be > 0";
    }
  }
  if (unlisted == UnlistedNoise::kExcluded && known.empty()) {
    return "unlisted noise is excluded and no noise is known: at least one must be";
  }
  return std::nullopt;
}

SpectralBands::SpectralBands(std::size_t samples, std::size_t single_coefficients, double bin_ratio)
    : samples_(samples) {
  core::require(samples >= 2 && bin_ratio > 1.0,
                "spectral bands need two samples and a bin ratio above 1");
  const std::size_t singles = std::min(single_coefficients, samples - 1);
  singles_ = static_cast<Eigen::Index>(singles);
  for (std::size_t k = 1; k <= singles; ++k) first_.push_back(k);
  std::size_t k = singles + 1;
  while (k < samples) {
    first_.push_back(k);
    const auto next = static_cast<std::size_t>(static_cast<double>(k) * bin_ratio);
    k = std::min(std::max(next, k + 1), samples);
  }
  first_.push_back(samples);
  eigenvalues_.resize(samples);
  for (std::size_t i = 0; i < samples; ++i) eigenvalues_[i] = laplacian_eigenvalue(i, samples);
}

NoiseDictionary::NoiseDictionary(const SpectralBands& bands, double interval_s,
                                 const NoisePrior& prior) {
  if (const auto error = prior.validate()) throw std::invalid_argument(*error);
  for (const KnownNoise& k : prior.known) terms_.push_back(k.term);
  if (prior.unlisted == UnlistedNoise::kFree) {
    for (const NoiseTerm& term : usual_noise_terms(bands.samples(), interval_s)) {
      const bool known = std::any_of(terms_.begin(), terms_.end(),
                                     [&](const NoiseTerm& t) { return is_same(t, term); });
      if (!known) terms_.push_back(term);
    }
  }
  const auto terms = static_cast<Eigen::Index>(terms_.size());
  spectra_.setZero(bands.rows(), terms);
  for (Eigen::Index m = 0; m < terms; ++m) {
    const UnitSpectrum spectrum(terms_[static_cast<std::size_t>(m)], interval_s);
    for (Eigen::Index row = 0; row < bands.rows(); ++row) {
      double sum = 0.0;
      for (std::size_t k = bands.first(row); k < bands.first(row + 1); ++k)
        sum += spectrum(bands.eigenvalue(k));
      spectra_(row, m) = sum / bands.count(row);
    }
  }
  prior_square_.setZero(terms);
  prior_freedom_.setZero(terms);
  for (std::size_t i = 0; i < prior.known.size(); ++i) {
    const double sigma = prior.known[i].relative_sigma;
    prior_square_(static_cast<Eigen::Index>(i)) = prior.known[i].square;
    prior_freedom_(static_cast<Eigen::Index>(i)) = 2.0 / (sigma * sigma);
  }
}

std::optional<std::string> NoiseFitOptions::validate() const {
  if (max_iterations < 1) {
    return "max_iterations is " + std::to_string(max_iterations) + ", must be >= 1";
  }
  if (!(settled_nats > 0.0)) {
    return "settled_nats is " + std::to_string(settled_nats) + ", must be > 0";
  }
  return std::nullopt;
}

double restricted_log_likelihood(const RowSystem& rows, const NoiseDictionary& dictionary,
                                 const Eigen::VectorXd& squares) {
  return point_at(rows, dictionary, squares).penalised;
}

Eigen::VectorXd restricted_gradient(const RowSystem& rows, const NoiseDictionary& dictionary,
                                    const Eigen::VectorXd& squares) {
  const Derivatives v = derivatives(rows, dictionary, point_at(rows, dictionary, squares));
  return v.up - v.down;
}

NoiseFit fit_noise(const RowSystem& rows, const NoiseDictionary& dictionary,
                   const NoiseFitOptions& options, const Eigen::VectorXd& start) {
  if (const auto error = options.validate()) throw std::invalid_argument(*error);
  constexpr int kMultiplicativeSteps = 5;
  constexpr int kHalvings = 25;
  NoiseFit fit;
  const bool fresh = start.size() != dictionary.size();
  fit.squares = fresh ? even_start(rows, dictionary) : start;
  if (!has_power(rows, fit.squares)) return fit;
  Point at = point_at(rows, dictionary, fit.squares);
  fit.log_likelihood = at.penalised;
  if (!std::isfinite(at.penalised)) return fit;

  fit.status = NoiseFitStatus::kIterationLimit;
  while (fit.iterations < options.max_iterations) {
    const Derivatives v = derivatives(rows, dictionary, at);
    if (v.up.size() == 0) break;
    const bool multiplicative = fresh && fit.iterations < kMultiplicativeSteps;
    ++fit.iterations;
    if (multiplicative) {
      at = point_at(rows, dictionary, at.squares.array() * (v.up.array() / v.down.array()).sqrt());
      continue;
    }
    // In units of the squares' own precision the coordinates are comparable.
    const Eigen::VectorXd unit = v.information.diagonal().cwiseSqrt().cwiseInverse();
    const Eigen::VectorXd gradient = unit.cwiseProduct(v.up - v.down);
    const Eigen::MatrixXd information = unit.asDiagonal() * v.information * unit.asDiagonal();
    const Eigen::VectorXd step =
        unit.cwiseProduct(bounded_step(gradient, information, at.squares.cwiseQuotient(unit)));
    fit.promised_nats = step.dot(v.up - v.down);
    if (fit.promised_nats < options.settled_nats) {
      fit.status = NoiseFitStatus::kConverged;
      break;
    }
    double share = 1.0;
    bool moved = false;
    for (int i = 0; i < kHalvings && !moved; ++i, share *= 0.5) {
      Point next = point_at(rows, dictionary, (at.squares + share * step).cwiseMax(0.0));
      if (next.penalised <= at.penalised) continue;
      at = std::move(next);
      moved = true;
    }
    if (!moved) {  // rounding is all that is left
      fit.status =
          fit.promised_nats < 1e-3 ? NoiseFitStatus::kConverged : NoiseFitStatus::kIterationLimit;
      break;
    }
  }
  fit.squares = std::move(at.squares);
  fit.spectrum = std::move(at.spectrum);
  fit.log_likelihood = at.penalised;
  return fit;
}

Eigen::MatrixXd weighted_gram(const RowSystem& rows, const Eigen::VectorXd& spectrum) {
  const Eigen::VectorXd inverse_spectrum = spectrum.cwiseInverse();
  const Eigen::Index singles = rows.singles.rows();
  const Eigen::Index p1 = rows.columns() + 1;
  const Eigen::MatrixXd white =
      inverse_spectrum.head(singles).cwiseSqrt().asDiagonal() * rows.singles;
  Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(p1, p1);
  gram.selfadjointView<Eigen::Lower>().rankUpdate(white.transpose());
  gram.triangularView<Eigen::StrictlyUpper>() = gram.transpose();
  if (rows.products.rows() > 0) {
    const Eigen::VectorXd flat =
        rows.products.transpose() * inverse_spectrum.tail(rows.products.rows());
    gram += Eigen::Map<const Eigen::MatrixXd>(flat.data(), p1, p1);
  }
  return gram;
}

std::optional<Amplitudes> fit_amplitudes(const RowSystem& rows, const Eigen::VectorXd& spectrum) {
  if (spectrum.size() != rows.counts.size()) return std::nullopt;
  Solved solved = solve(rows, spectrum);
  if (!std::isfinite(solved.log_likelihood)) return std::nullopt;
  return Amplitudes{std::move(solved.amplitudes), solved.inverse()};
}

std::vector<OctavePower> power_by_octave(const RowSystem& rows, const SpectralBands& bands,
                                         const Eigen::VectorXd& spectrum, double interval_s) {
  const Solved solved = solve(rows, spectrum);
  if (!std::isfinite(solved.log_likelihood)) return {};
  const Residual r = residual(rows, spectrum, solved);
  const double hz_per_k = 0.5 / (static_cast<double>(bands.samples()) * interval_s);
  std::vector<OctavePower> octaves;
  Eigen::Index row = bands.rows();
  while (row > 0) {
    const std::size_t end = bands.first(row);
    double sum = 0.0;
    double freedom = 0.0;
    do {
      --row;
      sum += r.power(row) / spectrum(row);
      freedom += std::max(rows.counts(row) - r.leverage(row), 0.0);
    } while (row > 0 && 2 * bands.first(row - 1) >= end);
    OctavePower octave;
    octave.lowest_hz = hz_per_k * static_cast<double>(bands.first(row));
    octave.highest_hz = hz_per_k * static_cast<double>(end);
    octave.degrees_of_freedom = freedom;
    if (freedom > 0.0) {
      octave.ratio = sum / freedom;
      octave.deficit_probability = allan::chi_square_cdf(sum, freedom);
      octave.excess_probability = 1.0 - octave.deficit_probability;
    }
    octaves.push_back(octave);
  }
  return octaves;
}

}  // namespace zerodrift::diagnosis
