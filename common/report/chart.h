// SPDX-License-Identifier: Apache-2.0
// A picture of curves, and its drawing as SVG by gnuplot.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace zerodrift::report {

enum class AxisScale { kLinear, kLogarithmic };
enum class CurveStyle { kLine, kPoints, kGuide };  // kGuide: a thin grey dashed line
enum class Orientation { kVertical, kHorizontal };

// Samples that can't be drawn (NaN, infinite, not positive on a logarithmic axis) leave a gap.
struct Curve {
  std::string name;  // in the legend; none if empty
  std::vector<double> x = {};
  std::vector<double> y = {};  // as many as x
  // A band around the curve, both or none, as many as x; x must then ascend.
  std::vector<double> lower = {};
  std::vector<double> upper = {};
  CurveStyle style = CurveStyle::kLine;
  std::optional<std::size_t> colour = {};  // place in the palette; the curve's own without
};

// A line across the picture: vertical at an x, horizontal at a y.
struct Mark {
  Orientation orientation = Orientation::kVertical;
  double at = 0.0;
  std::string label;
};

struct ValueRange {
  double low = 0.0;
  double high = 1.0;
};

struct Chart {
  std::string title;
  std::string x_label;  // with the unit: "time (h)"
  std::string y_label;
  AxisScale x_scale = AxisScale::kLinear;
  AxisScale y_scale = AxisScale::kLinear;
  std::vector<Curve> curves = {};
  std::vector<Mark> marks = {};
  // Otherwise all that is drawn but the guides, which are cut off at the edges.
  std::optional<ValueRange> y_range = std::nullopt;
};

[[nodiscard]] std::optional<std::string> validate(const Chart& chart);

// One <svg> element without its title, to be set into a page: no script, nothing external, equal
// input gives equal bytes. Its ids begin with `id_prefix` (letters, digits, '-'), so that several
// don't collide. Axis labels are shortened beyond 80 characters, names of curves beyond 60, labels
// of marks beyond 40. O(samples). Throws std::invalid_argument where validate() objects,
// ReportError where gnuplot is missing or fails.
[[nodiscard]] std::string svg_of(const Chart& chart, const std::string& id_prefix,
                                 const std::string& accessible_name);

}  // namespace zerodrift::report
