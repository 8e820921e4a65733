// SPDX-License-Identifier: Apache-2.0
// Quantiles of the normal and chi-square distributions, for degrees of freedom that need not be
// whole numbers.
#pragma once

namespace zerodrift::allan {

// z with P(Z <= z) = probability, standard normal; 0 < probability < 1. Relative error below 1e-13.
[[nodiscard]] double normal_quantile(double probability) noexcept;

// P(X <= x) for X chi-square with the given degrees of freedom > 0.
[[nodiscard]] double chi_square_cdf(double x, double degrees_of_freedom) noexcept;

// x with P(X <= x) = probability, 0 < probability < 1. Relative error below 1e-10 up to 1e4 degrees
// of freedom (Newton on the distribution); beyond, the Cornish-Fisher expansion (Johnson, Kotz &
// Balakrishnan 1994, 18.4), better still.
[[nodiscard]] double chi_square_quantile(double probability, double degrees_of_freedom) noexcept;

}  // namespace zerodrift::allan
