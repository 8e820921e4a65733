// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/motion.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>
#include <span>

#include "common/core/median.h"
#include "common/core/units.h"
#include "common/diagnosis/smallest_step.h"

namespace zerodrift::diagnosis {
namespace {

constexpr std::size_t kHalfWindow = 5;
constexpr std::size_t kFewestInWindow = 6;
// Of a grid of one second: in a record of which nothing says that it turns, and in one that does.
constexpr double kLeastTurnRadps = 0.05 * core::kRadPerDeg;
constexpr double kLeastFurtherTurnRadps = 0.1 * kLeastTurnRadps;
constexpr double kSurelyATurnRadps = 1.0 * core::kRadPerDeg;
constexpr double kLargestBiasRadps = 10.0 * core::kRadPerDeg;
// Of the quietest tenth, whose estimate is low by chance: 15 of the noise itself.
constexpr double kNoiseSigmas = 25.0;
constexpr double kReadingSteps = 4.0;
// Changes the Earth's rotation that an axis feels by 0.03 deg/h at most.
constexpr double kSameOrientationRad = 0.1 * core::kRadPerDeg;

bool moves(std::span<const double> channel) {
  return !channel.empty() && std::any_of(channel.begin(), channel.end(),
                                         [&](double value) { return value != channel.front(); });
}

Stretch window_around(std::size_t i, std::size_t size) {
  return {i > kHalfWindow ? i - kHalfWindow : 0, std::min(i + kHalfWindow + 1, size)};
}

// Of a stretch, as much as tells a level where it begins and where it ends.
constexpr std::size_t kEnd = 6 * kHalfWindow;

Stretch first_of(const Stretch& stretch) {
  return {stretch.begin, std::min(stretch.begin + kEnd, stretch.end)};
}

Stretch last_of(const Stretch& stretch) {
  return {stretch.size() > kEnd ? stretch.end - kEnd : stretch.begin, stretch.end};
}

// One axis of a record.
class AxisRates {
 public:
  AxisRates(const MeasuredSeries& series, std::size_t axis, double least_turn_radps)
      : rate_(series.rate_radps[axis]), valid_(series.valid[axis]), interval_s_(series.interval_s) {
    noise_radps_ = noise_of_the_quietest_tenth();
    bound_radps_ = std::clamp(
        std::max(kNoiseSigmas * noise_radps_, kReadingSteps * smallest_step(rate_, valid_)),
        least_turn_radps * std::clamp(interval_s_, 1.0, 20.0), kSurelyATurnRadps);
  }

  [[nodiscard]] double bound_radps() const noexcept { return bound_radps_; }

  void mark_turns(std::vector<std::uint8_t>& moving) const {
    std::vector<double> around;
    for (std::size_t i = 0; i < rate_.size(); ++i) {
      const Stretch window = window_around(i, rate_.size());
      around.clear();
      for (std::size_t j = window.begin; j < window.end; ++j) {
        if (valid_[j] != 0) around.push_back(rate_[j]);
      }
      if (around.size() < kFewestInWindow) continue;
      std::sort(around.begin(), around.end());
      if (around[around.size() - 2] - around[1] > bound_radps_) moving[i] = 1;
    }
  }

  // Nothing where it has no rate.
  [[nodiscard]] std::optional<double> level(const Stretch& stretch) const {
    std::vector<double> values;
    for (std::size_t i = stretch.begin; i < stretch.end; ++i) {
      if (valid_[i] != 0) values.push_back(rate_[i]);
    }
    if (values.empty()) return std::nullopt;
    return core::median_of(std::move(values));
  }

  [[nodiscard]] bool never_rests() const {
    std::vector<double> sizes;
    for (std::size_t i = 0; i < rate_.size(); ++i) {
      if (valid_[i] != 0) sizes.push_back(std::abs(rate_[i]));
    }
    return !sizes.empty() && core::median_of(std::move(sizes)) > kLargestBiasRadps;
  }

  // Whether the turn between two stretches ends where it began.
  [[nodiscard]] bool comes_back(const Stretch& before, const Stretch& after) const {
    const auto first = level(last_of(before));
    const auto last = level(first_of(after));
    if (!first || !last) return false;
    double angle_rad = 0.0;
    for (std::size_t i = before.end; i < after.begin; ++i) {
      if (valid_[i] == 0) return false;
      angle_rad += (rate_[i] - 0.5 * (*first + *last)) * interval_s_;
    }
    const auto count = static_cast<double>(after.begin - before.end);
    const double of_noise = 5.0 * noise_radps_ * std::sqrt(count) * interval_s_;
    const double of_drift = 0.5 * std::abs(*last - *first) * count * interval_s_;
    return std::abs(angle_rad) <= kSameOrientationRad + of_noise + of_drift;
  }

 private:
  // From differences of neighbours, which turns of seconds hardly change.
  [[nodiscard]] double noise_of_the_quietest_tenth() const {
    constexpr double kMedianOfDifference = std::numbers::sqrt2 * core::kMedianOfNormal;
    std::vector<double> sigmas;
    std::vector<double> steps;
    for (std::size_t begin = 0; begin < rate_.size(); begin += kHalfWindow) {
      steps.clear();
      const std::size_t end = std::min(begin + 4 * kHalfWindow, rate_.size());
      for (std::size_t i = begin + 1; i < end; ++i) {
        if (valid_[i] != 0 && valid_[i - 1] != 0)
          steps.push_back(std::abs(rate_[i] - rate_[i - 1]));
      }
      if (steps.size() >= kFewestInWindow)
        sigmas.push_back(core::median_of(steps) / kMedianOfDifference);
    }
    if (sigmas.empty()) return 0.0;
    const auto tenth = sigmas.begin() + static_cast<std::ptrdiff_t>(sigmas.size() / 10);
    std::nth_element(sigmas.begin(), tenth, sigmas.end());
    return *tenth;
  }

  std::span<const double> rate_;
  const std::vector<std::uint8_t>& valid_;
  double interval_s_;
  double noise_radps_ = 0.0;
  double bound_radps_ = 0.0;
};

std::vector<Stretch> stretches_without(const std::vector<std::uint8_t>& moving) {
  std::vector<Stretch> stretches;
  for (std::size_t begin = 0; begin < moving.size();) {
    std::size_t end = begin;
    while (end < moving.size() && moving[end] == 0) ++end;
    if (end > begin) stretches.push_back({begin, end});
    begin = end + 1;
  }
  return stretches;
}

// The longest of those whose levels are the commonest, by their duration.
std::size_t commonest(const std::vector<Stretch>& stretches, const AxisRates& axis) {
  std::vector<std::optional<double>> levels;
  for (const Stretch& stretch : stretches) levels.push_back(axis.level(stretch));
  std::size_t best = 0;
  std::size_t longest = 0;
  for (std::size_t i = 0; i < stretches.size(); ++i) {
    std::size_t duration = 0;
    for (std::size_t j = 0; levels[i] && j < stretches.size(); ++j) {
      if (levels[j] && std::abs(*levels[j] - *levels[i]) <= axis.bound_radps())
        duration += stretches[j].size();
    }
    const bool is_longer =
        duration > longest || (duration == longest && stretches[i].size() > stretches[best].size());
    if (!is_longer) continue;
    longest = duration;
    best = i;
  }
  return best;
}

// From the commonest level on, forwards and backwards: those that begin where the one at rest
// before them ended. A gyro's bias may wander far, but not during a turn.
std::vector<Stretch> at_rest(std::vector<Stretch> stretches, const std::vector<AxisRates>& axes) {
  for (const AxisRates& axis : axes) {
    if (stretches.empty()) break;
    const std::size_t start = commonest(stretches, axis);
    std::vector<std::uint8_t> rests(stretches.size(), 0);
    const auto walk = [&](auto first, auto last, auto near_end, auto far_end) {
      auto level = axis.level(far_end(*first));
      for (auto stretch = first; stretch != last; ++stretch) {
        const auto here = axis.level(near_end(*stretch));
        const bool goes_on = !here || !level || std::abs(*here - *level) <= axis.bound_radps();
        if (stretch != first && !goes_on) continue;
        rests[static_cast<std::size_t>(&*stretch - stretches.data())] = 1;
        if (const auto there = axis.level(far_end(*stretch))) level = there;
      }
    };
    const auto at = static_cast<std::ptrdiff_t>(start);
    walk(stretches.begin() + at, stretches.end(), first_of, last_of);
    walk(std::make_reverse_iterator(stretches.begin() + at + 1), stretches.rend(), last_of,
         first_of);
    std::vector<Stretch> left;
    for (std::size_t i = 0; i < stretches.size(); ++i) {
      if (rests[i] != 0) left.push_back(stretches[i]);
    }
    stretches = std::move(left);
  }
  return stretches;
}

Stretch longest_in_one_orientation(const std::vector<Stretch>& stretches,
                                   const std::vector<AxisRates>& axes) {
  Stretch longest;
  Stretch current;
  for (std::size_t i = 0; i < stretches.size(); ++i) {
    const bool goes_on = i > 0 && std::all_of(axes.begin(), axes.end(), [&](const AxisRates& axis) {
                           return axis.comes_back(stretches[i - 1], stretches[i]);
                         });
    current = {goes_on ? current.begin : stretches[i].begin, stretches[i].end};
    if (current.size() > longest.size()) longest = current;
  }
  return longest;
}

std::optional<UnreferencedMotion> turns_above(const MeasuredSeries& series,
                                              double least_turn_radps) {
  UnreferencedMotion motion;
  motion.moving.assign(series.size, 0);
  std::vector<AxisRates> axes;
  for (std::size_t a = 0; a < core::kAxisCount; ++a) {
    if (!series.rate_radps[a].empty()) axes.emplace_back(series, a, least_turn_radps);
  }
  const bool never_rests = std::any_of(axes.begin(), axes.end(),
                                       [](const AxisRates& rates) { return rates.never_rests(); });
  std::vector<Stretch> rests;
  if (!never_rests) {
    for (const AxisRates& rates : axes) rates.mark_turns(motion.moving);
    rests = at_rest(stretches_without(motion.moving), axes);
  }
  motion.moving.assign(series.size, 1);
  for (const Stretch& rest : rests) {
    std::fill(motion.moving.begin() + static_cast<std::ptrdiff_t>(rest.begin),
              motion.moving.begin() + static_cast<std::ptrdiff_t>(rest.end), std::uint8_t{0});
  }
  const auto count = std::count(motion.moving.begin(), motion.moving.end(), std::uint8_t{1});
  if (count == 0) return std::nullopt;
  motion.moving_share = static_cast<double>(count) / static_cast<double>(series.size);
  motion.at_rest = longest_in_one_orientation(rests, axes);
  return motion;
}

}  // namespace

std::optional<UnreferencedMotion> motion_without_reference(const MeasuredSeries& series,
                                                           core::Axis axis) {
  if (moves(series.reference_radps[core::index(axis)])) return std::nullopt;
  if (!turns_above(series, kLeastTurnRadps)) return std::nullopt;
  return turns_above(series, kLeastFurtherTurnRadps);
}

MeasuredSeries part_at_rest(const MeasuredSeries& series, const UnreferencedMotion& motion) {
  MeasuredSeries masked = series;
  for (auto& valid : masked.valid) {
    for (std::size_t i = 0; i < valid.size(); ++i) {
      if (motion.moving[i] != 0) valid[i] = 0;
    }
  }
  return part_of(masked, motion.at_rest.begin, motion.at_rest.end);
}

}  // namespace zerodrift::diagnosis
