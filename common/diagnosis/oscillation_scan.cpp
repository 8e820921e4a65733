// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/oscillation_scan.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <numbers>
#include <numeric>
#include <unsupported/Eigen/FFT>
#include <utility>

#include "common/core/median.h"
#include "common/diagnosis/cosine_transform.h"

namespace zerodrift::diagnosis {
namespace {

constexpr double kBinsPerCycle = 4.0;
constexpr std::size_t kStepsPerCycle = 2;  // frequency steps within one resolution cell

using Complex = std::complex<double>;

// Power over the median of its neighbourhood, which blocks of places share.
std::vector<double> flattened(const std::vector<double>& power) {
  constexpr std::size_t kHalf = 60;
  constexpr std::size_t kBlock = 30;
  std::vector<double> ratio(power.size(), 0.0);
  for (std::size_t block = 0; block < power.size(); block += kBlock) {
    const std::size_t block_end = std::min(block + kBlock, power.size());
    const std::size_t centre = (block + block_end) / 2;
    const std::size_t begin = centre > kHalf ? centre - kHalf : 0;
    const std::size_t end = std::min(centre + kHalf + 1, power.size());
    const double median = core::median_of({power.begin() + static_cast<std::ptrdiff_t>(begin),
                                           power.begin() + static_cast<std::ptrdiff_t>(end)});
    if (!(median > 0.0)) continue;
    for (std::size_t i = block; i < block_end; ++i) ratio[i] = power[i] / median;
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

struct Periodogram {
  std::vector<double> power{};
  double first = 0.0;  // frequency of the first, in steps
  double step = 0.0;
  double cells = 0.0;  // of independent frequencies
};

// The phase variable in bins much narrower than a cycle makes the sum a Fourier transform.
Periodogram scan_power(std::span<const double> weighted, std::span<const double> phase_variable,
                       const OscillationScan& scan) {
  Periodogram result;
  if (weighted.empty()) return result;
  const auto [low, high] = std::minmax_element(phase_variable.begin(), phase_variable.end());
  const double range = *high - *low;
  if (!(range > 0.0)) return result;
  const double highest =
      std::min(scan.highest_frequency, static_cast<double>(scan.most_bins) / kBinsPerCycle / range);
  const double cycles = highest * range;
  if (!(cycles > scan.lowest_cycles)) return result;
  const auto bins = static_cast<std::size_t>(std::ceil(cycles * kBinsPerCycle));
  // Real ones are quickest at multiples of four.
  const std::size_t padded = 4 * smooth_length_from((kStepsPerCycle * bins + 3) / 4);
  std::vector<double> binned(padded, 0.0);
  const double per_unit = static_cast<double>(bins - 1) / range;
  for (std::size_t i = 0; i < weighted.size(); ++i)
    binned[static_cast<std::size_t>(std::lround((phase_variable[i] - *low) * per_unit))] +=
        weighted[i];
  std::vector<Complex> spectrum;
  Eigen::FFT<double> fft;
  fft.SetFlag(Eigen::FFT<double>::HalfSpectrum);
  fft.fwd(spectrum, binned);
  result.step = per_unit / static_cast<double>(padded);
  result.cells = cycles - scan.lowest_cycles;
  const auto first = static_cast<std::size_t>(std::ceil(scan.lowest_cycles / range / result.step));
  const auto last = std::min(static_cast<std::size_t>(highest / result.step), spectrum.size() - 1);
  result.first = static_cast<double>(first);
  for (std::size_t k = first; k <= last; ++k) result.power.push_back(std::norm(spectrum[k]));
  return result;
}

void take_strongest(OscillationPeaks& result, const Periodogram& periodogram,
                    const std::vector<double>& ratio, std::size_t count) {
  for (const std::size_t k : strongest(ratio, count)) {
    result.frequencies.push_back((periodogram.first + static_cast<double>(k)) * periodogram.step);
    result.ratios.push_back(ratio[k]);
  }
}

}  // namespace

OscillationPeaks oscillation_peaks(std::span<const double> weighted,
                                   std::span<const double> phase_variable,
                                   const OscillationScan& scan) {
  const Periodogram periodogram = scan_power(weighted, phase_variable, scan);
  OscillationPeaks result;
  take_strongest(result, periodogram, flattened(periodogram.power), scan.peaks);
  result.looked_at = std::max(1.0, periodogram.cells);
  return result;
}

OscillationPeaks angle_peaks(std::span<const double> weighted, std::span<const double> middle,
                             std::span<const double> turn, std::size_t peaks) {
  constexpr double kSlowest = 1.0 / 300.0;  // of a cycle in an interval
  constexpr double kFastest = 0.8;
  const OscillationScan usual;
  OscillationPeaks result{.looked_at = 0.0};
  std::vector<std::pair<double, double>> found;  // ratio, frequency
  if (middle.empty()) return result;
  const auto [low, high] = std::minmax_element(middle.begin(), middle.end());
  const double range = *high - *low;
  if (!(range > 0.0)) return result;
  std::vector<double> telling(weighted.size());
  double highest = static_cast<double>(usual.most_bins) / kBinsPerCycle / range;
  for (; highest * range > 2.0 * usual.lowest_cycles; highest *= 0.5) {
    const double typical = highest / std::numbers::sqrt2;
    for (std::size_t i = 0; i < telling.size(); ++i) {
      const double cycles = std::abs(turn[i]) * typical;
      const double angle = std::numbers::pi * cycles;
      const bool tells = cycles > kSlowest && cycles < kFastest;
      telling[i] = tells ? weighted[i] * std::sin(angle) / angle : 0.0;
    }
    const Periodogram octave = scan_power(
        telling, middle, {.lowest_cycles = 0.5 * highest * range, .highest_frequency = highest});
    if (octave.power.empty()) continue;
    // What few stretches of slow turning tell spreads over many steps: against the whole octave.
    std::vector<double> ratio = octave.power;
    const double median = core::median_of(octave.power);
    if (!(median > 0.0)) continue;
    for (double& r : ratio) r /= median;
    OscillationPeaks strong;
    take_strongest(strong, octave, ratio, peaks);
    for (std::size_t i = 0; i < strong.frequencies.size(); ++i)
      found.emplace_back(strong.ratios[i], strong.frequencies[i]);
    result.looked_at += octave.cells;
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  found.resize(std::min(found.size(), peaks));
  for (const auto& [ratio, frequency] : found) {
    result.frequencies.push_back(frequency);
    result.ratios.push_back(ratio);
  }
  result.looked_at = std::max(1.0, result.looked_at);
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
  const std::vector<double> ratio = flattened(power);
  for (const std::size_t k : strongest(ratio, peaks)) {
    result.frequencies.push_back(static_cast<double>(first + k) /
                                 (static_cast<double>(padded) * interval_s));
    result.ratios.push_back(ratio[k]);
  }
  result.looked_at = static_cast<double>(weighted.size()) / 2.0;
  return result;
}

namespace {

constexpr std::size_t kParts = 96;  // of a period

struct Score {
  Cycle cycle{};
  double power = -1.0;
};

// Under white noise the power of levels goes with duty (1 - duty); under noise that falls with the
// frequency it is that of the two edges, whatever the duty.
struct Fold {
  Score by_levels{};
  Score by_edges{};
};

void keep_better(Score& best, const Score& other) {
  if (other.power > best.power) best = other;
}

Fold best_fold(double frequency_hz, std::span<const double> weighted,
               std::span<const double> time_s) {
  constexpr std::size_t kShortest = 4;
  std::array<double, kParts> folded{};
  for (std::size_t i = 0; i < weighted.size(); ++i) {
    const double turns = frequency_hz * time_s[i];
    const auto part = static_cast<std::size_t>((turns - std::floor(turns)) * kParts);
    folded[std::min(part, kParts - 1)] += weighted[i];
  }
  const double sum = std::accumulate(folded.begin(), folded.end(), 0.0);
  Fold best;
  for (std::size_t first = 0; first < kParts; ++first) {
    double above = 0.0;
    for (std::size_t parts = 1; parts <= kParts / 2; ++parts) {
      above += folded[(first + parts - 1) % kParts];
      if (parts < kShortest) continue;
      const double duty = static_cast<double>(parts) / kParts;
      const double along = above - duty * sum;
      const Cycle cycle{frequency_hz, duty,
                        static_cast<double>((kParts - first) % kParts) / kParts};
      keep_better(best.by_levels, {cycle, along * along / (duty * (1.0 - duty))});
      keep_better(best.by_edges, {cycle, along * along});
    }
  }
  return best;
}

}  // namespace

std::vector<Cycle> cycles_at(std::span<const double> frequencies_hz,
                             std::span<const double> weighted, std::span<const double> time_s) {
  std::vector<Cycle> cycles;
  if (time_s.size() < 2) return cycles;
  constexpr double kFewestIntervals = 16.0;  // in a period
  constexpr int kSteps = 16;                 // to either side
  const double duration_s = time_s.back() - time_s.front();
  const double cell_hz = 1.0 / duration_s;
  const double highest_hz = static_cast<double>(time_s.size() - 1) / duration_s / kFewestIntervals;
  for (const double frequency_hz : frequencies_hz) {
    if (!(frequency_hz <= highest_hz)) continue;
    Fold best;
    for (int step = -kSteps; step <= kSteps; ++step) {
      const double near_hz = frequency_hz + 0.5 * cell_hz * step / kSteps;
      if (!(near_hz > 0.0)) continue;
      const Fold here = best_fold(near_hz, weighted, time_s);
      keep_better(best.by_levels, here.by_levels);
      keep_better(best.by_edges, here.by_edges);
    }
    if (best.by_levels.power < 0.0) continue;
    cycles.push_back(best.by_levels.cycle);
    if (best.by_edges.cycle != best.by_levels.cycle) cycles.push_back(best.by_edges.cycle);
  }
  return cycles;
}

}  // namespace zerodrift::diagnosis
