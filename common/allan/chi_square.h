// SPDX-License-Identifier: Apache-2.0
// The normal, chi-square and F distributions, for degrees of freedom that need not be whole
// numbers.
#pragma once

namespace zerodrift::allan {

// z with P(Z <= z) = probability, standard normal; 0 < probability < 1. Relative error below 1e-13.
[[nodiscard]] double normal_quantile(double probability) noexcept;

// P(X <= x) for X chi-square with the given degrees of freedom > 0.
[[nodiscard]] double chi_square_cdf(double x, double degrees_of_freedom) noexcept;

// x with P(X <= x) = probability, 0 < probability < 1. Relative error below 1e-10. Half a
// microsecond, 20 at 1e7 degrees of freedom.
[[nodiscard]] double chi_square_quantile(double probability, double degrees_of_freedom) noexcept;

// P(F > f) for F with (first, second) degrees of freedom > 0, f >= 0. Relative error below 1e-10 up
// to 1e4 degrees of freedom, below 1e-5 up to 1e9.
[[nodiscard]] double f_upper_tail(double f, double first_degrees_of_freedom,
                                  double second_degrees_of_freedom) noexcept;

}  // namespace zerodrift::allan
