// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/disagreement.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <numbers>
#include <numeric>

#include "common/allan/chi_square.h"
#include "common/diagnosis/cosine_transform.h"
#include "common/diagnosis/evidence.h"
#include "common/diagnosis/noise_weight.h"

namespace zerodrift::diagnosis {
namespace {

constexpr std::size_t kRanges = 12;  // of one input

struct Range {
  Disagreement found;
  std::size_t place = 0;  // among its kind
};

double two_sided_p(double chi_square) {
  return std::erfc(std::sqrt(0.5 * chi_square));
}

// Values of an input that are looked at together: from <= value < below.
struct InputRange {
  double from;
  double below;
  double to;  // largest value that is reported
};

// About as many values in each. A value that fills a range by itself is one; of an input with two
// levels only the rarer one is looked at, since the other says the same.
std::vector<InputRange> ranges_of(const std::vector<double>& values) {
  std::vector<double> sorted = values;
  std::sort(sorted.begin(), sorted.end());
  const auto quantile = [&](std::size_t i) { return sorted[(sorted.size() - 1) * i / kRanges]; };
  constexpr double kNoLimit = std::numeric_limits<double>::infinity();
  std::vector<InputRange> ranges;
  const auto begin_at = [&](double value) {
    if (!ranges.empty()) {
      if (value <= ranges.back().from) return;
      ranges.back().below = value;
      ranges.back().to = std::min(ranges.back().to, value);
    }
    ranges.push_back({value, kNoLimit, sorted.back()});
  };
  for (std::size_t i = 0; i < kRanges; ++i) {
    begin_at(quantile(i));
    if (quantile(i) < quantile(i + 1)) continue;
    const auto next = std::upper_bound(sorted.begin(), sorted.end(), quantile(i));
    if (quantile(i) == ranges.back().from) ranges.back().to = quantile(i);
    if (next != sorted.end()) begin_at(*next);
  }
  if (ranges.size() == 2 && ranges.front().from == ranges.front().to) {
    const auto lower = std::upper_bound(sorted.begin(), sorted.end(), ranges.front().to);
    const bool lower_is_rarer = 2 * (lower - sorted.begin()) <= std::ssize(sorted);
    ranges.erase(lower_is_rarer ? ranges.end() - 1 : ranges.begin());
  }
  return ranges;
}

void add_channel(std::vector<Range>& ranges, const InputChannel& channel, const ResidualView& view,
                 const std::vector<double>& weighted, const GapBridge& gaps,
                 CosineTransform& transform) {
  constexpr double kLeastVarying = 1e-9;  // of a column's square norm: what rounding leaves
  const std::size_t n = weighted.size();
  const std::vector<InputRange> of_input = ranges_of(channel.values);
  for (std::size_t r = 0; r < of_input.size(); ++r) {
    const InputRange& range = of_input[r];
    std::vector<double> inside(n);
    for (std::size_t i = 0; i < n; ++i) {
      const double value = channel.values[i];
      inside[i] = value >= range.from && value < range.below ? 1.0 : 0.0;
    }
    gaps.apply(inside);
    const double level = std::inner_product(inside.begin(), inside.end(), weighted.begin(), 0.0);
    const Eigen::VectorXd cosine = transform.forward(inside);
    double information = 0.0;
    double varying = 0.0;
    for (std::size_t k = 1; k < n; ++k) {
      const double c = cosine(static_cast<Eigen::Index>(k));
      varying += c * c;
      if (view.dct_variances[k] > 0.0) information += c * c / view.dct_variances[k];
    }
    if (!(information > 0.0) || varying <= kLeastVarying * cosine.squaredNorm()) continue;
    const double excess = level * level / information;
    ranges.push_back({{channel.name, range.from, range.to, excess, two_sided_p(excess)}, r});
  }
}

void add_octaves(std::vector<Range>& ranges, const ResidualView& view, CosineTransform& transform,
                 std::size_t n) {
  constexpr double kFewest = 6.0;  // coefficients
  const Eigen::VectorXd cosine = transform.forward(view.residual_radps.first(n));
  const double step_hz = 1.0 / (2.0 * static_cast<double>(n) * view.interval_s);
  std::size_t place = 0;
  for (std::size_t high = n; high > 1; high = (high + 1) / 2, ++place) {
    const std::size_t low = std::max<std::size_t>(1, (high + 1) / 2);
    double power = 0.0;
    double count = 0.0;
    for (std::size_t k = low; k < high; ++k) {
      if (!(view.dct_variances[k] > 0.0)) continue;
      const double c = cosine(static_cast<Eigen::Index>(k));
      power += c * c / view.dct_variances[k];
      count += 1.0;
    }
    if (count < kFewest) break;
    ranges.push_back(
        {{"frequency", static_cast<double>(low) * step_hz, static_cast<double>(high) * step_hz,
          power / count, 1.0 - allan::chi_square_cdf(power, count)},
         place});
  }
}

// Neighbours of one kind become one range with the stronger one's figures.
std::vector<Disagreement> joined(std::vector<Range> ranges) {
  std::vector<Disagreement> result;
  std::vector<std::size_t> last_place;
  for (const Range& range : ranges) {
    const bool adjoins = !result.empty() && result.back().kind == range.found.kind &&
                         last_place.back() + 1 == range.place;
    if (!adjoins) {
      result.push_back(range.found);
      last_place.push_back(range.place);
      continue;
    }
    Disagreement& whole = result.back();
    whole.from = std::min(whole.from, range.found.from);
    whole.to = std::max(whole.to, range.found.to);
    whole.excess = std::max(whole.excess, range.found.excess);
    whole.p_value = std::min(whole.p_value, range.found.p_value);
    last_place.back() = range.place;
  }
  std::stable_sort(result.begin(), result.end(), [](const auto& a, const auto& b) {
    return a.p_value < b.p_value || (a.p_value == b.p_value && a.excess > b.excess);
  });
  return result;
}

// Without its mean, for the rounding's sake; missing values as GapBridge has them.
std::vector<double> bridged(std::span<const double> residual, std::span<const std::uint8_t> valid,
                            const GapBridge& gaps) {
  std::vector<double> values(residual.begin(), residual.end());
  double sum = 0.0;
  double count = 0.0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (valid[i] == 0) values[i] = 0.0;
    sum += values[i];
    count += valid[i] != 0 ? 1.0 : 0.0;
  }
  const double mean = count > 0.0 ? sum / count : 0.0;
  for (double& value : values) value -= mean;
  gaps.apply(values);
  return values;
}

std::vector<Range> significant(std::vector<Range> ranges, double significance) {
  const auto looked_at = static_cast<double>(ranges.size());
  for (Range& range : ranges) range.found.p_value = std::min(1.0, range.found.p_value * looked_at);
  std::erase_if(ranges, [&](const Range& r) { return r.found.p_value >= significance; });
  return ranges;
}

}  // namespace

std::vector<Disagreement> locate(const ResidualView& view,
                                 const std::vector<InputChannel>& channels, double significance) {
  const std::size_t n = smooth_length_up_to(view.residual_radps.size());
  if (n < 2 * kRanges || view.dct_variances.empty()) return {};
  CosineTransform transform(n);
  // Variances of the shortened series, read off at equal frequencies.
  std::vector<double> variances(n, 0.0);
  const double stretch = static_cast<double>(view.dct_variances.size()) / static_cast<double>(n);
  for (std::size_t k = 1; k < n; ++k) {
    const auto at = static_cast<std::size_t>(std::llround(static_cast<double>(k) * stretch));
    variances[k] = view.dct_variances[std::min(at, view.dct_variances.size() - 1)];
  }
  const GapBridge gaps(view.valid.first(n));
  const std::vector<double> residual = bridged(view.residual_radps.first(n), view.valid, gaps);
  const ResidualView shortened{residual, view.valid.first(n), variances, view.interval_s};
  const auto weighted = divided_by_noise(shortened.residual_radps, variances);
  std::vector<Range> ranges;
  for (InputChannel channel : channels) {
    channel.values.resize(n);
    add_channel(ranges, channel, shortened, weighted, gaps, transform);
  }
  add_octaves(ranges, shortened, transform, n);
  return joined(significant(std::move(ranges), significance));
}

std::vector<Disagreement> locate_cluster_times(const AllanCurves& curves, double record_s,
                                               double significance) {
  std::vector<Range> ranges;
  for (std::size_t i = 0; i < curves.tau_s.size(); ++i) {
    const double measured = curves.measured_radps[i];
    const double twin = curves.before_radps[i];
    if (!(measured > 0.0 && twin > 0.0)) continue;
    const double ratio = measured * measured / (twin * twin);
    const double freedom = std::max(1.0, record_s / curves.tau_s[i] - 2.0);
    const double below = allan::chi_square_cdf(freedom * ratio, freedom);
    const double half_step = std::numbers::sqrt2;
    ranges.push_back({{"allan_tau", curves.tau_s[i] / half_step, curves.tau_s[i] * half_step, ratio,
                       2.0 * std::min(below, 1.0 - below)},
                      i});
  }
  return joined(significant(std::move(ranges), significance));
}

}  // namespace zerodrift::diagnosis
