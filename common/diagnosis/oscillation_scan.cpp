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

constexpr double kStepsPerCycle = 4.0;  // frequency steps within one resolution cell

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

OscillationPeaks oscillation_peaks(std::span<const double> weighted,
                                   std::span<const double> phase_variable,
                                   const OscillationScan& scan) {
  OscillationPeaks result;
  if (weighted.empty()) return result;
  const auto [low, high] = std::minmax_element(phase_variable.begin(), phase_variable.end());
  const double range = *high - *low;
  if (!(range > 0.0)) return result;
  const double step = 1.0 / (kStepsPerCycle * range);
  const double lowest = scan.lowest_cycles / range;
  const double wanted = std::floor((scan.highest_frequency - lowest) / step) + 1.0;
  if (!(wanted >= 1.0)) return result;
  const auto steps = static_cast<std::size_t>(std::min(wanted, static_cast<double>(scan.most)));

  // Each sample's phasor turns on by a constant angle from one frequency to the next.
  std::vector<Complex> sums(steps);
  for (std::size_t i = 0; i < weighted.size(); ++i) {
    const double u = 2.0 * std::numbers::pi * (phase_variable[i] - *low);
    Complex phasor = std::polar(1.0, lowest * u);
    const Complex turn = std::polar(1.0, step * u);
    for (std::size_t s = 0; s < steps; ++s) {
      sums[s] += weighted[i] * phasor;
      phasor *= turn;
    }
  }
  std::vector<double> power(steps);
  std::transform(sums.begin(), sums.end(), power.begin(),
                 [](const Complex& sum) { return std::norm(sum); });
  for (const std::size_t s : strongest(flattened(power), scan.peaks))
    result.frequencies.push_back(lowest + static_cast<double>(s) * step);
  result.looked_at = std::max(1.0, static_cast<double>(steps) / kStepsPerCycle);
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
