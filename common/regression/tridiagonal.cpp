// SPDX-License-Identifier: Apache-2.0
#include "common/regression/tridiagonal.h"

#include <cmath>
#include <limits>

#include "common/core/require.h"
#include "common/regression/vector_clones.h"

namespace zerodrift::regression {
namespace {

using Ridges [[gnu::vector_size(kRidgesAtOnce * sizeof(double))]] = double;

// Pivots of relative ridges from 1e-9 to 10 are multiplied so often before their logarithm is
// taken.
constexpr std::size_t kPivotsInAProduct = 8;

ZERODRIFT_VECTOR_CLONES
void eliminate(const Tridiagonal& matrix, const double* y, const ByRidge& ridges,
               RidgeFigures& figures) noexcept {
  Ridges ridge{};
  for (std::size_t i = 0; i < kRidgesAtOnce; ++i) ridge[i] = ridges[i];
  Ridges pivot = matrix.diagonal[0] + ridge;
  Ridges target = Ridges{} + y[0];
  Ridges norm = target * target / pivot;
  Ridges least = pivot;
  Ridges product = pivot;
  ByRidge logs{};
  const std::size_t size = matrix.diagonal.size();
  for (std::size_t k = 1; k < size; ++k) {
    if (k % kPivotsInAProduct == 0) {
      for (std::size_t i = 0; i < kRidgesAtOnce; ++i) logs[i] += std::log(product[i]);
      product = Ridges{} + 1.0;
    }
    const double below = matrix.subdiagonal[k - 1];
    const Ridges factor = below / pivot;
    pivot = (matrix.diagonal[k] + ridge) - below * factor;
    target = y[k] - factor * target;
    norm += target * target / pivot;
    least = pivot < least ? pivot : least;
    product *= pivot;
  }
  for (std::size_t i = 0; i < kRidgesAtOnce; ++i) {
    figures.log_determinant[i] =
        least[i] > 0.0 ? logs[i] + std::log(product[i]) : std::numeric_limits<double>::quiet_NaN();
    figures.squared_norm[i] = norm[i];
  }
}

}  // namespace

RidgeFigures figures_of(const Tridiagonal& matrix, std::span<const double> y,
                        const ByRidge& ridges) noexcept {
  core::require(
      !y.empty() && matrix.diagonal.size() == y.size() && matrix.subdiagonal.size() + 1 == y.size(),
      "a tridiagonal matrix has one subdiagonal less than rows");
  RidgeFigures figures;
  eliminate(matrix, y.data(), ridges, figures);
  return figures;
}

}  // namespace zerodrift::regression
