// SPDX-License-Identifier: Apache-2.0
#include "common/experts/stack_forecast.h"

#include <algorithm>
#include <cmath>

namespace zerodrift::experts {
namespace {

constexpr double kInterpolationOdds = 20.0;
constexpr double kSvrBesideCubic = 0.5;

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

StatedIntervals StackForecast::intervals() const noexcept {
  StatedIntervals out;
  out.label_variance = label_variance;
  out.level_variance = level_variance;
  for (std::size_t h = 0; h < kHorizons; ++h) {
    const double judged_s = horizons[h].judged_age_s;
    out.judged[h] = {horizons[h].half_width, judged_s > 0.0 ? judged_s : age_of(h)};
  }
  return out;
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
  made.variance = intervals().variance_at(age_s);
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
