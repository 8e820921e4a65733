// SPDX-License-Identifier: Apache-2.0
#include "common/allan/white_part.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace zerodrift::allan {
namespace {

constexpr double kWhiteSlope = -0.5;
constexpr double kOctave = 1.9;          // times in tau, for grids that are rounded to samples
constexpr double kDistinct = 0.1;        // of slopes
constexpr double kDistinctErrors = 4.0;  // ... in standard errors
constexpr double kAsLow = 0.03;          // of the lowest slope
constexpr double kAsLowErrors = 1.0;
constexpr double kWhiteErrors = 2.0;  // of a slope that is still taken for white
constexpr double kUsefulDegreesOfFreedom = 10.0;
constexpr double kUsefulError = 0.1;

struct Slope {
  double value = 0.0;
  double error = 0.0;
};

std::optional<std::size_t> octave_after(std::span<const AllanPoint> points, std::size_t i) {
  for (std::size_t j = i + 1; j < points.size(); ++j) {
    if (points[j].tau_s >= kOctave * points[i].tau_s) return j;
  }
  return std::nullopt;
}

// From a point to the one an octave later; nothing where either says too little. The errors of both
// count as independent, which overestimates that of their difference.
std::optional<Slope> slope_at(std::span<const AllanPoint> points, std::size_t i) {
  const auto j = octave_after(points, i);
  if (!j) return std::nullopt;
  const AllanPoint& a = points[i];
  const AllanPoint& b = points[*j];
  if (std::min(a.degrees_of_freedom, b.degrees_of_freedom) < kUsefulDegreesOfFreedom)
    return std::nullopt;
  const double octaves = std::log(b.tau_s / a.tau_s);
  return Slope{std::log(b.deviation_radps / a.deviation_radps) / octaves,
               std::sqrt(0.5 / a.degrees_of_freedom + 0.5 / b.degrees_of_freedom) / octaves};
}

// Whether `a` is above `b` beyond doubt.
bool is_above(const Slope& a, const Slope& b) {
  return a.value > b.value + std::max(kDistinct, kDistinctErrors * std::hypot(a.error, b.error));
}

// The lowest slope from a point on that is known well enough to begin a fit by.
std::optional<Slope> lowest_slope(std::span<const AllanPoint> points, std::size_t from) {
  std::optional<Slope> lowest;
  for (std::size_t i = from; i < points.size(); ++i) {
    const auto slope = slope_at(points, i);
    if (slope && slope->error <= kUsefulError && (!lowest || slope->value < lowest->value))
      lowest = slope;
  }
  return lowest;
}

double tolerance(const Slope& slope) {
  return std::max(kDistinct, kWhiteErrors * slope.error);
}

bool is_steep(const Slope& slope) {
  return slope.value <= kWhiteSlope + tolerance(slope);
}

bool is_white(const Slope& slope) {
  return std::abs(slope.value - kWhiteSlope) <= tolerance(slope);
}

// One past the last point of those that are white one after the other.
std::size_t end_of_white(std::span<const AllanPoint> points, std::size_t first) {
  std::size_t end = first;
  for (std::size_t i = first; i < points.size(); ++i) {
    const auto slope = slope_at(points, i);
    if (!slope || !is_white(*slope)) break;
    end = *octave_after(points, i) + 1;
  }
  return end;
}

}  // namespace

WhitePart white_part(std::span<const AllanPoint> points) noexcept {
  WhitePart part;
  const std::size_t second_octave = octave_after(points, 0).value_or(0);
  const auto first = slope_at(points, 0);
  const auto second = slope_at(points, second_octave);
  const auto lowest = lowest_slope(points, second_octave);
  const Slope white{kWhiteSlope, 0.0};
  // What is sampled without a filter adds white noise to the first slope alone.
  const bool is_low_pass = first && second && lowest && is_above(*first, white) &&
                           (is_above(*first, *lowest) || is_above(*second, *lowest)) &&
                           !is_above(white, *lowest);
  if (!is_low_pass) {
    part.end = end_of_white(points, 0);
    return part;
  }
  part.short_taus = ShortTaus::kNeverWhite;
  if (!is_steep(*lowest)) return part;
  // By chance one of them is steeper than the curve ever is.
  const double white_from = std::max(lowest->value, kWhiteSlope) + kAsLow;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto slope = slope_at(points, i);
    if (!slope || slope->value > white_from + kAsLowErrors * slope->error) continue;
    const std::size_t octave = *octave_after(points, i);
    part.first = octave_after(points, octave).value_or(octave);
    part.end = end_of_white(points, part.first);
    part.short_taus = ShortTaus::kBandLimited;
    return part;
  }
  return part;
}

}  // namespace zerodrift::allan
