// SPDX-License-Identifier: Apache-2.0
// A chart as gnuplot takes it.
#pragma once

#include <string>
#include <vector>

#include "common/report/chart.h"
#include "common/report/legend.h"

namespace zerodrift::report {

// gnuplot reads a script, and a script can run programs. So no text of a chart goes into it: only
// numbers, and placeholders of the same length that stand for the labels until they are drawn.
struct PictureScript {
  std::string script;
  std::vector<std::string> placeholders;
  std::vector<std::string> labels;  // as many; not yet escaped
  std::vector<LegendEntry> legend;  // drawn by inline_svg() into the room left at the bottom
  double height_px = 0.0;           // with the legend
};

// `chart` must be valid. O(samples).
[[nodiscard]] PictureScript picture_script(const Chart& chart);

}  // namespace zerodrift::report
