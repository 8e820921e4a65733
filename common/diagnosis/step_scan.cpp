// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/step_scan.h"

#include <algorithm>
#include <complex>
#include <unsupported/Eigen/FFT>

#include "common/core/require.h"
#include "common/diagnosis/cosine_transform.h"

namespace zerodrift::diagnosis {
namespace {

// A step is followed best where it is within about 1/d² of the record.
constexpr double kPlacesToldApart = 500.0;
constexpr std::size_t kSpacings = 50;  // in a series, between places

// s' C^-1 s of the step before each place, about its mean. The cosine transform of a step before k
// is -sin(pi m k / n) / sin(pi m / 2n), over sqrt(2 n): its weighted square is one sum of cosines
// in k.
std::vector<double> information(std::span<const double> variances) {
  const std::size_t n = variances.size();
  std::vector<std::complex<double>> weights(n), sums;
  double all = 0.0;
  for (std::size_t m = 1; m < n; ++m) {
    if (!(variances[m] > 0.0)) continue;
    const double weight = 1.0 / (laplacian_eigenvalue(m, n) * variances[m]);
    weights[m] = weight;
    all += weight;
  }
  Eigen::FFT<double> fft;
  fft.fwd(sums, weights);
  std::vector<double> squares(n);
  for (std::size_t k = 0; k < n; ++k) squares[k] = (all - sums[k].real()) / static_cast<double>(n);
  return squares;
}

}  // namespace

StepPlaces step_places(std::span<const double> weighted, std::span<const double> variances,
                       std::size_t most) {
  core::require(weighted.size() == variances.size(),
                "each coefficient of a series has its noise variance");
  const std::size_t n = weighted.size();
  StepPlaces found{.looked_at = kPlacesToldApart};
  if (n < 2 * kSpacings) return found;
  const std::vector<double> squares = information(variances);
  std::vector<double> gain(n, 0.0);
  double after = 0.0;  // of the values from k on; all of them sum to 0
  for (std::size_t k = n - 1; k > 0; --k) {
    after += weighted[k];
    if (squares[k] > 0.0) gain[k] = after * after / squares[k];
  }
  const std::size_t spacing = n / kSpacings;
  while (found.first_after.size() < most) {
    const auto begin = gain.begin() + static_cast<std::ptrdiff_t>(spacing);
    const auto end = gain.end() - static_cast<std::ptrdiff_t>(spacing);
    const auto best = std::max_element(begin, end);
    if (!(*best > 0.0)) break;
    const auto place = static_cast<std::size_t>(best - gain.begin());
    found.first_after.push_back(place);
    const auto low = place - spacing;
    const auto high = std::min(place + spacing + 1, n);
    std::fill(gain.begin() + static_cast<std::ptrdiff_t>(low),
              gain.begin() + static_cast<std::ptrdiff_t>(high), 0.0);
  }
  return found;
}

}  // namespace zerodrift::diagnosis
