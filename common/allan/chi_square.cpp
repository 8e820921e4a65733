// SPDX-License-Identifier: Apache-2.0
#include "common/allan/chi_square.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>

namespace zerodrift::allan {
namespace {

constexpr double kRelativePrecision = 1e-16;
constexpr int kMaxTerms = 100000;
constexpr double kExpansionFrom = 1e4;  // degrees of freedom

// ln Gamma(a), a > 0: recurrence to a >= 15, then Stirling's series (next term < 1e-16 there). Not
// std::lgamma, which writes a global.
double log_gamma(double a) {
  double product = 1.0;
  for (; a < 15.0; a += 1.0) product *= a;
  const double inverse_square = 1.0 / (a * a);
  const double series =
      (1.0 / 12.0 +
       inverse_square *
           (-1.0 / 360.0 +
            inverse_square *
                (1.0 / 1260.0 + inverse_square * (-1.0 / 1680.0 + inverse_square / 1188.0)))) /
      a;
  return (a - 0.5) * std::log(a) - a + 0.5 * std::log(2.0 * std::numbers::pi) + series -
         std::log(product);
}

// x^a e^-x / Gamma(a)
double gamma_kernel(double a, double x) {
  return std::exp(a * std::log(x) - x - log_gamma(a));
}

// Regularised lower incomplete gamma function by its power series (DLMF 8.11.4); for x < a + 1.
double lower_gamma_series(double a, double x) {
  double term = 1.0 / a;
  double sum = term;
  for (int n = 1; n < kMaxTerms && term > sum * kRelativePrecision; ++n) {
    term *= x / (a + n);
    sum += term;
  }
  return sum * gamma_kernel(a, x);
}

// Regularised upper incomplete gamma function by its continued fraction (DLMF 8.9.2), modified
// Lentz; for x >= a + 1.
double upper_gamma_fraction(double a, double x) {
  constexpr double kTiny = 1e-300;
  double b = x + 1.0 - a;
  double c = 1.0 / kTiny;
  double d = 1.0 / b;
  double fraction = d;
  for (int n = 1; n < kMaxTerms; ++n) {
    const double numerator = -n * (n - a);
    b += 2.0;
    d = numerator * d + b;
    if (std::abs(d) < kTiny) d = kTiny;
    c = b + numerator / c;
    if (std::abs(c) < kTiny) c = kTiny;
    d = 1.0 / d;
    fraction *= d * c;
    if (std::abs(d * c - 1.0) < 4.0 * kRelativePrecision) break;
  }
  return fraction * gamma_kernel(a, x);
}

// Modified Lentz for DLMF 8.17.22; converges fast for x < (a + 1) / (a + b + 2).
double beta_fraction(double x, double a, double b) {
  constexpr double kTiny = 1e-300;
  const auto away_from_zero = [](double v) { return std::abs(v) < kTiny ? kTiny : v; };
  double c = 1.0;
  double d = 1.0 / away_from_zero(1.0 - (a + b) * x / (a + 1.0));
  double fraction = d;
  for (int m = 1; m < kMaxTerms; ++m) {
    const double even = m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m));
    d = 1.0 / away_from_zero(1.0 + even * d);
    c = away_from_zero(1.0 + even / c);
    fraction *= d * c;
    const double odd = -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0));
    d = 1.0 / away_from_zero(1.0 + odd * d);
    c = away_from_zero(1.0 + odd / c);
    fraction *= d * c;
    if (std::abs(d * c - 1.0) < 4.0 * kRelativePrecision) break;
  }
  return fraction;
}

// I_x(a, b), the complement 1 - x given beside x so that neither loses digits.
double regularised_beta(double x, double complement, double a, double b) {
  if (x <= 0.0) return 0.0;
  if (complement <= 0.0) return 1.0;
  const double kernel = std::exp(a * std::log(x) + b * std::log(complement) + log_gamma(a + b) -
                                 log_gamma(a) - log_gamma(b));
  if (x < (a + 1.0) / (a + b + 2.0)) return kernel * beta_fraction(x, a, b) / a;
  return 1.0 - kernel * beta_fraction(complement, b, a) / b;
}

double chi_square_expansion(double probability, double nu) {
  const double z = normal_quantile(probability);
  const double z2 = z * z;
  const double root = std::sqrt(2.0 * nu);
  return nu + root * z + 2.0 / 3.0 * (z2 - 1.0) + z * (z2 - 7.0) / (9.0 * root) -
         (6.0 * z2 * z2 + 14.0 * z2 - 32.0) / (405.0 * nu) +
         z * (9.0 * z2 * z2 + 256.0 * z2 - 433.0) / (4860.0 * root * nu);
}

// Wilson & Hilferty 1931; where that is no use (far left tail) the leading term of the series.
double first_guess(double probability, double nu) {
  const double spread = 2.0 / (9.0 * nu);
  const double cube_root = 1.0 - spread + normal_quantile(probability) * std::sqrt(spread);
  if (cube_root > 0.3) return nu * cube_root * cube_root * cube_root;
  const double a = 0.5 * nu;
  return 2.0 * std::exp((std::log(probability) + log_gamma(a + 1.0)) / a);
}

}  // namespace

double normal_quantile(double probability) noexcept {
  assert(probability > 0.0 && probability < 1.0 && "a quantile needs a probability inside (0, 1)");
  if (probability > 0.5) return -normal_quantile(1.0 - probability);
  // Abramowitz & Stegun 26.2.23 (4.5e-4), then Newton steps on the complementary error function.
  const double t = std::sqrt(-2.0 * std::log(probability));
  double z = -(t - (2.515517 + t * (0.802853 + t * 0.010328)) /
                       (1.0 + t * (1.432788 + t * (0.189269 + t * 0.001308))));
  for (int step = 0; step < 3; ++step) {
    const double cdf = 0.5 * std::erfc(-z / std::numbers::sqrt2);
    const double density = std::exp(-0.5 * z * z) / std::sqrt(2.0 * std::numbers::pi);
    const double newton = (cdf - probability) / density;
    z -= newton / (1.0 + 0.5 * z * newton);  // Halley
  }
  return z;
}

double chi_square_cdf(double x, double degrees_of_freedom) noexcept {
  assert(degrees_of_freedom > 0.0);
  if (x <= 0.0) return 0.0;
  const double a = 0.5 * degrees_of_freedom;
  const double half = 0.5 * x;
  return half < a + 1.0 ? lower_gamma_series(a, half) : 1.0 - upper_gamma_fraction(a, half);
}

double chi_square_quantile(double probability, double degrees_of_freedom) noexcept {
  assert(probability > 0.0 && probability < 1.0 && "a quantile needs a probability inside (0, 1)");
  assert(degrees_of_freedom > 0.0);
  if (degrees_of_freedom > kExpansionFrom)
    return chi_square_expansion(probability, degrees_of_freedom);
  const double a = 0.5 * degrees_of_freedom;
  double below = 0.0;
  double above = std::numeric_limits<double>::infinity();
  double x =
      std::max(first_guess(probability, degrees_of_freedom), std::numeric_limits<double>::min());
  for (int step = 0; step < 200; ++step) {
    const double error = chi_square_cdf(x, degrees_of_freedom) - probability;
    (error > 0.0 ? above : below) = x;
    const double density = gamma_kernel(a, 0.5 * x) / x;
    double next = x - error / density;
    if (!(next > below && next < above)) next = std::isinf(above) ? 2.0 * x : 0.5 * (below + above);
    const bool settled = std::abs(next - x) <= 1e-14 * x;
    x = next;
    if (settled) break;
  }
  return x;
}

double f_upper_tail(double f, double first_degrees_of_freedom,
                    double second_degrees_of_freedom) noexcept {
  assert(f >= 0.0 && first_degrees_of_freedom > 0.0 && second_degrees_of_freedom > 0.0);
  if (std::isinf(f)) return 0.0;
  const double first = first_degrees_of_freedom * f;
  const double sum = second_degrees_of_freedom + first;
  return regularised_beta(second_degrees_of_freedom / sum, first / sum,
                          0.5 * second_degrees_of_freedom, 0.5 * first_degrees_of_freedom);
}

}  // namespace zerodrift::allan
