// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/rounding.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <map>
#include <numbers>
#include <optional>

#include "common/core/median.h"
#include "common/diagnosis/gap.h"

namespace zerodrift::diagnosis {
namespace {

constexpr double kMatters = 0.2;
constexpr double kExact = 4.0;
constexpr double kLeastLeft = 0.65;  // blocks are kept back of it, and half has to stay
constexpr std::size_t kShortestHold = 5;
constexpr std::size_t kFewestHolds = 5;
constexpr double kMeanS = 60.0;

double square_of_rounding(double step) {
  return step * step / 12.0;
}

// Mean square by which values differ from the mean of their neighbours, less what three equal
// variances make of it: the variance of one. From the median, so that a few steps don't count.
std::optional<double> variance_of_one(const std::vector<double>& squares) {
  constexpr double kMedianOfASquare = core::kMedianOfNormal * core::kMedianOfNormal;
  constexpr double kOfThree = 1.5;
  if (squares.size() < kFewestHolds) return std::nullopt;
  return core::median_of(squares) / (kMedianOfASquare * kOfThree);
}

double squared_departure(double before, double value, double after) {
  const double departure = value - 0.5 * (before + after);
  return departure * departure;
}

// From sample to sample, with 1 % of the largest differences left out.
double sample_variance(std::span<const double> residual, const std::vector<std::uint8_t>& valid) {
  std::vector<double> squares;
  for (std::size_t i = 1; i < residual.size(); ++i) {
    if (valid[i] == 0 || valid[i - 1] == 0) continue;
    const double difference = residual[i] - residual[i - 1];
    squares.push_back(0.5 * difference * difference);
  }
  if (squares.empty()) return 0.0;
  const std::size_t kept = squares.size() - squares.size() / 100;
  std::nth_element(squares.begin(), squares.begin() + static_cast<std::ptrdiff_t>(kept - 1),
                   squares.end());
  double sum = 0.0;
  for (std::size_t i = 0; i < kept; ++i) sum += squares[i];
  return sum / static_cast<double>(kept);
}

// Of the rate: what noise does not carry over its steps.
void judge_rate(const MeasuredSeries& series, std::size_t axis, std::span<const double> residual,
                Rounding& rounding, std::vector<double>& squares) {
  const auto& rate = series.rate_radps[axis];
  const auto& valid = series.valid[axis];
  const double variance = sample_variance(residual, valid);
  std::vector<double> left(rate.size(), 0.0);
  double largest = 0.0;
  double mean = 0.0, count = 0.0;
  for (std::size_t i = 0; i < rate.size(); ++i) {
    if (valid[i] == 0) continue;
    const double step = series.rate_steps[axis].step_at(rate[i]);
    count += 1.0;
    if (!(step > 0.0)) continue;
    const double of_step = square_of_rounding(step);
    const double of_noise = std::max(variance - of_step, 0.0);
    left[i] =
        of_step * std::exp(-4.0 * std::numbers::pi * std::numbers::pi * of_noise / (step * step));
    mean += left[i];
    largest = std::max(largest, step);
  }
  if (!(mean > 0.0)) return;
  const auto block =
      static_cast<std::size_t>(std::max(1.0, std::round(kMeanS / series.interval_s)));
  const auto means = block_means(residual, valid, block).mean;
  std::vector<double> departures;
  for (std::size_t i = 1; i + 1 < means.size(); ++i)
    departures.push_back(squared_departure(means[i - 1], means[i], means[i + 1]));
  const auto around = variance_of_one(departures);
  if (!around || mean / count < kMatters * *around) return;
  rounding.rate_step_radps = largest;
  for (std::size_t i = 0; i < left.size(); ++i) squares[i] += left[i];
}

// A constant reference other than 0.
struct Hold {
  std::size_t begin = 0;
  std::size_t end = 0;
  double reference = 0.0;
  double mean = 0.0;  // of the residual
};

std::vector<Hold> holds_of(const std::vector<double>& reference, std::span<const double> residual,
                           const std::vector<std::uint8_t>& valid) {
  std::vector<Hold> holds;
  for (std::size_t begin = 0; begin < reference.size();) {
    Hold hold{begin, begin + 1, reference[begin]};
    while (hold.end < reference.size() && reference[hold.end] == hold.reference) ++hold.end;
    double count = 0.0;
    for (std::size_t i = hold.begin; i < hold.end; ++i) {
      if (valid[i] == 0) continue;
      hold.mean += residual[i];
      count += 1.0;
    }
    begin = hold.end;
    if (count < static_cast<double>(kShortestHold)) continue;
    hold.mean /= count;
    holds.push_back(hold);
  }
  return holds;
}

// Holds of steps alike: how much larger the squares of their departures are than those of rounding.
struct HoldsOfSteps {
  std::vector<double> ratios{};
  double smallest_step = 0.0;
  double largest_step = 0.0;

  void take(const HoldsOfSteps& other) {
    smallest_step =
        ratios.empty() ? other.smallest_step : std::min(smallest_step, other.smallest_step);
    ratios.insert(ratios.end(), other.ratios.begin(), other.ratios.end());
    largest_step = std::max(largest_step, other.largest_step);
  }
};

// By step, from the largest on; those of which there are too few to be judged with the next.
std::vector<HoldsOfSteps> by_step(const std::vector<Hold>& holds, const ReadingSteps& steps) {
  std::map<double, HoldsOfSteps, std::greater<>> single;
  for (std::size_t h = 1; h + 1 < holds.size(); ++h) {
    const double step = steps.step_at(holds[h].reference);
    if (!(step > 0.0)) continue;
    const double departure = squared_departure(holds[h - 1].mean, holds[h].mean, holds[h + 1].mean);
    single[step].take({{departure / square_of_rounding(step)}, step, step});
  }
  std::vector<HoldsOfSteps> joined;
  for (const auto& [step, of_step] : single) {
    if (joined.empty() || joined.back().ratios.size() >= kFewestHolds) joined.emplace_back();
    joined.back().take(of_step);
  }
  if (joined.size() > 1 && joined.back().ratios.size() < kFewestHolds) {
    joined[joined.size() - 2].take(joined.back());
    joined.pop_back();
  }
  return joined;
}

// Where a reference has such a step or a larger one: while it turns, and in the interval before and
// after, of which it may have turned in a part that is rounded to 0.
std::vector<std::uint8_t> rounded_to(double smallest_step, const std::vector<double>& reference,
                                     const ReadingSteps& steps) {
  std::vector<std::uint8_t> rounded(reference.size(), 0);
  for (std::size_t i = 0; i < reference.size(); ++i) {
    if (steps.step_at(reference[i]) < smallest_step) continue;
    for (std::size_t j = i > 0 ? i - 1 : i; j < std::min(i + 2, reference.size()); ++j)
      rounded[j] = 1;
  }
  return rounded;
}

void judge_reference(const MeasuredSeries& series, std::size_t axis,
                     std::span<const double> residual, Rounding& rounding,
                     std::vector<double>& squares) {
  const ReadingSteps& steps = series.reference_steps[axis];
  const std::vector<double>& reference = series.reference_radps[axis];
  const auto& valid = series.valid[axis];
  std::vector<HoldsOfSteps> that_matter = by_step(holds_of(reference, residual, valid), steps);
  std::erase_if(that_matter, [](const HoldsOfSteps& alike) {
    const auto around = variance_of_one(alike.ratios);  // in units of the rounding's own
    return !around || *around * kMatters > 1.0 || *around * kExact < 1.0;
  });
  if (that_matter.empty()) return;
  double smallest = that_matter.front().smallest_step;
  for (const HoldsOfSteps& alike : that_matter) {
    rounding.reference_step_radps = std::max(rounding.reference_step_radps, alike.largest_step);
    smallest = std::min(smallest, alike.smallest_step);
  }
  rounding.of_reference = rounded_to(smallest, reference, steps);
  const auto present = static_cast<double>(std::count(valid.begin(), valid.end(), 1));
  double left_out = 0.0;
  for (std::size_t i = 0; i < rounding.of_reference.size(); ++i) {
    if (valid[i] == 0 || rounding.of_reference[i] == 0) continue;
    squares[i] += square_of_rounding(std::max(steps.step_at(reference[i]), smallest));
    left_out += 1.0;
  }
  rounding.leaves_enough = present - left_out >= kLeastLeft * static_cast<double>(series.size);
}

}  // namespace

Rounding find_rounding(const MeasuredSeries& series, core::Axis axis,
                       std::span<const double> residual_radps) {
  const std::size_t a = core::index(axis);
  Rounding rounding;
  rounding.of_reference.assign(series.size, 0);
  std::vector<double> squares(series.size, 0.0);
  judge_rate(series, a, residual_radps, rounding, squares);
  judge_reference(series, a, residual_radps, rounding, squares);
  double sum = 0.0, count = 0.0;
  for (std::size_t i = 0; i < squares.size(); ++i) {
    if (series.valid[a][i] == 0 || rounding.leaves_out(i)) continue;
    sum += squares[i];
    count += 1.0;
  }
  rounding.rms_radps = count > 0.0 ? std::sqrt(sum / count) : 0.0;
  return rounding;
}

}  // namespace zerodrift::diagnosis
