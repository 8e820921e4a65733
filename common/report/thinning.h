// SPDX-License-Identifier: Apache-2.0
// Long curves cut down to what a picture can show, so that no spike is lost.
#pragma once

#include <cstddef>
#include <vector>

#include "common/report/axis.h"
#include "common/report/chart.h"

namespace zerodrift::report {

// Curves of at most this many samples are drawn sample by sample, and no thinned one has more.
inline constexpr std::size_t kMostDrawnSamples = 4000;
// More than the plot has pixels in a row.
inline constexpr std::size_t kThinningColumns = 800;
inline constexpr std::size_t kColumnsPerPointColumn = 4;

struct DrawnPoint {
  double x = 0.0;
  double y = 0.0;
};
struct DrawnBand {
  double x = 0.0;
  double lower = 0.0;
  double upper = 0.0;
};

// Samples without a gap between them.
using PointRun = std::vector<DrawnPoint>;
using BandRun = std::vector<DrawnBand>;

// Of lines, the first, the lowest, the highest and the last sample of every column of the picture,
// in their order (M4: Jugel et al., VLDB 2014); where x goes back and forth, also those of every
// stretch of equal length, so that each branch of a loop is followed. Of points, those of every
// four columns together and evenly spaced ones, or a cloud would turn into its outline.
// Samples that can't be drawn end a run; in a thinned curve only if the gap spans a column. O(n),
// plus the sort of what is kept.
[[nodiscard]] std::vector<PointRun> thinned_points(const Curve& curve, const AxisRange& x_range,
                                                   const AxisRange& y_range);

// The lowest `lower` and the highest `upper` of every column. A lower edge that can't be drawn on a
// logarithmic axis lies at its low end. Empty for a curve without a band.
[[nodiscard]] std::vector<BandRun> thinned_band(const Curve& curve, const AxisRange& x_range,
                                                const AxisRange& y_range);

// The column of an x, 0 to kThinningColumns - 1.
[[nodiscard]] std::size_t column_of(double x, const AxisRange& x_range);

}  // namespace zerodrift::report
