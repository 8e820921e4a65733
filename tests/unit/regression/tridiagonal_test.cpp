// SPDX-License-Identifier: Apache-2.0
// Against dense factorisations by Eigen.
#include "common/regression/tridiagonal.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <random>
#include <vector>

namespace zerodrift::regression {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr ByRidge kRidges{1e-9, 1e-7, 1e-5, 1e-3, 0.1, 0.5, 1.0, 10.0};

// Rule: determinant and norm are those of the matrix, of all sizes about a product of pivots.
TEST(TridiagonalLaws, FiguresAreThoseOfTheDenseMatrix) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (Index size = 1; size <= 70; ++size) {
    VectorXd lower_diagonal(size), y(size);
    VectorXd lower = VectorXd::Zero(size - 1);
    for (Index k = 0; k < size; ++k) {
      lower_diagonal[k] = 0.1 + std::abs(uniform(random));
      y[k] = uniform(random);
    }
    for (Index k = 0; k + 1 < size; ++k) lower[k] = uniform(random);
    // L L' of a bidiagonal L is tridiagonal and positive definite.
    MatrixXd factor = lower_diagonal.asDiagonal();
    for (Index k = 0; k + 1 < size; ++k) factor(k + 1, k) = lower[k];
    const MatrixXd dense = factor * factor.transpose();
    const VectorXd diagonal = dense.diagonal();
    const VectorXd subdiagonal = dense.diagonal(-1);
    const auto n = static_cast<std::size_t>(size);
    const RidgeFigures figures =
        figures_of({{diagonal.data(), n}, {subdiagonal.data(), n - 1}}, {y.data(), n}, kRidges);
    for (std::size_t i = 0; i < kRidges.size(); ++i) {
      const MatrixXd sum = dense + kRidges[i] * MatrixXd::Identity(size, size);
      const Eigen::LDLT<MatrixXd> solved(sum);
      EXPECT_NEAR(figures.log_determinant[i], solved.vectorD().array().log().sum(), 1e-8)
          << size << " rows, ridge " << kRidges[i];
      const double norm = y.dot(solved.solve(y));
      EXPECT_NEAR(figures.squared_norm[i], norm, 1e-7 * norm) << size << ' ' << kRidges[i];
    }
  }
}

// Rule: of a matrix that isn't positive definite nothing is said, however many pivots are negative.
TEST(TridiagonalAbuse, AnIndefiniteMatrixHasNoDeterminant) {
  for (const std::size_t negative : {1U, 2U, 3U}) {
    std::vector<double> diagonal(20, 1.0);
    const std::vector<double> subdiagonal(19, 0.0), y(20, 1.0);
    for (std::size_t k = 0; k < negative; ++k) diagonal[7 + k] = -0.3;
    const RidgeFigures figures = figures_of({diagonal, subdiagonal}, y, kRidges);
    for (std::size_t i = 0; i < kRidges.size(); ++i)
      EXPECT_EQ(std::isfinite(figures.log_determinant[i]), kRidges[i] > 0.3) << negative;
  }
}

}  // namespace
}  // namespace zerodrift::regression
