// SPDX-License-Identifier: Apache-2.0
#include "common/allan/chi_square.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

namespace zerodrift::allan {
namespace {

// Printed values of the standard tables (Abramowitz & Stegun 26.1, 26.8), half a unit of the last
// digit.
TEST(ChiSquare, QuantilesEqualThePublishedTables) {
  EXPECT_NEAR(normal_quantile(0.975), 1.959963984540054, 1e-13);
  EXPECT_NEAR(normal_quantile(0.8413447460685429), 1.0, 1e-13);
  EXPECT_NEAR(chi_square_quantile(0.95, 1.0), 3.84146, 5e-6);
  EXPECT_NEAR(chi_square_quantile(0.05, 1.0), 0.00393214, 5e-9);
  EXPECT_NEAR(chi_square_quantile(0.95, 10.0), 18.3070, 5e-5);
  EXPECT_NEAR(chi_square_quantile(0.025, 10.0), 3.24697, 5e-6);
  EXPECT_NEAR(chi_square_quantile(0.95, 100.0), 124.342, 5e-4);
  EXPECT_NEAR(chi_square_quantile(0.005, 100.0), 67.3276, 5e-5);
}

// Two degrees of freedom have the closed form -2 ln(1 - p); one has the square of a normal
// quantile.
TEST(ChiSquareLaws, ClosedFormsHold) {
  for (const double p : {1e-6, 0.025, 0.16, 0.5, 0.84, 0.975, 0.999999}) {
    EXPECT_NEAR(chi_square_quantile(p, 2.0) / (-2.0 * std::log1p(-p)), 1.0, 1e-10) << "p = " << p;
    const double z = normal_quantile(0.5 + 0.5 * p);
    EXPECT_NEAR(chi_square_quantile(p, 1.0) / (z * z), 1.0, 1e-8) << "p = " << p;
  }
}

TEST(ChiSquareLaws, TheDistributionOfAQuantileIsItsProbability) {
  for (const double dof : {0.3, 0.9, 1.7, 5.5, 12.81, 86.37, 782.03, 9999.0, 10001.0, 1e5}) {
    for (const double p : {0.0005, 0.025, 0.1587, 0.5, 0.8413, 0.975, 0.9995}) {
      EXPECT_NEAR(chi_square_cdf(chi_square_quantile(p, dof), dof), p, 1e-10)
          << "dof = " << dof << ", p = " << p;
    }
  }
}

// Where the expansion takes over from Newton's method neither jumps: the slope there is close to 1
// a degree of freedom.
TEST(ChiSquareLaws, TheExpansionJoinsTheExactQuantile) {
  const double below = chi_square_quantile(0.025, 9999.99);
  const double above = chi_square_quantile(0.025, 10000.01);
  EXPECT_NEAR(above - below, 0.02, 0.02 * 0.02);  // slope 1 + z / sqrt(2 nu) = 0.986
}

}  // namespace
}  // namespace zerodrift::allan
