// SPDX-License-Identifier: Apache-2.0
#include "common/allan/point_covariance.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace zerodrift::allan {
namespace {

struct TabulatedCorrelation {
  double at_equal_taus;
  std::array<double, 25> quarter_octaves;  // relative to equal taus
  double decay_per_octave;                 // beyond the table

  [[nodiscard]] double at(double octaves) const {
    const double position = 4.0 * octaves;
    const double last = static_cast<double>(quarter_octaves.size() - 1);
    if (!(position < last))  // not a number: neither is the answer
      return quarter_octaves.back() * std::exp2(-decay_per_octave * (position - last) / 4.0);
    const auto i = static_cast<std::size_t>(position);
    const double fraction = position - static_cast<double>(i);
    return quarter_octaves[i] + fraction * (quarter_octaves[i + 1] - quarter_octaves[i]);
  }
};

// n_jk = integral of R_j R_k dt over sqrt of (R_j(0,a) R_j(0,b) R_k(0,a) R_k(0,b) a b), R the
// cross-covariance of the second differences at lags a and b. CoefficientLaws of the unit tests
// integrate the same.
constexpr TabulatedCorrelation kWhite{
    2.0 / 3.0,
    {1.0000, 0.9511, 0.8321, 0.6803, 0.5303, 0.4089, 0.3153, 0.2431, 0.1875,
     0.1446, 0.1115, 0.0860, 0.0663, 0.0511, 0.0394, 0.0304, 0.0234, 0.0181,
     0.0139, 0.0107, 0.0083, 0.0064, 0.0049, 0.0038, 0.0029},
    1.5};
constexpr TabulatedCorrelation kFlicker{
    0.8559,
    {1.0000, 0.9744, 0.9038, 0.8031, 0.6894, 0.5772, 0.4746, 0.3851, 0.3094,
     0.2466, 0.1954, 0.1540, 0.1210, 0.0947, 0.0740, 0.0576, 0.0448, 0.0348,
     0.0270, 0.0209, 0.0162, 0.0125, 0.0097, 0.0075, 0.0058},
    1.5};
constexpr TabulatedCorrelation kRandomWalk{
    1.0786,
    {1.0000, 0.9919, 0.9686, 0.9327, 0.8877, 0.8369, 0.7833, 0.7292, 0.6760,
     0.6249, 0.5763, 0.5307, 0.4881, 0.4485, 0.4119, 0.3781, 0.3470, 0.3184,
     0.2921, 0.2679, 0.2457, 0.2254, 0.2067, 0.1895, 0.1738},
    0.5};
constexpr TabulatedCorrelation kWhiteFlicker{
    0.6985,
    {1.0000, 0.9643, 0.8696, 0.7409, 0.6044, 0.4803, 0.3756, 0.2905, 0.2228,
     0.1697, 0.1285, 0.0969, 0.0727, 0.0544, 0.0406, 0.0302, 0.0224, 0.0166,
     0.0122, 0.0090, 0.0066, 0.0049, 0.0036, 0.0026, 0.0019},
    1.8};
constexpr TabulatedCorrelation kWhiteRandomWalk{
    0.5,
    {1.0000, 0.9743, 0.9037, 0.8031, 0.6894, 0.5772, 0.4746, 0.3851, 0.3094,
     0.2466, 0.1954, 0.1540, 0.1210, 0.0947, 0.0740, 0.0576, 0.0448, 0.0348,
     0.0270, 0.0209, 0.0162, 0.0125, 0.0097, 0.0075, 0.0058},
    1.5};
constexpr TabulatedCorrelation kFlickerRandomWalk{
    0.7714,
    {1.0000, 0.9834, 0.9366, 0.8670, 0.7841, 0.6962, 0.6098, 0.5287, 0.4548,
     0.3890, 0.3313, 0.2813, 0.2382, 0.2014, 0.1700, 0.1434, 0.1208, 0.1018,
     0.0857, 0.0721, 0.0607, 0.0510, 0.0429, 0.0361, 0.0304},
    1.0};

constexpr double kWhiteAngle = 35.0 / 18.0;  // M / edf
// a1 / a0 of Greenhall & Riley's degrees of freedom r / (a0 - a1/r).
constexpr std::array<double, 3> kEndCorrection{0.5, 0.440, 0.341};

// Share of an ordinary standard deviation that the steady part of a point is doubted by.
constexpr double kShapeDoubt = 0.5;

constexpr std::size_t kClassCount = 3;  // white, flicker, random walk

// Shares of the scattering noises in the variance at one tau.
struct Shares {
  double white_angle = 0.0;
  std::array<double, kClassCount> classes{};
  double steady = 0.0;  // of sinusoid and ramp in the whole variance

  Shares(const NoiseModel& model, double tau_s) {
    const auto part = [&](Shape shape) {
      const double square = model.squares[index(shape)];
      return square > 0.0 ? square * model.unit_variance(shape, tau_s) : 0.0;
    };
    white_angle = part(Shape::kQuantization);
    // Below its peak at 1.89 T a Markov noise walks, above it is white.
    const double markov = part(Shape::kMarkov);
    const double past_peak = tau_s / (1.89 * model.time_constant_s);
    const double walking = 1.0 / (1.0 + past_peak * past_peak);
    classes = {part(Shape::kAngleRandomWalk) + (1.0 - walking) * markov,
               part(Shape::kBiasInstability), part(Shape::kRateRandomWalk) + walking * markov};
    const double still = part(Shape::kSinusoid) + part(Shape::kRateRamp);
    const double random = white_angle + classes[0] + classes[1] + classes[2];
    steady = still / (still + random);
    if (!(random > 0.0)) {
      classes = {1.0, 0.0, 0.0};
      return;
    }
    white_angle /= random;
    for (double& share : classes) share /= random;
  }
};

using ClassTable = std::array<std::array<double, kClassCount>, kClassCount>;

ClassTable covariances(double tau_ratio) {
  const double octaves = std::abs(std::log2(tau_ratio));
  const auto n = [&](const TabulatedCorrelation& table) {
    return table.at_equal_taus * table.at(octaves);
  };
  const double nb = n(kWhiteFlicker);
  const double nk = n(kWhiteRandomWalk);
  const double bk = n(kFlickerRandomWalk);
  return {{{n(kWhite), nb, nk}, {nb, n(kFlicker), bk}, {nk, bk, n(kRandomWalk)}}};
}

double class_covariance(const Shares& a, const Shares& b, const ClassTable& n) {
  std::array<double, kClassCount> root{};
  for (std::size_t j = 0; j < kClassCount; ++j) root[j] = std::sqrt(a.classes[j] * b.classes[j]);
  double sum = 0.0;
  for (std::size_t j = 0; j < kClassCount; ++j) {
    for (std::size_t k = 0; k < kClassCount; ++k) sum += root[j] * root[k] * n[j][k];
  }
  return sum;
}

// Variance over mean² / 2, times clusters, of one estimate: c(a, a).
double own_covariance(const Shares& s, const ClassTable& equal_taus, double terms_per_tau) {
  return class_covariance(s, s, equal_taus) + kWhiteAngle / terms_per_tau * s.white_angle *
                                                  (s.white_angle + 2.0 * (1.0 - s.white_angle));
}

double end_correction(const Shares& s) {
  double sum = 0.0;
  for (std::size_t j = 0; j < kClassCount; ++j) sum += s.classes[j] * kEndCorrection[j];
  return sum;
}

double terms_per_tau(const AllanPoint& p) {
  constexpr double kOfTheCascade = 16.0;
  return p.clusters > 0.0 ? std::max(static_cast<double>(p.pairs) / p.clusters, 1.0)
                          : kOfTheCascade;
}

double degrees_of_freedom(const AllanPoint& p, const Shares& shares, const ClassTable& equal_taus) {
  if (!(p.clusters > 0.0)) return p.degrees_of_freedom;
  NoiseModel pure;
  switch (p.noise) {
    case NoiseType::kQuantization: pure.squares[index(Shape::kQuantization)] = 1.0; break;
    case NoiseType::kAngleRandomWalk: pure.squares[index(Shape::kAngleRandomWalk)] = 1.0; break;
    case NoiseType::kBiasInstability: pure.squares[index(Shape::kBiasInstability)] = 1.0; break;
    case NoiseType::kRateRandomWalk: pure.squares[index(Shape::kRateRandomWalk)] = 1.0; break;
  }
  const Shares identified(pure, 1.0);
  const auto inverse = [&](const Shares& s) {
    return own_covariance(s, equal_taus, terms_per_tau(p)) *
           (1.0 - end_correction(s) / std::max(p.clusters, 1.0));
  };
  return std::max(p.degrees_of_freedom * inverse(identified) / inverse(shares), 1.0);
}

// Two-sided spectral density of the rate noise, (rad/s)²/Hz.
double noise_density(const NoiseModel& m, double frequency_hz) {
  const double omega = 2.0 * std::numbers::pi * frequency_hz;
  const auto square = [&](Shape shape) { return m.squares[index(shape)]; };
  const double t2 = m.time_constant_s * m.time_constant_s;
  return square(Shape::kQuantization) * omega * omega + square(Shape::kAngleRandomWalk) +
         square(Shape::kBiasInstability) / omega +
         square(Shape::kRateRandomWalk) / (omega * omega) +
         square(Shape::kMarkov) * t2 / (1.0 + omega * omega * t2);
}

double duration(const std::vector<AllanPoint>& points) {
  double longest_s = 0.0;
  for (const AllanPoint& p : points) {
    const double clusters = p.clusters > 0.0 ? p.clusters : p.degrees_of_freedom;
    longest_s = std::max(longest_s, (clusters + 2.0) * p.tau_s);
  }
  return longest_s;
}

// Standard deviation of the A² that a record shows: A is measured against the noise at its own
// frequency alone, with the variance 2 S(f) / T.
double tone_scatter(const NoiseModel& model, double duration_s) {
  const double square = model.squares[index(Shape::kSinusoid)];
  if (!(square > 0.0)) return 0.0;
  return std::sqrt(8.0 * square * noise_density(model, model.frequency_hz) / duration_s);
}

// ... of the R²: R is measured as the difference of the record's halves over T/2, with the variance
// 2 sigma²(T/2) / (T/2)² of the random part.
double ramp_scatter(const NoiseModel& model, double duration_s) {
  const double square = model.squares[index(Shape::kRateRamp)];
  if (!(square > 0.0)) return 0.0;
  NoiseModel random = model;
  random.squares[index(Shape::kRateRamp)] = 0.0;
  random.squares[index(Shape::kSinusoid)] = 0.0;
  return std::sqrt(32.0 * square * random.variance(0.5 * duration_s)) / duration_s;
}

}  // namespace

double variance_correlation(NoiseTerm noise, double tau_ratio) noexcept {
  assert(tau_ratio > 0.0);
  const double octaves = std::abs(std::log2(tau_ratio));
  switch (noise) {
    case NoiseTerm::kQuantization:
      return octaves == 0.0 ? 1.0 : 0.0;  // white angle: no angle shared, none alike
    case NoiseTerm::kAngleRandomWalk: return kWhite.at(octaves);
    case NoiseTerm::kBiasInstability: return kFlicker.at(octaves);
    case NoiseTerm::kRateRandomWalk: return kRandomWalk.at(octaves);
    case NoiseTerm::kRateRamp: return 1.0;  // one number decides every point
  }
  assert(false && "no such noise term");
  return 0.0;
}

PointCovariance point_covariance(const std::vector<AllanPoint>& points, const NoiseModel& model,
                                 ShapeTrust trust) {
  const auto n = static_cast<Eigen::Index>(points.size());
  const ClassTable equal_taus = covariances(1.0);
  const double duration_s = duration(points);
  const double tone = tone_scatter(model, duration_s);
  const double ramp = ramp_scatter(model, duration_s);
  std::vector<Shares> shares;
  shares.reserve(points.size());
  Eigen::VectorXd own(n), noise(n), by_tone(n), by_ramp(n);
  PointCovariance c{Eigen::VectorXd(n), Eigen::VectorXd(n), Eigen::MatrixXd::Identity(n, n)};
  for (Eigen::Index i = 0; i < n; ++i) {
    const AllanPoint& p = points[static_cast<std::size_t>(i)];
    const Shares& s = shares.emplace_back(model, p.tau_s);
    own(i) = own_covariance(s, equal_taus, terms_per_tau(p));
    const double mean = model.variance(p.tau_s);
    const double spread = std::sqrt(2.0 / degrees_of_freedom(p, s, equal_taus));
    noise(i) = mean * (1.0 - s.steady) * spread;
    by_tone(i) = tone > 0.0 ? tone * model.unit_variance(Shape::kSinusoid, p.tau_s) : 0.0;
    by_ramp(i) = ramp > 0.0 ? ramp * model.unit_variance(Shape::kRateRamp, p.tau_s) : 0.0;
    double square = noise(i) * noise(i) + by_tone(i) * by_tone(i) + by_ramp(i) * by_ramp(i);
    if (trust == ShapeTrust::kCautious) {
      const double doubt = kShapeDoubt * mean * spread;
      square += s.steady * doubt * doubt;
    }
    c.deviation(i) = std::sqrt(square);
    c.degrees_of_freedom(i) = 2.0 * mean * mean / square;
    for (Eigen::Index j = 0; j < i; ++j) {
      const ClassTable table = covariances(p.tau_s / points[static_cast<std::size_t>(j)].tau_s);
      const double correlation = class_covariance(shares[static_cast<std::size_t>(j)], s, table) /
                                 std::sqrt(own(i) * own(j));
      c.correlation(i, j) = c.correlation(j, i) =
          (correlation * noise(i) * noise(j) + by_tone(i) * by_tone(j) + by_ramp(i) * by_ramp(j)) /
          (c.deviation(i) * c.deviation(j));
    }
  }
  return c;
}

}  // namespace zerodrift::allan
