// SPDX-License-Identifier: Apache-2.0
#include "common/regression/kernel.h"

#include <bit>
#include <cmath>
#include <cstdint>

#include "common/core/require.h"
#include "common/regression/vector_clones.h"
#include "common/regression/vector_operations.h"

namespace zerodrift::regression {
namespace {

// exp(z) and exp(z) - 1 for z <= 0, relative errors below 4e-16; z < -708 counts as -708. z = n ln
// 2 + r with |r| <= ln(2)/2 (two-part ln 2 after Cody & Waite), expm1(r) by its Taylor series to
// r^13 (remainder below 5e-18), and 2^n by its bit pattern.
struct Exponential {
  double value;     // exp(z)
  double less_one;  // exp(z) - 1
};

ZERODRIFT_IN_CLONE Exponential exponential_of_nonpositive(double z) {
  constexpr double kLowest = -708.0;
  constexpr double kLog2E = 1.4426950408889634;
  constexpr double kLn2High = 0x1.62e42fee00000p-1;
  constexpr double kLn2Low = 0x1.a39ef35793c76p-33;
  constexpr double kRoundToInteger = 0x1.8p52;  // leaves the integer in the low bits
  constexpr std::uint64_t kExponentBias = 1023;

  z = z > kLowest ? z : kLowest;
  const double shifted = z * kLog2E + kRoundToInteger;
  const double n = shifted - kRoundToInteger;
  const double r = (z - n * kLn2High) - n * kLn2Low;
  double series = 1.0 / 6227020800.0;
  series = series * r + 1.0 / 479001600.0;
  series = series * r + 1.0 / 39916800.0;
  series = series * r + 1.0 / 3628800.0;
  series = series * r + 1.0 / 362880.0;
  series = series * r + 1.0 / 40320.0;
  series = series * r + 1.0 / 5040.0;
  series = series * r + 1.0 / 720.0;
  series = series * r + 1.0 / 120.0;
  series = series * r + 1.0 / 24.0;
  series = series * r + 1.0 / 6.0;
  series = series * r + 0.5;
  const double expm1_r = r + (r * r) * series;
  const double power =
      std::bit_cast<double>((std::bit_cast<std::uint64_t>(shifted) + kExponentBias) << 52);
  return {power * expm1_r + power, power * expm1_r + (power - 1.0)};
}

// The first features at once: their sums stay in registers.
template <std::size_t kFeatures, typename Term>
ZERODRIFT_IN_CLONE void write_first_sums(const SampleColumns& samples, const double* x,
                                         double* __restrict out, Term term) {
  for (std::size_t i = 0; i < samples.count; ++i) {
    double sum = term(samples.data[i], x[0]);
    for (std::size_t d = 1; d < kFeatures; ++d)
      sum += term(samples.data[d * samples.stride + i], x[d]);
    out[i] = sum;
  }
}

// out_i = sum over the features d, in their order, of term(x_i[d], x[d]).
template <typename Term>
ZERODRIFT_IN_CLONE void write_sums(const SampleColumns& samples, const double* x,
                                   double* __restrict out, Term term) {
  constexpr std::size_t kAtOnce = 3;
  switch (samples.dimension) {
    case 1: write_first_sums<1>(samples, x, out, term); break;
    case 2: write_first_sums<2>(samples, x, out, term); break;
    default: write_first_sums<kAtOnce>(samples, x, out, term);
  }
  for (std::size_t d = kAtOnce; d < samples.dimension; ++d) {
    const double* __restrict column = samples.data + d * samples.stride;
    for (std::size_t i = 0; i < samples.count; ++i) out[i] += term(column[i], x[d]);
  }
}

ZERODRIFT_IN_CLONE void write_squared_distances(const SampleColumns& samples, const double* x,
                                                double* __restrict out) {
  write_sums(
      samples, x, out,
      [](double a, double b) __attribute__((always_inline)) { return (a - b) * (a - b); });
}

ZERODRIFT_IN_CLONE void write_scalar_products(const SampleColumns& samples, const double* x,
                                              double* __restrict out) {
  write_sums(
      samples, x, out, [](double a, double b) __attribute__((always_inline)) { return a * b; });
}

// (1 + s + c s²) exp(-s) - 1, written so that near samples keep their digits; c is 0 for Matérn
// 3/2, 1/3 for Matérn 5/2.
ZERODRIFT_IN_CLONE double matern_less_one(double s, double c) {
  constexpr double kHighest = 708.0;
  s = s < kHighest ? s : kHighest;
  const Exponential e = exponential_of_nonpositive(-s);
  return e.less_one + (s + c * (s * s)) * e.value;
}

ZERODRIFT_IN_CLONE void write_row(const Kernel& kernel, const SampleColumns& samples,
                                  const double* x, double* __restrict out) {
  const std::size_t count = samples.count;
  const double gamma = kernel.gamma;
  switch (kernel.kind) {
    case KernelKind::kRbf:
      write_squared_distances(samples, x, out);
      for (std::size_t i = 0; i < count; ++i)
        out[i] = exponential_of_nonpositive(-(gamma * out[i])).less_one;
      return;
    case KernelKind::kMatern32:
      write_squared_distances(samples, x, out);
      for (std::size_t i = 0; i < count; ++i) {
        out[i] = matern_less_one(std::sqrt((6.0 * gamma) * out[i]), 0.0);
      }
      return;
    case KernelKind::kMatern52:
      write_squared_distances(samples, x, out);
      for (std::size_t i = 0; i < count; ++i) {
        out[i] = matern_less_one(std::sqrt((10.0 * gamma) * out[i]), 1.0 / 3.0);
      }
      return;
    case KernelKind::kPolynomial:
      write_scalar_products(samples, x, out);
      for (std::size_t i = 0; i < count; ++i) {
        const double base = gamma * out[i] + kernel.offset;
        double power = base;
        for (int k = 1; k < kernel.degree; ++k) power *= base;
        out[i] = power;
      }
      return;
    case KernelKind::kLinear: write_scalar_products(samples, x, out); return;
  }
}

ZERODRIFT_VECTOR_CLONES
void evaluate_row_for_any_width(const Kernel& kernel, const SampleColumns& samples, const double* x,
                                double* out) noexcept {
  write_row(kernel, samples, x, out);
}

ZERODRIFT_VECTOR_CLONES
void squared_distances_for_any_width(const SampleColumns& samples, const double* x,
                                     double* out) noexcept {
  write_squared_distances(samples, x, out);
}

}  // namespace

std::optional<std::string> Kernel::validate() const {
  if (kind > KernelKind::kLinear) {
    return "kernel.kind: found " + std::to_string(static_cast<int>(kind)) + ", expected 0 to 4";
  }
  if (!(std::isfinite(gamma) && gamma > 0.0)) {
    return "kernel.gamma: found " + std::to_string(gamma) + ", expected a number above 0";
  }
  if (kind == KernelKind::kPolynomial && (degree < 1 || degree > 8)) {
    return "kernel.degree: found " + std::to_string(degree) + ", expected 1 to 8";
  }
  if (kind == KernelKind::kPolynomial && !(std::isfinite(offset) && offset >= 0.0)) {
    return "kernel.offset: found " + std::to_string(offset) + ", expected a number of at least 0";
  }
  return std::nullopt;
}

bool Kernel::is_stationary() const noexcept {
  return kind == KernelKind::kRbf || kind == KernelKind::kMatern32 || kind == KernelKind::kMatern52;
}

void evaluate_row(const Kernel& kernel, const SampleColumns& samples, const double* x,
                  double* out) noexcept {
  evaluate_row_for_any_width(kernel, samples, x, out);
}

double self_value(const Kernel& kernel, const double* x, std::size_t dimension) noexcept {
  double value = 0.0;
  evaluate_row(kernel, {x, 1, dimension, 1}, x, &value);
  return value;
}

void squared_distance_row(const SampleColumns& samples, const double* x, double* out) noexcept {
  squared_distances_for_any_width(samples, x, out);
}

void KernelExpansion::add_block(const SampleColumns& samples, const double* weights) noexcept {
  core::require(samples.count <= kExpansionBlock, "a kernel expansion is added block by block");
  double row[kExpansionBlock];
  evaluate_row(kernel_, samples, x_, row);
  total_ += dot(row, weights, samples.count);
}

}  // namespace zerodrift::regression
