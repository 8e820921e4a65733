// SPDX-License-Identifier: Apache-2.0
// The legend below a picture. gnuplot would give every entry the width of the widest and take the
// room from the plot.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace zerodrift::report {

inline constexpr double kPictureWidthPx = 800.0;
inline constexpr double kCharacterPx = 8.0;  // mean width in the font of the picture

struct LegendEntry {
  std::string name;
  std::string colour;  // "#0072B2"
  std::string dashes;  // lengths in px, "12,5"; empty: solid
  int symbol = 0;      // gnuplot's point type; 0: a line
};

[[nodiscard]] double legend_height_px(const std::vector<LegendEntry>& entries);

// Entries in rows, each row centred, as SVG elements that end at `bottom_px` of the picture.
[[nodiscard]] std::string legend_svg(const std::vector<LegendEntry>& entries, double bottom_px,
                                     const std::string& id_prefix);

}  // namespace zerodrift::report
