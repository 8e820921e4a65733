// SPDX-License-Identifier: Apache-2.0
#include "common/report/picture_script.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <string_view>

#include "common/report/axis.h"
#include "common/report/plain_text.h"
#include "common/report/thinning.h"

namespace zerodrift::report {
namespace {

constexpr double kHeightPx = 450.0;      // without the legend
constexpr double kPlotWidthPx = 700.0;   // what margins leave, roughly
constexpr double kPlotHeightPx = 370.0;  // the same
constexpr double kBelowPlotPx = 70.0;    // tick labels and the axis label

constexpr std::size_t kLongestAxisLabel = 80;
constexpr std::size_t kLongestCurveName = 60;
constexpr std::size_t kLongestMarkLabel = 40;

// Okabe & Ito's palette for all kinds of colour vision, without its yellow, which is too pale for
// lines; ordered by contrast.
constexpr std::array<std::string_view, 7> kColours{"#0072B2", "#D55E00", "#009E73", "#CC79A7",
                                                   "#E69F00", "#56B4E9", "#000000"};
// Lengths in px; empty: solid.
constexpr std::array<std::string_view, 6> kDashes{"",         "12,5", "3,4",
                                                  "14,4,3,4", "22,6", "8,4,2,4,2,4"};
constexpr std::array<std::string_view, 3> kGuideDashes{"4,4", "1.5,3", "8,3,1.5,3"};
constexpr std::string_view kGuideColour = "#666666";
// gnuplot's filled and open circles, squares, triangles, diamonds.
constexpr std::array<int, 7> kSymbols{7, 4, 9, 13, 6, 5, 8};

// More points than this are a cloud of dots.
constexpr std::size_t kLargestMarkedSet = 300;
constexpr int kDot = 7;
constexpr std::string_view kHalfTransparent = "80";  // gnuplot's "#AARRGGBB", 0 is opaque

std::string number(double value) {
  std::array<char, 32> text{};
  const auto [end, error] = std::to_chars(text.data(), text.data() + text.size(), value);
  return {text.data(), end};
}

class Labels {
 public:
  explicit Labels(PictureScript& picture) : picture_(picture) {}

  // A quoted placeholder; empty quotes for an empty label.
  std::string quoted(std::string_view label, std::size_t longest) {
    std::string text = shortened(label, longest);
    if (text.empty()) return "''";
    std::string placeholder = "L" + std::to_string(picture_.labels.size());
    const std::size_t length = std::max(placeholder.size(), character_count(text));
    placeholder.append(length - placeholder.size(), 'x');
    picture_.placeholders.push_back(placeholder);
    picture_.labels.push_back(std::move(text));
    return "'" + placeholder + "'";
  }

 private:
  PictureScript& picture_;
};

struct Axes {
  AxisRange x;
  AxisRange y;
};

std::vector<double> marks_at(const Chart& chart, Orientation orientation) {
  std::vector<double> values;
  for (const Mark& mark : chart.marks) {
    if (mark.orientation == orientation) values.push_back(mark.at);
  }
  return values;
}

// Only samples whose other coordinate can be drawn too may stretch an axis.
void append_drawn(std::vector<double>& values, const std::vector<double>& of,
                  const std::vector<double>& other, AxisScale other_scale) {
  for (std::size_t i = 0; i < of.size(); ++i) {
    if (is_drawable(other[i], other_scale)) values.push_back(of[i]);
  }
}

Axes axes_of(const Chart& chart) {
  const bool only_guides =
      std::all_of(chart.curves.begin(), chart.curves.end(),
                  [](const Curve& curve) { return curve.style == CurveStyle::kGuide; });
  std::vector<double> x = marks_at(chart, Orientation::kVertical);
  std::vector<double> y = marks_at(chart, Orientation::kHorizontal);
  for (const Curve& curve : chart.curves) {
    if (curve.style == CurveStyle::kGuide && !only_guides) continue;
    append_drawn(x, curve.x, curve.y, chart.y_scale);
    append_drawn(y, curve.y, curve.x, chart.x_scale);
    append_drawn(y, curve.lower, curve.x, chart.x_scale);
    append_drawn(y, curve.upper, curve.x, chart.x_scale);
  }
  const double x_margin = chart.x_scale == AxisScale::kLogarithmic ? 0.02 : 0.0;
  Axes axes{range_of(x, chart.x_scale, x_margin), range_of(y, chart.y_scale, 0.04)};
  if (chart.y_range) axes.y = {chart.y_range->low, chart.y_range->high, chart.y_scale};
  return axes;
}

std::string axis_lines(char axis, const AxisRange& range, int wanted_ticks) {
  const std::string name{axis};
  std::string text =
      "set " + name + "range [" + number(range.low) + ":" + number(range.high) + "]\n";
  if (range.scale == AxisScale::kLogarithmic) text += "set logscale " + name + " 10\n";
  text += "set " + name + "tics nomirror out scale 0.6,0.3 textcolor rgb '#333333' (";
  bool first = true;
  for (const Tick& tick : ticks(range, wanted_ticks)) {
    if (!first) text += ", ";
    first = false;
    text += "'" + tick.label + "' " + number(tick.at) + (tick.label.empty() ? " 1" : " 0");
  }
  return text + ")\n";
}

bool is_within(double value, const AxisRange& range) {
  return is_drawable(value, range.scale) && value >= range.low && value <= range.high;
}

std::string mark_line(Orientation orientation, double at) {
  const std::string value = number(at);
  const std::string ends = orientation == Orientation::kVertical
                               ? "first " + value + ", graph 0 to first " + value + ", graph 1"
                               : "graph 0, first " + value + " to graph 1, first " + value;
  return "set arrow from " + ends + " nohead front lw 1.2 lc rgb '#444444' dt (5,3)\n";
}

// A label above the plot, kept clear of its neighbours by rows.
struct VerticalLabel {
  const Mark* mark = nullptr;
  double place = 0.0;  // 0 to 1 along the axis
  std::size_t row = 0;
};

// From left to right, each into the lowest row that is free there.
std::vector<VerticalLabel> vertical_labels(const Chart& chart, const AxisRange& x) {
  std::vector<VerticalLabel> found;
  for (const Mark& mark : chart.marks) {
    if (mark.orientation == Orientation::kVertical && is_within(mark.at, x))
      found.push_back({&mark, x.position(mark.at)});
  }
  std::stable_sort(found.begin(), found.end(), [](const VerticalLabel& a, const VerticalLabel& b) {
    return a.place < b.place;
  });
  std::vector<double> row_ends_px;
  for (VerticalLabel& label : found) {
    const auto characters =
        static_cast<double>(character_count(shortened(label.mark->label, kLongestMarkLabel)) + 2);
    const double width_px = characters * kCharacterPx;
    const double begin_px = label.place * (kPlotWidthPx - width_px);
    while (label.row < row_ends_px.size() && row_ends_px[label.row] > begin_px) ++label.row;
    if (label.row == row_ends_px.size()) row_ends_px.push_back(0.0);
    row_ends_px[label.row] = begin_px + width_px;
  }
  return found;
}

std::string_view justification(double place) {
  return place < 0.15 ? "left" : place > 0.85 ? "right" : "center";
}

std::string vertical_marks(const Chart& chart, const AxisRange& x, Labels& labels) {
  std::string text;
  std::size_t rows = 0;
  for (const VerticalLabel& label : vertical_labels(chart, x)) {
    text += mark_line(Orientation::kVertical, label.mark->at);
    rows = std::max(rows, label.row + 1);
    text += "set label " + labels.quoted(label.mark->label, kLongestMarkLabel) + " at first " +
            number(label.mark->at) + ", graph 1 offset 0, character " +
            number(0.7 + 1.2 * static_cast<double>(label.row)) + " " +
            std::string{justification(label.place)} + " front textcolor rgb '#222222'\n";
  }
  return text + "set tmargin " + number(1.0 + 1.2 * static_cast<double>(rows)) + "\n";
}

std::string data_block(const std::string& name, const std::vector<PointRun>& runs) {
  std::string text = "$" + name + " << E\n";
  for (const PointRun& run : runs) {
    for (const DrawnPoint& point : run) text += number(point.x) + " " + number(point.y) + "\n";
    text += "\n";
  }
  return text + "E\n";
}

std::string data_block(const std::string& name, const std::vector<BandRun>& runs) {
  std::string text = "$" + name + " << E\n";
  for (const BandRun& run : runs) {
    for (const DrawnBand& band : run)
      text += number(band.x) + " " + number(band.lower) + " " + number(band.upper) + "\n";
    text += "\n";
  }
  return text + "E\n";
}

// Noise fills the plot: dashes in it can't be seen, they only eat peaks.
bool is_dense(const std::vector<PointRun>& runs, const AxisRange& y) {
  double travel = 0.0;  // in heights of the plot
  for (const PointRun& run : runs) {
    for (std::size_t i = 1; i < run.size(); ++i)
      travel += std::abs(y.position(run[i].y) - y.position(run[i - 1].y));
  }
  return travel * kPlotHeightPx > 5.0 * kPlotWidthPx;
}

std::size_t size_of(const std::vector<PointRun>& runs) {
  return std::accumulate(runs.begin(), runs.end(), std::size_t{0},
                         [](std::size_t sum, const PointRun& run) { return sum + run.size(); });
}

// How a curve looks: in gnuplot's words, and in the legend.
struct Look {
  std::string style;
  LegendEntry legend;
  bool dense = false;  // noise, or a cloud of points
};

// Counts what distinguishes one curve from the next. Colours and dashes are 7 and 6, so 42 lines
// differ.
class Looks {
 public:
  Look next(const Curve& curve, const std::vector<PointRun>& runs, const AxisRange& y) {
    if (curve.style == CurveStyle::kGuide) {
      const std::string_view dashes = kGuideDashes[guides_++ % kGuideDashes.size()];
      return line(curve, kGuideColour, dashes, "1.2");
    }
    const std::size_t ordinal = curves_++;
    const std::string_view colour = kColours[curve.colour.value_or(ordinal) % kColours.size()];
    if (curve.style == CurveStyle::kPoints) return points(curve, runs, colour, ordinal);
    if (!is_dense(runs, y)) return line(curve, colour, kDashes[ordinal % kDashes.size()], "2.2");
    Look look = line(curve, colour, "", "1");
    look.dense = true;
    return look;
  }

 private:
  static Look line(const Curve& curve, std::string_view colour, std::string_view dashes,
                   const char* width) {
    const std::string type = dashes.empty() ? "solid" : "(" + std::string{dashes} + ")";
    return {
        " with lines lw " + std::string{width} + " lc rgb '" + std::string{colour} + "' dt " + type,
        {shortened(curve.name, kLongestCurveName), std::string{colour}, std::string{dashes}}};
  }

  static Look points(const Curve& curve, const std::vector<PointRun>& runs, std::string_view colour,
                     std::size_t ordinal) {
    const bool cloud = size_of(runs) > kLargestMarkedSet;
    const int symbol = cloud ? kDot : kSymbols[ordinal % kSymbols.size()];
    std::string own_colour{colour};
    if (cloud) own_colour.insert(1, kHalfTransparent);
    return {" with points pt " + std::to_string(symbol) + (cloud ? " ps 0.25" : " ps 0.7") +
                " lw 1.5 lc rgb '" + own_colour + "'",
            {shortened(curve.name, kLongestCurveName), std::string{colour}, {}, symbol},
            cloud};
  }

  std::size_t curves_ = 0;
  std::size_t guides_ = 0;
};

// A curve cut down to the picture.
struct Drawn {
  std::string name;  // of its data blocks
  CurveStyle style = CurveStyle::kLine;
  std::vector<PointRun> runs;
  std::vector<BandRun> band;
  Look look;
};

std::vector<Drawn> drawn_curves(const Chart& chart, const Axes& axes) {
  std::vector<Drawn> all;
  Looks looks;
  for (const Curve& curve : chart.curves) {
    Drawn drawn{std::to_string(all.size()),
                curve.style,
                thinned_points(curve, axes.x, axes.y),
                thinned_band(curve, axes.x, axes.y),
                {}};
    drawn.look = looks.next(curve, drawn.runs, axes.y);
    all.push_back(std::move(drawn));
  }
  return all;
}

std::string data_blocks(const std::vector<Drawn>& curves) {
  std::string text;
  for (const Drawn& curve : curves) {
    if (!curve.band.empty()) text += data_block("band" + curve.name, curve.band);
    if (!curve.runs.empty()) text += data_block("curve" + curve.name, curve.runs);
  }
  return text;
}

// Under a line or symbols on top of noise: a white edge.
std::string edge_style(CurveStyle style) {
  if (style == CurveStyle::kPoints)
    return " with points pt " + std::to_string(kDot) + " ps 1.3 lc rgb '#ffffff'";
  return " with lines lw 5 lc rgb '#ffffff' dt solid";
}

// Bands first, so that none covers another curve's line.
std::string plot_command(const std::vector<Drawn>& curves) {
  const bool noisy = std::any_of(curves.begin(), curves.end(),
                                 [](const Drawn& curve) { return curve.look.dense; });
  std::string text = "plot NaN";
  for (const Drawn& curve : curves) {
    if (curve.band.empty()) continue;
    text += ", $band" + curve.name + " using 1:2:3 with filledcurves fc rgb '" +
            curve.look.legend.colour + "' fs transparent solid 0.18 noborder";
  }
  for (const Drawn& curve : curves) {
    if (curve.runs.empty()) continue;
    const std::string source = ", $curve" + curve.name + " using 1:2";
    const bool edged = noisy && curve.style != CurveStyle::kGuide && !curve.look.dense;
    if (edged) text += source + edge_style(curve.style);
    text += source + curve.look.style;
  }
  return text + "\n";
}

// Samples in a box of the plot; edges from 0 to 1 of its width and height.
struct Box {
  double left = 0.0;
  double right = 1.0;
  double bottom = 0.0;
  double top = 1.0;
};

std::size_t samples_in(const Box& box, const std::vector<Drawn>& curves, const Axes& axes) {
  std::size_t count = 0;
  for (const Drawn& curve : curves) {
    for (const PointRun& run : curve.runs) {
      count += static_cast<std::size_t>(
          std::count_if(run.begin(), run.end(), [&](const DrawnPoint& point) {
            const double x = axes.x.position(point.x);
            const double y = axes.y.position(point.y);
            return x >= box.left && x <= box.right && y >= box.bottom && y <= box.top;
          }));
    }
  }
  return count;
}

// The label stands at the emptier end of its line, above it, or below where it would hit the next
// line's label or the top.
std::string horizontal_label(const Mark& mark, double next_place, const Axes& axes,
                             const std::vector<Drawn>& curves, Labels& labels) {
  constexpr double kLabelHeight = 22.0 / kPlotHeightPx;
  const double place = axes.y.position(mark.at);
  const bool above = next_place - place > kLabelHeight;
  const double bottom = above ? place : place - kLabelHeight;
  const double top = bottom + kLabelHeight;
  const double width =
      kCharacterPx / kPlotWidthPx *
      static_cast<double>(character_count(shortened(mark.label, kLongestMarkLabel)) + 1);
  const bool right = samples_in({1.0 - width, 1.0, bottom, top}, curves, axes) <=
                     samples_in({0.0, width, bottom, top}, curves, axes);
  return "set label " + labels.quoted(mark.label, kLongestMarkLabel) + " at graph " +
         (right ? "0.99" : "0.01") + ", first " + number(mark.at) + " offset 0, character " +
         (above ? "0.55" : "-0.75") + (right ? " right" : " left") +
         " front textcolor rgb '#222222'\n";
}

std::string horizontal_marks(const Chart& chart, const Axes& axes, const std::vector<Drawn>& curves,
                             Labels& labels) {
  std::vector<const Mark*> marks;
  for (const Mark& mark : chart.marks) {
    if (mark.orientation == Orientation::kHorizontal && is_within(mark.at, axes.y))
      marks.push_back(&mark);
  }
  std::stable_sort(marks.begin(), marks.end(),
                   [](const Mark* a, const Mark* b) { return a->at < b->at; });
  std::string text;
  for (std::size_t i = 0; i < marks.size(); ++i) {
    const double next = i + 1 < marks.size() ? axes.y.position(marks[i + 1]->at) : 1.0;
    text += mark_line(Orientation::kHorizontal, marks[i]->at);
    text += horizontal_label(*marks[i], next, axes, curves, labels);
  }
  return text;
}

std::string frame(double height_px, double legend_px) {
  return "set encoding utf8\n"
         "set terminal svg size " +
         number(kPictureWidthPx) + "," + number(height_px) +
         " dynamic noenhanced font 'sans-serif,15' background '#ffffff' rounded\n"
         "set border 3 lw 1 lc rgb '#555555'\n"
         "set grid xtics ytics mxtics mytics back lt 1 lw 0.8 lc rgb '#D4D8DC' dt solid,"
         " lt 1 lw 0.5 lc rgb '#E9ECEE' dt solid\n"
         "set clip two\n"
         "unset key\n"
         "set rmargin 3\n"
         "set bmargin at screen " +
         number((legend_px + kBelowPlotPx) / height_px) + "\n";
}

std::vector<LegendEntry> legend_of(const std::vector<Drawn>& curves) {
  std::vector<LegendEntry> entries;
  for (const Drawn& curve : curves) {
    if (!curve.look.legend.name.empty()) entries.push_back(curve.look.legend);
  }
  return entries;
}

}  // namespace

PictureScript picture_script(const Chart& chart) {
  const Axes axes = axes_of(chart);
  const std::vector<Drawn> curves = drawn_curves(chart, axes);
  PictureScript picture;
  Labels labels{picture};
  picture.legend = legend_of(curves);
  const double legend_px = legend_height_px(picture.legend);
  picture.height_px = kHeightPx + legend_px;
  std::string& script = picture.script;
  script = frame(picture.height_px, legend_px);
  script += axis_lines('x', axes.x, 8);
  script += axis_lines('y', axes.y, 6);
  script += "set xlabel " + labels.quoted(chart.x_label, kLongestAxisLabel) + " offset 0,0.3\n";
  script += "set ylabel " + labels.quoted(chart.y_label, kLongestAxisLabel) + "\n";
  script += vertical_marks(chart, axes.x, labels);
  script += horizontal_marks(chart, axes, curves, labels);
  const bool nothing = std::all_of(curves.begin(), curves.end(),
                                   [](const Drawn& curve) { return curve.runs.empty(); });
  if (nothing) script += "set label 'no data' at graph 0.5, graph 0.5 center\n";
  script += data_blocks(curves);
  script += plot_command(curves);
  return picture;
}

}  // namespace zerodrift::report
