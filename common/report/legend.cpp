// SPDX-License-Identifier: Apache-2.0
#include "common/report/legend.h"

#include <array>
#include <charconv>

#include "common/report/plain_text.h"

namespace zerodrift::report {
namespace {

constexpr double kRowPx = 24.0;
constexpr double kBelowPx = 10.0;
constexpr double kLinePx = 40.0;
constexpr double kSymbolPx = 14.0;
constexpr double kBesideSamplePx = 8.0;
constexpr double kBetweenPx = 28.0;
constexpr double kEdgePx = 12.0;

using LegendRow = std::vector<const LegendEntry*>;

double sample_px(const LegendEntry& entry) {
  return entry.symbol > 0 ? kSymbolPx : kLinePx;
}

double width_px(const LegendEntry& entry) {
  return sample_px(entry) + kBesideSamplePx +
         kCharacterPx * static_cast<double>(character_count(entry.name));
}

double width_px(const LegendRow& row) {
  double width = 0.0;
  for (const LegendEntry* entry : row) width += (width > 0.0 ? kBetweenPx : 0.0) + width_px(*entry);
  return width;
}

// As many to a row as fit, at least one.
std::vector<LegendRow> rows_of(const std::vector<LegendEntry>& entries) {
  std::vector<LegendRow> rows;
  for (const LegendEntry& entry : entries) {
    const bool fits = !rows.empty() && width_px(rows.back()) + kBetweenPx + width_px(entry) <=
                                           kPictureWidthPx - 2.0 * kEdgePx;
    if (!fits) rows.emplace_back();
    rows.back().push_back(&entry);
  }
  return rows;
}

std::string px(double value) {
  std::array<char, 32> text{};
  const auto [end, error] =
      std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::fixed, 1);
  return {text.data(), end};
}

std::string sample(const LegendEntry& entry, double x, double y, const std::string& id_prefix) {
  if (entry.symbol > 0) {
    return "<use xlink:href=\"#" + id_prefix + "gpPt" + std::to_string(entry.symbol - 1) +
           "\" transform=\"translate(" + px(x + 0.5 * kSymbolPx) + "," + px(y) +
           ") scale(4)\" color=\"" + entry.colour + "\" stroke=\"currentColor\" fill=\"none\"/>\n";
  }
  const std::string dashes =
      entry.dashes.empty() ? "" : " stroke-dasharray=\"" + entry.dashes + "\"";
  return "<path d=\"M" + px(x) + "," + px(y) + " h" + px(kLinePx) + "\" fill=\"none\" stroke=\"" +
         entry.colour + "\" stroke-width=\"2.2\" stroke-linecap=\"round\"" + dashes + "/>\n";
}

std::string drawn(const LegendEntry& entry, double x, double y, const std::string& id_prefix) {
  return sample(entry, x, y, id_prefix) + "<text x=\"" +
         px(x + sample_px(entry) + kBesideSamplePx) + "\" y=\"" + px(y + 5.0) +
         "\" font-size=\"14\" fill=\"#222222\">" + escaped(entry.name) + "</text>\n";
}

}  // namespace

double legend_height_px(const std::vector<LegendEntry>& entries) {
  return entries.empty() ? 0.0 : kRowPx * static_cast<double>(rows_of(entries).size()) + kBelowPx;
}

std::string legend_svg(const std::vector<LegendEntry>& entries, double bottom_px,
                       const std::string& id_prefix) {
  std::string svg;
  double y = bottom_px - legend_height_px(entries) + 0.5 * kRowPx;
  for (const LegendRow& row : rows_of(entries)) {
    double x = 0.5 * (kPictureWidthPx - width_px(row));
    for (const LegendEntry* entry : row) {
      svg += drawn(*entry, x, y, id_prefix);
      x += width_px(*entry) + kBetweenPx;
    }
    y += kRowPx;
  }
  return svg;
}

}  // namespace zerodrift::report
