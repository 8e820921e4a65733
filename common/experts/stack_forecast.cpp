// SPDX-License-Identifier: Apache-2.0
#include "common/experts/stack_forecast.h"

#include <algorithm>
#include <cmath>

namespace zerodrift::experts {
namespace {

constexpr double kInterpolationOdds = 20.0;
constexpr double kSvrBesideCubic = 0.5;
constexpr double kSmallestWidth = 1e-100;  // a number to take the logarithm of

// What goes from the mean of all to that of the maps, so that these have kInterpolationOdds times
// their odds.
double shift_to_maps(double maps_share) noexcept {
  return (kInterpolationOdds - 1.0) * maps_share / (1.0 + (kInterpolationOdds - 1.0) * maps_share);
}

}  // namespace

double StackMean::at(double time_s, const Basis& basis,
                     const std::optional<SvrForecast>& by_svr) const noexcept {
  const double by_linear = linear.at(time_s, basis);
  if (!by_svr) return by_linear;
  const double by_all = by_linear + svr_share * (by_svr->drift - by_linear);
  if (!by_svr->interpolates || maps_share == 0.0) return by_all;
  const double by_maps = by_svr->holds
                             ? linear_maps.at(time_s, basis)
                             : std::lerp(cubic.at(time_s, basis), by_svr->drift, kSvrBesideCubic);
  return by_all + shift_to_maps(maps_share) * (by_maps - by_all);
}

// One label ahead is as far as labels are apart.
double StackForecast::age_of(std::size_t h) const noexcept {
  return h == 0 ? std::clamp(spacing_s, 1e-3, 0.5 * kHorizonsS[1]) : kHorizonsS[h];
}

// Ages between two horizons: linear in the logarithm.
StackForecast::Between StackForecast::between(double age_s) const noexcept {
  if (age_s <= age_of(0)) return {0, 0, 0.0};
  std::size_t h = 1;
  while (h + 1 < kHorizons && age_s > age_of(h)) ++h;
  const double share = std::log(age_s / age_of(h - 1)) / std::log(age_of(h) / age_of(h - 1));
  return {h - 1, h, std::clamp(share, 0.0, 1.0)};
}

// Between two horizons that were judged a power of the age: an error whose variance is a sum of
// such powers, as of noise, walk and ramp, is no larger, since the logarithm of the sum is convex
// in that of the age.
double StackForecast::half_width(double age_s, const Between& at) const noexcept {
  const auto is_judged = [&](std::size_t h) { return horizons[h].half_width >= 0.0; };
  std::size_t lower = at.lower;
  std::size_t upper = at.upper;
  while (lower > 0 && !is_judged(lower)) --lower;
  while (upper + 1 < kHorizons && !is_judged(upper)) ++upper;
  if (is_judged(lower) && is_judged(upper)) {
    if (lower == upper) return horizons[lower].half_width;
    const double least = std::max(kNormalQuantile * std::sqrt(level_variance), kSmallestWidth);
    const auto logarithm = [&](std::size_t h) {
      return std::log(std::max(horizons[h].half_width, least));
    };
    const double share = std::log(age_s / age_of(lower)) / std::log(age_of(upper) / age_of(lower));
    return std::exp(std::lerp(logarithm(lower), logarithm(upper), std::min(share, 1.0)));
  }
  for (std::size_t h = at.upper + 1; h-- > 0;) {
    if (is_judged(h)) return horizons[h].half_width * std::max(1.0, age_s / age_of(h));
  }
  return -1.0;
}

StackForecast::Prediction StackForecast::predict(
    double now_s, const ThermalState& thermal,
    const std::optional<SvrForecast>& by_svr) const noexcept {
  if (!knows()) return {};
  // Where the clock was set back (a power-on), time has gone by since, and nobody knows how much.
  const double age_s = now_s < time_s ? age_of(kHorizons - 1) : now_s - time_s;
  const double until_s = std::max(now_s, time_s);
  const Basis basis = basis_of(thermal, reference_temperature);
  const Between at = between(age_s);
  const Horizon& a = horizons[at.lower];
  const Horizon& b = horizons[at.upper];
  Prediction made;
  made.drift = (1.0 - at.share) * a.mean.at(until_s, basis, by_svr) +
               at.share * b.mean.at(until_s, basis, by_svr);
  made.variance = variance_at(age_s);
  if (made.variance >= 0.0) made.variance += doubt.variance_at(thermal);
  made.was_judged = a.half_width >= 0.0 && b.half_width >= 0.0 && age_s <= age_of(at.upper);
  return made;
}

double StackForecast::held_variance(const ThermalState& from,
                                    const ThermalState& to) const noexcept {
  const LinearForecast& learned = horizons.back().mean.linear;
  const double changed = learned.at(learned.time_s, basis_of(to, reference_temperature)) -
                         learned.at(learned.time_s, basis_of(from, reference_temperature));
  ThermalDoubt from_there = doubt;
  from_there.temperature = from.temperature;
  from_there.rate = from.rate;
  return changed * changed + from_there.variance_at(to);
}

double StackForecast::variance_at(double age_s) const noexcept {
  const Between at = between(age_s);
  const double width = half_width(age_s, at) / kNormalQuantile;
  if (width < 0.0) return -1.0;
  const bool are_judged =
      horizons[at.lower].half_width >= 0.0 && horizons[at.upper].half_width >= 0.0;
  const bool is_beyond = are_judged && age_s > age_of(at.upper);
  return of_drift(width) * (is_beyond ? growth_until(age_s, at) : 1.0);
}

double StackForecast::of_drift(double width) const noexcept {
  return std::max(width * width - label_variance, level_variance);
}

// Older than any age that was judged an error goes on as it grew up to there: not at all of a map
// that holds, with the square of the time in a drift that goes on steadily.
double StackForecast::growth_until(double age_s, const Between& at) const noexcept {
  constexpr double kSteady = 2.0;
  const double grew = of_drift(horizons[at.upper].half_width / kNormalQuantile) /
                      of_drift(horizons[at.lower].half_width / kNormalQuantile);
  const double power = std::log(grew) / std::log(age_of(at.upper) / age_of(at.lower));
  return std::pow(age_s / age_of(at.upper), std::clamp(power, 0.0, kSteady));
}

std::array<double, kExperts> StackForecast::shares(
    double age_s, const std::optional<SvrForecast>& by_svr) const noexcept {
  const auto [lower, upper, share] = between(age_s < 0.0 ? age_of(kHorizons - 1) : age_s);
  std::array<double, kExperts> older = horizons[upper].shares;
  const double maps_share = horizons[upper].mean.maps_share;
  if (by_svr && by_svr->interpolates && maps_share > 0.0) {
    const double shift = shift_to_maps(maps_share);
    std::array<double, kExperts> maps{};
    if (by_svr->holds) {
      double sum = 0.0;
      for (std::size_t k = kFirstMap; k < kSvr; ++k) sum += older[k];
      for (std::size_t k = kFirstMap; k < kSvr; ++k) maps[k] = older[k] / sum;
    } else {
      maps[kSvr] = kSvrBesideCubic;
      maps[static_cast<std::size_t>(Expert::kCubic)] = 1.0 - kSvrBesideCubic;
    }
    for (std::size_t k = 0; k < kExperts; ++k) older[k] += shift * (maps[k] - older[k]);
  }
  std::array<double, kExperts> out{};
  for (std::size_t k = 0; k < kExperts; ++k)
    out[k] = (1.0 - share) * horizons[lower].shares[k] + share * older[k];
  return out;
}

std::optional<double> StackForecast::longest_judged_s() const noexcept {
  for (std::size_t h = kHorizons; h-- > 0;) {
    if (horizons[h].half_width >= 0.0) return age_of(h);
  }
  return std::nullopt;
}

}  // namespace zerodrift::experts
