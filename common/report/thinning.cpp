// SPDX-License-Identifier: Apache-2.0
#include "common/report/thinning.h"

#include <algorithm>

namespace zerodrift::report {
namespace {

// For x that goes back and forth: columns and stretches share what may be drawn.
constexpr std::size_t kStretches = 200;
static_assert(4 * (kThinningColumns + kStretches) <= kMostDrawnSamples);

constexpr std::size_t kPointColumns = kThinningColumns / kColumnsPerPointColumn;
constexpr std::size_t kEvenlySpaced = kMostDrawnSamples - 4 * kPointColumns;

// A sample that can be drawn.
struct Sample {
  std::size_t index = 0;
  std::size_t gaps_before = 0;  // samples before it that can't be drawn
};

// M4 of the samples of one column or stretch, which come in their order.
struct Extremes {
  bool any = false;
  Sample first;
  Sample lowest;
  Sample highest;
  Sample last;

  void take(const Sample& sample, const std::vector<double>& y) {
    if (!any) first = lowest = highest = sample;
    any = true;
    if (y[sample.index] < y[lowest.index]) lowest = sample;
    if (y[sample.index] > y[highest.index]) highest = sample;
    last = sample;
  }
};

std::vector<Sample> drawable_samples(const Curve& curve, AxisScale x_scale, AxisScale y_scale) {
  std::vector<Sample> samples;
  std::size_t gaps = 0;
  for (std::size_t i = 0; i < curve.x.size(); ++i) {
    if (is_drawable(curve.x[i], x_scale) && is_drawable(curve.y[i], y_scale)) {
      samples.push_back({i, gaps});
    } else {
      ++gaps;
    }
  }
  return samples;
}

bool ascends(const std::vector<Sample>& samples, const std::vector<double>& x) {
  return std::is_sorted(samples.begin(), samples.end(),
                        [&](const Sample& a, const Sample& b) { return x[a.index] < x[b.index]; });
}

void keep(std::vector<Sample>& kept, const std::vector<Extremes>& groups) {
  for (const Extremes& group : groups) {
    if (!group.any) continue;
    kept.insert(kept.end(), {group.first, group.lowest, group.highest, group.last});
  }
}

std::vector<Sample> thinned_line(const std::vector<Sample>& samples, const Curve& curve,
                                 const AxisRange& x_range) {
  std::vector<Extremes> columns(kThinningColumns);
  for (const Sample& sample : samples)
    columns[column_of(curve.x[sample.index], x_range)].take(sample, curve.y);
  std::vector<Sample> kept;
  keep(kept, columns);
  if (!ascends(samples, curve.x)) {
    std::vector<Extremes> stretches(kStretches);
    for (std::size_t i = 0; i < samples.size(); ++i)
      stretches[i * kStretches / samples.size()].take(samples[i], curve.y);
    keep(kept, stretches);
  }
  return kept;
}

std::vector<Sample> thinned_cloud(const std::vector<Sample>& samples, const Curve& curve,
                                  const AxisRange& x_range) {
  std::vector<Extremes> columns(kPointColumns);
  for (const Sample& sample : samples) {
    const std::size_t column = column_of(curve.x[sample.index], x_range);
    columns[column / kColumnsPerPointColumn].take(sample, curve.y);
  }
  std::vector<Sample> kept;
  keep(kept, columns);
  for (std::size_t i = 0; i < kEvenlySpaced; ++i)
    kept.push_back(samples[i * samples.size() / kEvenlySpaced]);
  return kept;
}

std::vector<Sample> thinned(const std::vector<Sample>& samples, const Curve& curve,
                            const AxisRange& x_range) {
  std::vector<Sample> kept = curve.style == CurveStyle::kPoints
                                 ? thinned_cloud(samples, curve, x_range)
                                 : thinned_line(samples, curve, x_range);
  std::sort(kept.begin(), kept.end(),
            [](const Sample& a, const Sample& b) { return a.index < b.index; });
  kept.erase(std::unique(kept.begin(), kept.end(),
                         [](const Sample& a, const Sample& b) { return a.index == b.index; }),
             kept.end());
  return kept;
}

bool spans_a_column(std::size_t from, std::size_t to) {
  return from > to + 1 || to > from + 1;
}

// One column of a band; `gaps_before` counts as in Sample, up to its first sample.
struct BandColumn {
  std::size_t column = 0;
  std::size_t gaps_before = 0;
  std::size_t gaps_before_last = 0;
  DrawnBand drawn;
};

// `lower` at the low end where a logarithmic axis can't show it.
bool is_band_drawable(const DrawnBand& band, const AxisRange& x_range, const AxisRange& y_range) {
  return is_drawable(band.x, x_range.scale) && is_drawable(band.upper, y_range.scale) &&
         is_drawable(band.lower, AxisScale::kLinear);
}

// Neighbours in one column merged if `thin`.
std::vector<BandColumn> band_columns(const Curve& curve, const AxisRange& x_range,
                                     const AxisRange& y_range, bool thin) {
  std::vector<BandColumn> columns;
  std::size_t gaps = 0;
  for (std::size_t i = 0; i < curve.lower.size(); ++i) {
    DrawnBand band{curve.x[i], curve.lower[i], curve.upper[i]};
    if (!is_band_drawable(band, x_range, y_range)) {
      ++gaps;
      continue;
    }
    if (!is_drawable(band.lower, y_range.scale)) band.lower = y_range.low;
    const std::size_t column = column_of(band.x, x_range);
    if (thin && !columns.empty() && columns.back().column == column) {
      BandColumn& same = columns.back();
      same.drawn.lower = std::min(same.drawn.lower, band.lower);
      same.drawn.upper = std::max(same.drawn.upper, band.upper);
      same.gaps_before_last = gaps;
    } else {
      columns.push_back({column, gaps, gaps, band});
    }
  }
  return columns;
}

}  // namespace

std::size_t column_of(double x, const AxisRange& x_range) {
  constexpr auto kColumns = static_cast<double>(kThinningColumns);
  return static_cast<std::size_t>(std::clamp(x_range.position(x) * kColumns, 0.0, kColumns - 1.0));
}

std::vector<PointRun> thinned_points(const Curve& curve, const AxisRange& x_range,
                                     const AxisRange& y_range) {
  std::vector<Sample> samples = drawable_samples(curve, x_range.scale, y_range.scale);
  const bool thin = samples.size() > kMostDrawnSamples;
  if (thin) samples = thinned(samples, curve, x_range);
  std::vector<PointRun> runs;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const DrawnPoint point{curve.x[samples[i].index], curve.y[samples[i].index]};
    bool begins = i == 0;
    if (!begins && samples[i].gaps_before != samples[i - 1].gaps_before) {
      begins = !thin || spans_a_column(column_of(runs.back().back().x, x_range),
                                       column_of(point.x, x_range));
    }
    if (begins) runs.emplace_back();
    runs.back().push_back(point);
  }
  return runs;
}

std::vector<BandRun> thinned_band(const Curve& curve, const AxisRange& x_range,
                                  const AxisRange& y_range) {
  const bool thin = curve.lower.size() > kMostDrawnSamples;
  std::vector<BandRun> runs;
  const BandColumn* before = nullptr;
  const std::vector<BandColumn> columns = band_columns(curve, x_range, y_range, thin);
  for (const BandColumn& next : columns) {
    const bool gap = before != nullptr && next.gaps_before != before->gaps_before_last &&
                     (!thin || spans_a_column(before->column, next.column));
    if (before == nullptr || gap) runs.emplace_back();
    runs.back().push_back(next.drawn);
    before = &next;
  }
  return runs;
}

}  // namespace zerodrift::report
