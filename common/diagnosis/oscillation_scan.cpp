// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/oscillation_scan.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdint>
#include <numbers>
#include <unsupported/Eigen/FFT>

namespace zerodrift::diagnosis {
namespace {

constexpr double kStepsPerCycle = 2.0;  // frequency steps within one resolution cell

using Complex = std::complex<double>;

// Power over the median of its neighbourhood.
std::vector<double> flattened(const std::vector<double>& power) {
  constexpr std::size_t kHalf = 60;
  std::vector<double> ratio(power.size(), 0.0);
  std::vector<double> around;
  for (std::size_t i = 0; i < power.size(); ++i) {
    const std::size_t begin = i > kHalf ? i - kHalf : 0;
    const std::size_t end = std::min(i + kHalf + 1, power.size());
    around.assign(power.begin() + static_cast<std::ptrdiff_t>(begin),
                  power.begin() + static_cast<std::ptrdiff_t>(end));
    const auto middle = around.begin() + static_cast<std::ptrdiff_t>(around.size() / 2);
    std::nth_element(around.begin(), middle, around.end());
    if (*middle > 0.0) ratio[i] = power[i] / *middle;
  }
  return ratio;
}

// Places of the local maxima, strongest first.
std::vector<std::size_t> strongest(const std::vector<double>& ratio, std::size_t count) {
  std::vector<std::size_t> places;
  for (std::size_t i = 0; i < ratio.size(); ++i) {
    const bool above_left = i == 0 || ratio[i] > ratio[i - 1];
    const bool above_right = i + 1 == ratio.size() || ratio[i] >= ratio[i + 1];
    if (above_left && above_right && ratio[i] > 0.0) places.push_back(i);
  }
  const std::size_t kept = std::min(count, places.size());
  std::partial_sort(places.begin(), places.begin() + static_cast<std::ptrdiff_t>(kept),
                    places.end(),
                    [&](std::size_t a, std::size_t b) { return ratio[a] > ratio[b]; });
  places.resize(kept);
  return places;
}

}  // namespace

// The phase variable in bins much narrower than a cycle makes the sum a Fourier transform.
OscillationPeaks oscillation_peaks(std::span<const double> weighted,
                                   std::span<const double> phase_variable,
                                   const OscillationScan& scan) {
  constexpr double kBinsPerCycle = 4.0;
  OscillationPeaks result;
  if (weighted.empty()) return result;
  const auto [low, high] = std::minmax_element(phase_variable.begin(), phase_variable.end());
  const double range = *high - *low;
  if (!(range > 0.0)) return result;
  const double highest =
      std::min(scan.highest_frequency, static_cast<double>(scan.most_bins) / kBinsPerCycle / range);
  const double cycles = highest * range;
  if (!(cycles > scan.lowest_cycles)) return result;
  const auto bins = static_cast<std::size_t>(std::ceil(cycles * kBinsPerCycle)) + 1;
  std::size_t padded = 1;
  while (padded < static_cast<std::size_t>(kStepsPerCycle) * bins) padded *= 2;
  std::vector<double> binned(padded, 0.0);
  const double per_unit = static_cast<double>(bins - 1) / range;
  for (std::size_t i = 0; i < weighted.size(); ++i)
    binned[static_cast<std::size_t>(std::lround((phase_variable[i] - *low) * per_unit))] +=
        weighted[i];
  std::vector<Complex> spectrum;
  Eigen::FFT<double> fft;
  fft.SetFlag(Eigen::FFT<double>::HalfSpectrum);
  fft.fwd(spectrum, binned);
  const double step = per_unit / static_cast<double>(padded);  // of frequency
  const auto first = static_cast<std::size_t>(std::ceil(scan.lowest_cycles / range / step));
  const auto last = static_cast<std::size_t>(highest / step);
  std::vector<double> power;
  for (std::size_t k = first; k <= last; ++k) power.push_back(std::norm(spectrum[k]));
  for (const std::size_t k : strongest(flattened(power), scan.peaks))
    result.frequencies.push_back(static_cast<double>(first + k) * step);
  result.looked_at = std::max(1.0, cycles - scan.lowest_cycles);
  return result;
}

OscillationPeaks line_peaks(std::span<const double> weighted, double interval_s,
                            std::size_t peaks) {
  OscillationPeaks result;
  if (weighted.size() < 16) return result;
  std::size_t padded = 1;
  while (padded < 2 * weighted.size()) padded *= 2;
  std::vector<Complex> series(padded);
  std::copy(weighted.begin(), weighted.end(), series.begin());
  std::vector<Complex> spectrum;
  Eigen::FFT<double> fft;
  fft.fwd(spectrum, series);
  // From two periods within the record on.
  const auto first = 2 * padded / weighted.size();
  std::vector<double> power(padded / 2 - first);
  for (std::size_t k = 0; k < power.size(); ++k) power[k] = std::norm(spectrum[first + k]);
  for (const std::size_t k : strongest(flattened(power), peaks)) {
    result.frequencies.push_back(static_cast<double>(first + k) /
                                 (static_cast<double>(padded) * interval_s));
  }
  result.looked_at = static_cast<double>(weighted.size()) / 2.0;
  return result;
}

}  // namespace zerodrift::diagnosis
