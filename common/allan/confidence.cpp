// SPDX-License-Identifier: Apache-2.0
#include "common/allan/confidence.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <limits>

#include "common/allan/chi_square.h"

namespace zerodrift::allan {
namespace {

constexpr double kMaxSumTerms = 100.0;
constexpr double kContinuous = std::numeric_limits<double>::infinity();

int order(Difference difference) {
  return static_cast<int>(difference);
}
int exponent(NoiseType noise) {
  return static_cast<int>(noise);
}

// Generalised autocovariance of the angle for rate noise f^alpha, up to a factor. G&R eq. 7.
double angle_covariance(double t, int alpha) {
  const double u = std::abs(t);
  switch (alpha) {
    case 2: return -u;
    case 1: return u == 0.0 ? 0.0 : u * u * std::log(u);
    case 0: return u * u * u;
    case -1: return u == 0.0 ? 0.0 : -u * u * u * u * std::log(u);
    case -2: return -u * u * u * u * u;
    default: assert(false && "no such noise exponent"); return 0.0;
  }
}

// ... of the angle filtered over tau/filter. G&R eq. 8.
double filtered_covariance(double t, double filter, int alpha) {
  if (std::isinf(filter)) {
    // The second derivative, up to a factor: alpha + 2 in eq. 7.
    return angle_covariance(t, alpha + 2);
  }
  return filter * filter *
         (2.0 * angle_covariance(t, alpha) - angle_covariance(t - 1.0 / filter, alpha) -
          angle_covariance(t + 1.0 / filter, alpha));
}

// ... of its second or third difference at lag tau, for a shift of t tau. G&R eq. 9.
double difference_covariance(double t, double filter, int alpha, Difference difference) {
  const auto sx = [&](double lag) { return filtered_covariance(t + lag, filter, alpha); };
  if (difference == Difference::kSecond) {
    return 6.0 * sx(0.0) - 4.0 * (sx(-1.0) + sx(1.0)) + sx(-2.0) + sx(2.0);
  }
  return 20.0 * sx(0.0) - 15.0 * (sx(-1.0) + sx(1.0)) + 6.0 * (sx(-2.0) + sx(2.0)) - sx(-3.0) -
         sx(3.0);
}

// 1 / edf = basic sum / (sz(0)² M). G&R eq. 10 and 13.
double summed(double correlated_terms, double terms, double terms_per_tau, double filter, int alpha,
              Difference difference) {
  const auto squared = [&](double j) {
    const double sz = difference_covariance(j / terms_per_tau, filter, alpha, difference);
    return sz * sz;
  };
  const double variance = squared(0.0);
  double sum = variance + (1.0 - correlated_terms / terms) * squared(correlated_terms);
  for (double j = 1.0; j < correlated_terms; j += 1.0) sum += 2.0 * (1.0 - j / terms) * squared(j);
  return variance * terms / sum;
}

struct Asymptote {
  double a0;
  double a1;
};

std::size_t row(NoiseType noise) {
  return static_cast<std::size_t>(2 - exponent(noise));
}

// G&R tables 1 and 2: rows alpha = 2, 1, 0, -1, -2, columns d = 2, 3. Row alpha = 1 is not a gyro
// noise here; the plain alpha = 2 has its own sum.
Asymptote asymptote(const EstimateDesign& design) {
  static constexpr std::array<std::array<Asymptote, 2>, 5> kModified{
      {{{{7.0 / 9.0, 1.0 / 2.0}, {22.0 / 25.0, 2.0 / 3.0}}},
       {{{0.997, 0.616}, {1.141, 0.843}}},
       {{{1.033, 0.607}, {1.184, 0.848}}},
       {{{1.048, 0.534}, {1.180, 0.816}}},
       {{{1.302, 0.535}, {1.175, 0.777}}}}};
  static constexpr std::array<std::array<Asymptote, 2>, 5> kPlain{
      {{{{35.0 / 18.0, 1.0}, {231.0 / 100.0, 3.0 / 2.0}}},
       {{{790.0, 410.0}, {9950.0, 6520.0}}},
       {{{2.0 / 3.0, 1.0 / 3.0}, {7.0 / 9.0, 1.0 / 2.0}}},
       {{{0.852, 0.375}, {0.997, 0.617}}},
       {{{1.079, 0.368}, {1.033, 0.607}}}}};
  const auto& table = design.averaging == Averaging::kModified ? kModified : kPlain;
  return table[row(design.noise)][design.difference == Difference::kSecond ? 0 : 1];
}

// White angle: differences are correlated only at whole multiples of tau, with ratios of binomials.
// G&R case 4; for r > 2 and d = 2 this is M / (35/18 - 1/r).
double white_angle(const EstimateDesign& design) {
  static constexpr std::array<double, 2> kSecond{4.0 / 6.0, 1.0 / 6.0};
  static constexpr std::array<double, 3> kThird{15.0 / 20.0, 6.0 / 20.0, 1.0 / 20.0};
  const double r = design.terms / design.terms_per_tau;
  double inverse = 1.0;
  const auto add = [&](const auto& correlation) {
    for (std::size_t k = 0; k < correlation.size(); ++k) {
      const double overlap = 1.0 - static_cast<double>(k + 1) / r;
      if (overlap > 0.0) inverse += 2.0 * overlap * correlation[k] * correlation[k];
    }
  };
  if (design.difference == Difference::kSecond) {
    add(kSecond);
  } else {
    add(kThird);
  }
  return design.terms / inverse;
}

}  // namespace

double equivalent_degrees_of_freedom(const EstimateDesign& design) noexcept {
  assert(design.terms >= 1.0 && design.terms_per_tau >= 1.0);
  const bool modified = design.averaging == Averaging::kModified;
  if (design.noise == NoiseType::kQuantization && !modified) return white_angle(design);

  const int d = order(design.difference);
  const int alpha = exponent(design.noise);
  const double correlated = std::min(design.terms, (d + 1) * design.terms_per_tau);
  const bool small_cluster = design.cluster_size * (d + 1) <= kMaxSumTerms;
  const double filter = modified ? 1.0 : (small_cluster ? design.cluster_size : kContinuous);
  if (correlated <= kMaxSumTerms) {
    return summed(correlated, design.terms, design.terms_per_tau, filter, alpha, design.difference);
  }
  const double r = design.terms / design.terms_per_tau;
  if (r > d + 1) {
    const Asymptote a = asymptote(design);
    return r / (a.a0 - a.a1 / r);
  }
  return summed(kMaxSumTerms, kMaxSumTerms, kMaxSumTerms / r, modified ? 1.0 : kContinuous, alpha,
                design.difference);
}

Bounds deviation_bounds(double deviation, double degrees_of_freedom, double confidence) noexcept {
  const double tail = 0.5 * (1.0 - confidence);
  const auto bound = [&](double probability) {
    return deviation *
           std::sqrt(degrees_of_freedom / chi_square_quantile(probability, degrees_of_freedom));
  };
  return {bound(1.0 - tail), bound(tail)};
}

NoiseType noise_type_from_lag1(double autocorrelation, double clusters) noexcept {
  // Midpoints between -2/3, -1/2, (9 ln 3 - 16 ln 2) / (8 ln 2) = -0.2170 and 1/4.
  const double white_angle_below = std::min(-0.5833, -0.5 - 1.5 / std::sqrt(clusters));
  if (autocorrelation < white_angle_below) return NoiseType::kQuantization;
  if (autocorrelation < -0.3585) return NoiseType::kAngleRandomWalk;
  if (autocorrelation < 0.0165) return NoiseType::kBiasInstability;
  return NoiseType::kRateRandomWalk;
}

}  // namespace zerodrift::allan
