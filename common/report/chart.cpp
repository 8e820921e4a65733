// SPDX-License-Identifier: Apache-2.0
#include "common/report/chart.h"

#include <algorithm>
#include <cstddef>
#include <stdexcept>

#include "common/report/axis.h"
#include "common/report/gnuplot.h"
#include "common/report/inline_svg.h"
#include "common/report/picture_script.h"
#include "common/report/plain_text.h"

namespace zerodrift::report {
namespace {

std::string sizes(const char* what, std::size_t found, std::size_t right) {
  return std::string{" has "} + std::to_string(found) + " values of " + what + "; as many as x, " +
         std::to_string(right) + ", would be right";
}

// NaN neither ascends nor descends: it is a gap.
bool descends_somewhere(const std::vector<double>& x) {
  return std::adjacent_find(x.begin(), x.end(), [](double a, double b) { return a > b; }) !=
         x.end();
}

std::optional<std::string> objection(const Curve& curve) {
  const std::size_t n = curve.x.size();
  if (curve.y.size() != n) return sizes("y", curve.y.size(), n);
  if (curve.lower.empty() && curve.upper.empty()) return std::nullopt;
  if (curve.lower.size() != n) return sizes("lower", curve.lower.size(), n);
  if (curve.upper.size() != n) return sizes("upper", curve.upper.size(), n);
  if (descends_somewhere(curve.x)) return " has a band and x that descends; x must ascend then";
  return std::nullopt;
}

}  // namespace

std::optional<std::string> validate(const Chart& chart) {
  const std::string name = "chart '" + one_line(chart.title) + "': ";
  for (const Curve& curve : chart.curves) {
    if (const auto wrong = objection(curve))
      return name + "curve '" + one_line(curve.name) + "'" + *wrong;
  }
  if (!chart.y_range) return std::nullopt;
  const ValueRange& y = *chart.y_range;
  const bool drawable = is_drawable(y.low, chart.y_scale) && is_drawable(y.high, chart.y_scale);
  if (!drawable || y.low >= y.high) {
    return name + "y_range is " + std::to_string(y.low) + " to " + std::to_string(y.high) +
           "; finite and ascending ends would be right, above 0 on a logarithmic axis";
  }
  return std::nullopt;
}

std::string svg_of(const Chart& chart, const std::string& id_prefix,
                   const std::string& accessible_name) {
  if (const auto wrong = validate(chart)) throw std::invalid_argument(*wrong);
  const PictureScript picture = picture_script(chart);
  return inline_svg(run_gnuplot(picture.script), picture, id_prefix, accessible_name);
}

}  // namespace zerodrift::report
