// SPDX-License-Identifier: Apache-2.0
#include "common/twin/random.h"

#include <array>
#include <cmath>

namespace zerodrift::twin {
namespace {

constexpr std::uint64_t kGoldenGamma = 0x9E3779B97F4A7C15ULL;

// The output function of SplitMix64: a bijection in which every input bit moves every output bit.
constexpr std::uint64_t mix(std::uint64_t z) noexcept {
  z = (z ^ (z >> 30U)) * 0xBF58476D1CE4E5B9ULL;
  z = (z ^ (z >> 27U)) * 0x94D049BB133111EBULL;
  return z ^ (z >> 31U);
}

constexpr std::uint64_t fnv1a(std::string_view text) noexcept {
  std::uint64_t hash = 0xCBF29CE484222325ULL;
  for (const char c : text) {
    hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001B3ULL;
  }
  return hash;
}

using Coefficients = std::array<double, 8>;

// Horner's rule, constant term first.
double polynomial(const Coefficients& c, double x) noexcept {
  double value = c[7];
  for (std::size_t i = 7; i-- > 0;) value = value * x + c[i];
  return value;
}

constexpr Coefficients kCentreNumerator{3.3871328727963666080e0,  1.3314166789178437745e+2,
                                        1.9715909503065514427e+3, 1.3731693765509461125e+4,
                                        4.5921953931549871457e+4, 6.7265770927008700853e+4,
                                        3.3430575583588128105e+4, 2.5090809287301226727e+3};
constexpr Coefficients kCentreDenominator{1.0,
                                          4.2313330701600911252e+1,
                                          6.8718700749205790830e+2,
                                          5.3941960214247511077e+3,
                                          2.1213794301586595867e+4,
                                          3.9307895800092710610e+4,
                                          2.8729085735721942674e+4,
                                          5.2264952788528545610e+3};
constexpr Coefficients kTailNumerator{1.42343711074968357734e0,  4.63033784615654529590e0,
                                      5.76949722146069140550e0,  3.64784832476320460504e0,
                                      1.27045825245236838258e0,  2.41780725177450611770e-1,
                                      2.27238449892691845833e-2, 7.74545014278341407640e-4};
constexpr Coefficients kTailDenominator{1.0,
                                        2.05319162663775882187e0,
                                        1.67638483018380384940e0,
                                        6.89767334985100004550e-1,
                                        1.48103976427480074590e-1,
                                        1.51986665636164571966e-2,
                                        5.47593808499534494600e-4,
                                        1.05075007164441684324e-9};
constexpr Coefficients kFarTailNumerator{6.65790464350110377720e0,  5.46378491116411436990e0,
                                         1.78482653991729133580e0,  2.96560571828504891230e-1,
                                         2.65321895265761230930e-2, 1.24266094738807843860e-3,
                                         2.71155556874348757815e-5, 2.01033439929228813265e-7};
constexpr Coefficients kFarTailDenominator{1.0,
                                           5.99832206555887937690e-1,
                                           1.36929880922735805310e-1,
                                           1.48753612908506148525e-2,
                                           7.86869131145613259100e-4,
                                           1.84631831751005468180e-5,
                                           1.42151175831644588870e-7,
                                           2.04426310338993978564e-15};

}  // namespace

NoiseStream::NoiseStream(std::uint64_t seed, std::string_view name) noexcept
    : key_(mix(mix(seed + kGoldenGamma) ^ fnv1a(name))) {}

NoiseStream NoiseStream::substream(std::uint64_t number) const noexcept {
  return NoiseStream(mix(key_ ^ mix(number + kGoldenGamma)));
}

double NoiseStream::uniform(std::uint64_t index) const noexcept {
  const std::uint64_t bits = mix(key_ + index * kGoldenGamma) >> 11U;
  return (static_cast<double>(bits) + 0.5) * 0x1p-53;
}

double NoiseStream::gaussian(std::uint64_t index) const noexcept {
  return inverse_normal(uniform(index));
}

double inverse_normal(double p) noexcept {
  const double q = p - 0.5;
  if (std::abs(q) <= 0.425) {
    const double r = 0.180625 - q * q;
    return q * polynomial(kCentreNumerator, r) / polynomial(kCentreDenominator, r);
  }
  const double r = std::sqrt(-std::log(q < 0.0 ? p : 1.0 - p));
  const double magnitude =
      r <= 5.0 ? polynomial(kTailNumerator, r - 1.6) / polynomial(kTailDenominator, r - 1.6)
               : polynomial(kFarTailNumerator, r - 5.0) / polynomial(kFarTailDenominator, r - 5.0);
  return q < 0.0 ? -magnitude : magnitude;
}

}  // namespace zerodrift::twin
