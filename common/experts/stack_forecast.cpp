// SPDX-License-Identifier: Apache-2.0
#include "common/experts/stack_forecast.h"

#include <algorithm>
#include <cmath>

namespace zerodrift::experts {
namespace {

constexpr double kNormalQuantile = 1.959963984540054;  // of 95 %, two-sided
// The drift can't be known better than so many labels measure it.
constexpr double kLabelsInAMean = 12.0;
constexpr double kInterpolationOdds = 20.0;
constexpr double kCubicBesideSvr = 0.5;

// The share that SVR and cubic then have in common.
double share_of_maps(double svr_share) noexcept {
  return kInterpolationOdds * svr_share / (1.0 + (kInterpolationOdds - 1.0) * svr_share);
}

}  // namespace

double StackMean::at_longest(double time_s, const Basis& basis,
                             const std::optional<SvrForecast>& by_svr,
                             const LinearForecast& cubic) const noexcept {
  if (!by_svr || !by_svr->interpolates) return at(time_s, basis, by_svr);
  const double sum = linear.at(time_s, basis);
  const double by_maps =
      by_svr->drift + kCubicBesideSvr * (cubic.at(time_s, basis) - by_svr->drift);
  return sum + share_of_maps(svr_share) * (by_maps - sum);
}

double StackForecast::mean_at(std::size_t h, double now_s, const Basis& basis,
                              const std::optional<SvrForecast>& by_svr) const noexcept {
  const StackMean& mean = horizons[h].mean;
  return h + 1 == kHorizons ? mean.at_longest(now_s, basis, by_svr, cubic)
                            : mean.at(now_s, basis, by_svr);
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

double StackForecast::half_width(double age_s, const Between& at) const noexcept {
  const double lower = horizons[at.lower].half_width;
  const double upper = horizons[at.upper].half_width;
  if (lower >= 0.0 && upper >= 0.0) return (1.0 - at.share) * lower + at.share * upper;
  for (std::size_t h = at.upper + 1; h-- > 0;) {
    if (horizons[h].half_width >= 0.0)
      return horizons[h].half_width * std::max(1.0, age_s / age_of(h));
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
  made.drift = (1.0 - at.share) * mean_at(at.lower, until_s, basis, by_svr) +
               at.share * mean_at(at.upper, until_s, basis, by_svr);
  const double width = half_width(age_s, at) / kNormalQuantile;
  if (width < 0.0) return made;
  made.variance = std::max(width * width - label_variance, label_variance / kLabelsInAMean);
  made.was_judged = a.half_width >= 0.0 && b.half_width >= 0.0;
  return made;
}

std::array<double, kExperts> StackForecast::shares(double age_s, bool interpolates) const noexcept {
  const auto [lower, upper, share] = between(age_s < 0.0 ? age_of(kHorizons - 1) : age_s);
  std::array<double, kExperts> upper_shares = horizons[upper].shares;
  if (interpolates && upper + 1 == kHorizons) {
    constexpr auto kSvr = static_cast<std::size_t>(Expert::kOnlineSvr);
    const double before = upper_shares[kSvr];
    const double maps = share_of_maps(before);
    for (double& one : upper_shares) one *= (1.0 - maps) / std::max(1.0 - before, 1e-12);
    upper_shares[kSvr] = (1.0 - kCubicBesideSvr) * maps;
    upper_shares[static_cast<std::size_t>(Expert::kCubic)] += kCubicBesideSvr * maps;
  }
  std::array<double, kExperts> out{};
  for (std::size_t k = 0; k < kExperts; ++k)
    out[k] = (1.0 - share) * horizons[lower].shares[k] + share * upper_shares[k];
  return out;
}

std::optional<double> StackForecast::longest_judged_s() const noexcept {
  for (std::size_t h = kHorizons; h-- > 0;) {
    if (horizons[h].half_width >= 0.0) return age_of(h);
  }
  return std::nullopt;
}

}  // namespace zerodrift::experts
