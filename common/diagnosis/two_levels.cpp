// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/two_levels.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <numbers>

#include "common/core/golden_section.h"

namespace zerodrift::diagnosis {

namespace {

// What both hypotheses have beside the process in question.
struct Background {
  double first_variance;  // of the bias
  double walk;            // variance of its step, a block
  double white;           // variance of one sample
};

// The logarithm of a product of numbers that are not negative, with one logarithm for all of them:
// the product is held as mantissa and exponent, so that neither end of the range is met.
class LogOfProduct {
 public:
  void multiply(double factor) {
    int exponent = 0;
    mantissa_ = std::frexp(mantissa_ * factor, &exponent);
    exponents_ += exponent;
  }
  [[nodiscard]] double value() const {
    return std::log(mantissa_) + static_cast<double>(exponents_) * std::numbers::ln2;
  }

 private:
  double mantissa_ = 1.0;
  std::int64_t exponents_ = 0;
};

// Of `count` normal densities without the factors that depend on their variances.
double log_of_constants(std::size_t count) {
  return -0.5 * std::log(2.0 * std::numbers::pi) * static_cast<double>(count);
}

// Of the first bias, of which nothing is known.
double vague_variance(const CourseBlocks& blocks) {
  constexpr double kVague = 1e4;  // variances of the series
  double n = 0.0, mean = 0.0, squares = 0.0;
  for (std::size_t i = 0; i < blocks.values.size(); ++i) {
    if (!(blocks.counts[i] > 0.0)) continue;
    n += 1.0;
    const double d = blocks.values[i] - mean;
    mean += d / n;
    squares += d * (blocks.values[i] - mean);
  }
  return n > 1.0 ? kVague * squares / n : 0.0;
}

// Of the process in each twelfth of the record.
constexpr std::size_t kParts = 12;
using Strengths = std::array<double, kParts>;

double log_likelihood_of_wandering(const CourseBlocks& blocks, const Background& background,
                                   const Strengths& sigma_radps, double correlation_s) {
  const double memory = std::exp(-blocks.interval_s / correlation_s);
  double variance = sigma_radps.front() * sigma_radps.front();
  double bias = 0.0, course = 0.0;
  double bb = background.first_variance, bc = 0.0, cc = variance;
  double squares = 0.0;
  LogOfProduct variances;
  std::size_t count = 0;
  for (std::size_t i = 0; i < blocks.values.size(); ++i) {
    if (i > 0) {
      const double sigma = sigma_radps[i * kParts / blocks.values.size()];
      variance = sigma * sigma;
      bb += background.walk;
      bc *= memory;
      cc = memory * memory * cc + (1.0 - memory * memory) * variance;
      course *= memory;
    }
    if (!(blocks.counts[i] > 0.0)) continue;
    const double s = bb + 2.0 * bc + cc + background.white / blocks.counts[i];
    const double precision = 1.0 / s;
    const double innovation = blocks.values[i] - bias - course;
    const double to_bias = (bb + bc) * precision;
    const double to_course = (bc + cc) * precision;
    squares += innovation * innovation * precision;
    variances.multiply(s);
    ++count;
    bias += to_bias * innovation;
    course += to_course * innovation;
    const double of_both = bb + bc;
    const double of_course = bc + cc;
    bb -= to_bias * of_both;
    bc -= to_bias * of_course;
    cc -= to_course * of_course;
  }
  return log_of_constants(count) - 0.5 * (squares + variances.value());
}

// The bias as seen from one level, and how probable the level is.
struct Level {
  double probability;
  double bias;
  double variance;
};

// What two levels become where each may have come from either.
std::array<Level, 2> after_switching(const std::array<Level, 2>& levels, double leave_up,
                                     double leave_down) {
  const double up = levels[0].probability * (1.0 - leave_up);
  const double to_down = levels[0].probability * leave_up;
  const double to_up = levels[1].probability * leave_down;
  const double down = levels[1].probability * (1.0 - leave_down);
  const auto mixed = [&](double from_up, double from_down) {
    const double sum = from_up + from_down;
    if (!(sum > 0.0)) return Level{0.0, levels[0].bias, levels[0].variance};
    const double u = from_up / sum;
    const double apart = levels[0].bias - levels[1].bias;
    return Level{
        sum, u * levels[0].bias + (1.0 - u) * levels[1].bias,
        u * levels[0].variance + (1.0 - u) * levels[1].variance + u * (1.0 - u) * apart * apart};
  };
  return {mixed(up, to_up), mixed(to_down, down)};
}

double log_likelihood_of_switching(const CourseBlocks& blocks, const Background& background,
                                   double amplitude_radps, double up_s, double down_s) {
  const double share_up = up_s / (up_s + down_s);
  const double forgotten = -std::expm1(-blocks.interval_s * (1.0 / up_s + 1.0 / down_s));
  const std::array<double, 2> offsets{0.5 * amplitude_radps, -0.5 * amplitude_radps};
  std::array<Level, 2> levels{{{share_up, 0.0, background.first_variance},
                               {1.0 - share_up, 0.0, background.first_variance}}};
  double least_halves = 0.0;  // of the squares: what both levels leave of each block
  LogOfProduct totals;
  std::size_t count = 0;
  for (std::size_t i = 0; i < blocks.values.size(); ++i) {
    if (i > 0) {
      levels = after_switching(levels, (1.0 - share_up) * forgotten, share_up * forgotten);
      for (Level& level : levels) level.variance += background.walk;
    }
    if (!(blocks.counts[i] > 0.0)) continue;
    const double white = background.white / blocks.counts[i];
    std::array<double, 2> halves{};
    for (std::size_t j = 0; j < levels.size(); ++j) {
      Level& level = levels[j];
      const double precision = 1.0 / (level.variance + white);
      const double innovation = blocks.values[i] - level.bias - offsets[j];
      const double gain = level.variance * precision;
      halves[j] = 0.5 * innovation * innovation * precision;
      level.probability = std::max(level.probability, 1e-300) * std::sqrt(precision);
      level.bias += gain * innovation;
      level.variance *= 1.0 - gain;
    }
    const std::size_t farther = halves[0] < halves[1] ? 1 : 0;
    const double least = halves[1 - farther];
    levels[farther].probability *= std::exp(least - halves[farther]);
    const double total = levels[0].probability + levels[1].probability;
    const double share = 1.0 / total;
    for (Level& level : levels) level.probability *= share;
    least_halves += least;
    totals.multiply(total);
    ++count;
  }
  return log_of_constants(count) - least_halves + totals.value();
}

// Maximises over logarithms, one after another, within ever smaller ranges. The first guess is what
// the spectrum says, so the maximum is near.
template <std::size_t n>
double climb(std::array<double, n>& logarithms,
             const std::function<double(const std::array<double, n>&)>& log_likelihood) {
  constexpr std::array kRanges{2.5, 1.2, 0.6, 0.3};  // nats to either side
  constexpr int kEvaluations = 10;
  double best = log_likelihood(logarithms);
  for (const double range : kRanges) {
    for (std::size_t p = 0; p < n; ++p) {
      auto tried = logarithms;
      const auto found = core::golden_section(logarithms[p] - range, logarithms[p] + range,
                                              kEvaluations, [&](double value) {
                                                tried[p] = value;
                                                return -log_likelihood(tried);
                                              });
      tried[p] = found.best;
      const double here = log_likelihood(tried);
      if (here <= best) continue;
      best = here;
      logarithms = tried;
    }
  }
  return best;
}

// Logarithms of the variances of the white noise and of the walk, to begin with: what differs
// within blocks, and a hundredth of the process in question.
std::array<double, 2> first_background(const CourseBlocks& blocks, double sigma_radps,
                                       double correlation_s) {
  const double tiny = std::numeric_limits<double>::min();
  return {std::log(std::max({blocks.variance, 1e-6 * sigma_radps * sigma_radps, tiny})),
          std::log(std::max(0.01 * sigma_radps * sigma_radps * blocks.interval_s / correlation_s,
                            tiny))};
}

}  // namespace

CourseBlocks course_blocks(std::span<const double> series_radps,
                           std::span<const std::uint8_t> valid, double interval_s,
                           double correlation_s) {
  constexpr double kLongestS = 20.0;
  const auto length = static_cast<std::size_t>(
      std::max(1.0, std::floor(std::min(correlation_s / 8.0, kLongestS) / interval_s)));
  CourseBlocks blocks{.interval_s = interval_s * static_cast<double>(length)};
  double squares = 0.0, freedom = 0.0;
  for (std::size_t begin = 0; begin + length <= series_radps.size(); begin += length) {
    double n = 0.0, mean = 0.0;
    for (std::size_t i = begin; i < begin + length; ++i) {
      if (valid[i] == 0) continue;
      n += 1.0;
      const double d = series_radps[i] - mean;
      mean += d / n;
      squares += d * (series_radps[i] - mean);
    }
    freedom += std::max(0.0, n - 1.0);
    blocks.values.push_back(mean);
    blocks.counts.push_back(n);
  }
  blocks.variance = freedom > 0.0 ? squares / freedom : 0.0;
  return blocks;
}

WanderingFit fit_wandering(const CourseBlocks& blocks, double sigma_radps, double correlation_s) {
  const double vague = vague_variance(blocks);
  const auto [white, walk] = first_background(blocks, sigma_radps, correlation_s);
  std::array logs{std::log(sigma_radps), std::log(correlation_s), white, walk};
  const double steady = climb<4>(logs, [&](const std::array<double, 4>& at) {
    Strengths strengths{};
    strengths.fill(std::exp(at[0]));
    return log_likelihood_of_wandering(blocks, {vague, std::exp(at[3]), std::exp(at[2])}, strengths,
                                       std::exp(at[1]));
  });
  const WanderingFit found{steady, std::exp(logs[0]), std::exp(logs[1])};
  const Background background{vague, std::exp(logs[3]), std::exp(logs[2])};
  Strengths each{};
  each.fill(logs[0]);
  const double changing = climb<kParts>(each, [&](const Strengths& at) {
    Strengths strengths{};
    std::transform(at.begin(), at.end(), strengths.begin(),
                   [](double log) { return std::exp(log); });
    return log_likelihood_of_wandering(blocks, background, strengths, found.correlation_s);
  });
  const double times =
      blocks.interval_s * static_cast<double>(blocks.values.size()) / found.correlation_s;
  const double of_freedom = 0.5 * static_cast<double>(kParts - 1) * std::log(std::max(times, 2.0));
  return {std::max(steady, changing - of_freedom), found.sigma_radps, found.correlation_s};
}

SwitchingFit fit_switching(const CourseBlocks& blocks, double sigma_radps, double correlation_s) {
  // The upper level may be the longer one, the shorter one, or neither.
  constexpr std::array kUpOverDown{1.0, 4.0, 0.25};
  const double vague = vague_variance(blocks);
  const auto [white, walk] = first_background(blocks, sigma_radps, correlation_s);
  SwitchingFit best{.log_likelihood = -std::numeric_limits<double>::infinity()};
  for (const double ratio : kUpOverDown) {
    const double down_s = correlation_s * (1.0 + ratio) / ratio;
    const double share = ratio / (1.0 + ratio);
    std::array logs{std::log(sigma_radps / std::sqrt(share * (1.0 - share))),
                    std::log(ratio * down_s), std::log(down_s), white, walk};
    const double found = climb<5>(logs, [&](const std::array<double, 5>& at) {
      return log_likelihood_of_switching(blocks, {vague, std::exp(at[4]), std::exp(at[3])},
                                         std::exp(at[0]), std::exp(at[1]), std::exp(at[2]));
    });
    if (found > best.log_likelihood)
      best = {found, std::exp(logs[0]), std::exp(logs[1]), std::exp(logs[2])};
  }
  return best;
}

}  // namespace zerodrift::diagnosis
