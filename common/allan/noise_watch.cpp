// SPDX-License-Identifier: Apache-2.0
#include "common/allan/noise_watch.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "common/allan/comparison_test.h"

namespace zerodrift::allan {
namespace {

constexpr double kSecondsPerHour = 3600.0;
constexpr double kLargestThreshold = 1e-4;  // a first look after a long time spends no more

const NoiseWatchOptions& checked(const NoiseWatchOptions& options) {
  if (const auto error = options.validate()) throw std::invalid_argument(*error);
  return options;
}

AllanPoint cautious(AllanPoint point, double share) {
  point.degrees_of_freedom *= share;
  return point;
}

// Points of one tau come from one grid, whose taus are a tenth apart at least; the interval it goes
// by is a mean that moves a little from look to look.
bool same_tau(double a_s, double b_s) {
  return std::abs(a_s - b_s) <= 0.05 * b_s;
}

const AllanPoint* at_tau(std::span<const AllanPoint> points, double tau_s) {
  const auto found = std::find_if(points.begin(), points.end(),
                                  [&](const AllanPoint& p) { return same_tau(p.tau_s, tau_s); });
  return found == points.end() ? nullptr : &*found;
}

}  // namespace

std::optional<std::string> NoiseWatchOptions::validate() const {
  const auto found = [](const char* key, double value, const char* right) {
    return std::string(key) + " is " + std::to_string(value) + ", must be " + right;
  };
  if (!(false_alarms_per_hour > 0.0 && std::isfinite(false_alarms_per_hour)))
    return found("false_alarms_per_hour", false_alarms_per_hour, "> 0 / h");
  if (!(least_growth >= 0.0 && std::isfinite(least_growth)))
    return found("least_growth", least_growth, ">= 0");
  if (!(clear_p_value > 0.0 && clear_p_value < 1.0))
    return found("clear_p_value", clear_p_value, "inside (0, 1)");
  if (!(degrees_of_freedom_share > 0.0 && degrees_of_freedom_share <= 1.0))
    return found("degrees_of_freedom_share", degrees_of_freedom_share, "inside (0, 1]");
  if (!(min_degrees_of_freedom >= 1.0 && std::isfinite(min_degrees_of_freedom)))
    return found("min_degrees_of_freedom", min_degrees_of_freedom, ">= 1");
  return std::nullopt;
}

std::vector<ComparedPoints> paired(std::span<const AllanPoint> watched,
                                   std::span<const AllanPoint> reference) {
  std::vector<ComparedPoints> result;
  result.reserve(watched.size());
  for (const AllanPoint& point : watched) {
    if (const AllanPoint* other = at_tau(reference, point.tau_s)) result.push_back({point, *other});
  }
  return result;
}

ExcessWatch::ExcessWatch(const NoiseWatchOptions& options) : options_(checked(options)) {}

Finding ExcessWatch::look(std::span<const ComparedPoints> points, double observed_s) {
  Finding finding;
  finding.excess = exceeds_ ? Excess::kLasts : Excess::kNone;
  const double spent_h = (observed_s - looked_s_) / kSecondsPerHour;
  if (!(spent_h > 0.0)) return finding;
  const auto is_telling = [&](const ComparedPoints& p) {
    return p.watched.degrees_of_freedom >= options_.min_degrees_of_freedom &&
           p.reference.degrees_of_freedom >= options_.min_degrees_of_freedom &&
           p.reference.deviation_radps > 0.0;
  };
  const auto telling = std::count_if(points.begin(), points.end(), is_telling);
  if (telling == 0) return finding;
  looked_s_ = observed_s;
  finding.threshold = std::min(
      spent_h * options_.false_alarms_per_hour / static_cast<double>(telling), kLargestThreshold);
  const double clear_ratio = 1.0 + 0.5 * options_.least_growth;
  bool clear = true;
  for (const ComparedPoints& p : points) {
    const double ratio = p.watched.deviation_radps / p.reference.deviation_radps;
    if (!is_telling(p) || !(ratio > clear_ratio)) continue;
    const double p_value =
        larger_variance_p_value(cautious(p.watched, options_.degrees_of_freedom_share),
                                cautious(p.reference, options_.degrees_of_freedom_share));
    clear = clear && p_value >= options_.clear_p_value;
    const bool counts = exceeds_ || ratio > 1.0 + options_.least_growth;
    if (!counts || p_value >= finding.p_value) continue;
    finding.p_value = p_value;
    finding.tau_s = p.watched.tau_s;
    finding.watched_radps = p.watched.deviation_radps;
    finding.reference_radps = p.reference.deviation_radps;
  }
  if (!exceeds_ && finding.p_value < finding.threshold) {
    exceeds_ = true;
    began_tau_s_ = finding.tau_s;
    finding.excess = Excess::kBegan;
  } else if (exceeds_ && clear) {
    exceeds_ = false;
    finding.excess = Excess::kEnded;
    finding.tau_s = began_tau_s_;
    for (const ComparedPoints& p : points) {
      if (!same_tau(p.watched.tau_s, began_tau_s_)) continue;
      finding.watched_radps = p.watched.deviation_radps;
      finding.reference_radps = p.reference.deviation_radps;
    }
  }
  return finding;
}

GrowthWatch::GrowthWatch(const NoiseWatchOptions& options) : watch_(options) {}

Finding GrowthWatch::look(std::span<const AllanPoint> since_start,
                          std::span<const AllanPoint> rolling, double observed_s, double window_s) {
  learn(since_start, rolling, !watch_.exceeds() && observed_s >= closed_until_s_);
  const Finding finding = watch_.look(paired(rolling, reference()), observed_s);
  if (finding.excess == Excess::kEnded) closed_until_s_ = observed_s + window_s;
  return finding;
}

void GrowthWatch::learn(std::span<const AllanPoint> since_start,
                        std::span<const AllanPoint> rolling, bool enters) {
  for (const AllanPoint& total : since_start) {
    const auto known = std::find_if(before_.begin(), before_.end(), [&](const Before& b) {
      return same_tau(b.tau_s, total.tau_s);
    });
    Before& before = known == before_.end() ? before_.emplace_back() : *known;
    before.tau_s = total.tau_s;
    const auto pairs = static_cast<double>(total.pairs);
    double left_pairs = pairs;
    double left_squares = pairs * total.deviation_radps * total.deviation_radps;
    if (const AllanPoint* window = at_tau(rolling, total.tau_s)) {
      const auto held = static_cast<double>(window->pairs);
      left_pairs -= held;
      left_squares -= held * window->deviation_radps * window->deviation_radps;
    }
    if (enters && left_pairs > before.left_pairs) {
      before.pairs += left_pairs - before.left_pairs;
      before.squares += std::max(left_squares - before.left_squares, 0.0);
    }
    before.left_pairs = std::max(left_pairs, 0.0);
    before.left_squares = std::max(left_squares, 0.0);
    before.degrees_of_freedom = pairs > 0.0 ? total.degrees_of_freedom * before.pairs / pairs : 0.0;
  }
}

std::vector<AllanPoint> GrowthWatch::reference() const {
  std::vector<AllanPoint> points;
  points.reserve(before_.size());
  for (const Before& before : before_) {
    if (before.pairs < 1.0) continue;
    AllanPoint point;
    point.tau_s = before.tau_s;
    point.pairs = static_cast<std::uint64_t>(before.pairs);
    point.deviation_radps = std::sqrt(before.squares / before.pairs);
    point.degrees_of_freedom = before.degrees_of_freedom;
    points.push_back(point);
  }
  return points;
}

}  // namespace zerodrift::allan
