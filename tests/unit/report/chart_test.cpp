// SPDX-License-Identifier: Apache-2.0
#include "common/report/chart.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <set>
#include <stdexcept>

#include "common/report/picture_script.h"
#include "common/report/plain_text.h"
#include "common/report/report_error.h"
#include "tests/support/scratch_folder.h"
#include "tests/unit/report/example_document.h"
#include "tests/unit/report/markup.h"
#include "tests/unit/report/other_path.h"

namespace zerodrift::report {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct Pixel {
  double x = 0.0;
  double y = 0.0;
};

// The numbers of "M1.00,2.00 L3.00,4.00 ...".
std::vector<Pixel> pixels_of(const std::string& path) {
  std::vector<double> numbers;
  const char* const end = path.data() + path.size();
  for (const char* at = path.data(); at < end;) {
    double value = 0.0;
    const auto [next, error] = std::from_chars(at, end, value);
    if (error == std::errc{}) numbers.push_back(value);
    at = error == std::errc{} ? next : at + 1;
  }
  std::vector<Pixel> pixels;
  for (std::size_t i = 0; i + 1 < numbers.size(); i += 2)
    pixels.push_back({numbers[i], numbers[i + 1]});
  return pixels;
}

// The path drawn in the first curve's colour, #0072B2.
std::vector<Pixel> first_curve(const Markup& svg) {
  for (const Element& path : svg.named("path")) {
    const auto stroke = path.attributes.find("stroke");
    if (stroke != path.attributes.end() && stroke->second == "rgb(  0, 114, 178)")
      return pixels_of(path.attributes.at("d"));
  }
  return {};
}

std::string text_of(const Markup& svg) {
  std::string all;
  for (const Element& text : svg.named("text")) all += text.text + '\n';
  return all;
}

Markup drawn(const Chart& chart) {
  return read_markup(svg_of(chart, "a-", "name"));
}

Curve line(std::vector<double> x, std::vector<double> y) {
  return {.name = "curve", .x = std::move(x), .y = std::move(y)};
}

TEST(ChartScenario, APowerLawIsAStraightLineOnLogarithmicAxes) {
  Chart chart{.title = "Allan",
              .x_label = "τ (s)",
              .y_label = "σ (deg/h)",
              .x_scale = AxisScale::kLogarithmic,
              .y_scale = AxisScale::kLogarithmic};
  Curve curve{.name = "white noise"};
  for (int i = 0; i <= 40; ++i) {
    curve.x.push_back(std::pow(10.0, 0.1 * i));
    curve.y.push_back(0.3 * std::pow(10.0, -0.05 * i));
  }
  chart.curves = {curve};
  const std::vector<Pixel> pixels = first_curve(drawn(chart));
  ASSERT_EQ(pixels.size(), curve.x.size());
  const double slope = (pixels.back().y - pixels.front().y) / (pixels.back().x - pixels.front().x);
  EXPECT_GT(slope, 0.0);  // down the picture
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    // gnuplot rounds to 0.01 px: half of that at this point and at the ends, in x and y.
    EXPECT_NEAR(pixels[i].y, pixels.front().y + slope * (pixels[i].x - pixels.front().x), 0.03);
  }
}

TEST(ChartScenario, ASpikeOfOneSampleAmongTwoMillionIsDrawn) {
  constexpr std::size_t kSamples = 2'000'000;
  Chart chart{.title = "a", .x_label = "t (s)", .y_label = "rate"};
  Curve curve{.name = "rate"};
  curve.x.resize(kSamples);
  curve.y.resize(kSamples);
  for (std::size_t i = 0; i < kSamples; ++i) curve.x[i] = static_cast<double>(i);
  curve.y[kSamples / 4] = 1.0;
  chart.curves = {curve};
  const std::vector<Pixel> pixels = first_curve(drawn(chart));
  ASSERT_LE(pixels.size(), 4000U);
  const auto [highest, lowest] = std::minmax_element(
      pixels.begin(), pixels.end(), [](const Pixel& a, const Pixel& b) { return a.y < b.y; });
  EXPECT_GT(lowest->y - highest->y, 300.0);  // the plot is about 370 px high
  const double place = (highest->x - pixels.front().x) / (pixels.back().x - pixels.front().x);
  EXPECT_NEAR(place, 0.25, 1e-4);  // rounding to 0.01 px of about 680
}

TEST(ChartScenario, AllanChartShowsItsBandsGuidesMarksAndLegend) {
  const Markup svg = drawn(allan_chart());
  ASSERT_EQ(svg.error, "");
  EXPECT_EQ(svg.named("polygon").size(), 2U);
  const std::string texts = text_of(svg);
  for (const char* text : {"raw\n", "compensated (online SVR)\n", "slope −1/2\n", "slope +1/2\n",
                           "N = 1.00e-3 deg/√h, read at 1 s\n", "limit 0.01 deg/h\n",
                           "cluster time τ (s)\n", "σ(τ) (deg/h)\n", "0.01\n", "1000\n"}) {
    EXPECT_NE(texts.find(text), std::string::npos) << text;
  }
  std::set<std::string> looks;  // colour and dashes of the four lines in the legend
  for (const Element& path : svg.named("path")) {
    const auto stroke = path.attributes.find("stroke");
    if (stroke == path.attributes.end() || !stroke->second.starts_with('#')) continue;
    const auto dashes = path.attributes.find("stroke-dasharray");
    looks.insert(stroke->second + (dashes == path.attributes.end() ? "" : dashes->second));
  }
  EXPECT_EQ(looks.size(), 4U);
}

TEST(ChartLaws, EqualInputGivesEqualBytesAndPrefixesKeepIdsApart) {
  const std::string one = svg_of(allan_chart(), "one-", "name");
  EXPECT_EQ(one, svg_of(allan_chart(), "one-", "name"));
  const Markup first = read_markup(one);
  std::set<std::string> ids;
  for (const Element& element : first.elements) {
    if (const auto id = element.attributes.find("id"); id != element.attributes.end()) {
      EXPECT_TRUE(id->second.starts_with("one-")) << id->second;
      EXPECT_TRUE(ids.insert(id->second).second) << id->second;
    }
  }
  EXPECT_FALSE(ids.empty());
  for (const Element& use : first.named("use"))
    EXPECT_TRUE(ids.contains(use.attributes.at("xlink:href").substr(1)));
}

TEST(ChartLaws, OnlyTheNameIsTakenByAssistiveTechnology) {
  const Markup svg = read_markup(svg_of(allan_chart(), "a-", "\"A\" & <B>"));
  EXPECT_EQ(svg.elements[0].attributes.at("role"), "img");
  EXPECT_EQ(svg.elements[0].attributes.at("aria-label"), "&quot;A&quot; &amp; &lt;B&gt;");
  EXPECT_TRUE(svg.named("title").empty());
  EXPECT_TRUE(svg.named("desc").empty());
}

class HostileLabels : public ScratchFolder {};

// Each of these runs a program, or ends the data or the string, if gnuplot reads it as its own.
TEST_F(HostileLabels, NeverReachGnuplotAndAreDrawnAsTheyAre) {
  const std::string file = path("touched").string();
  for (const std::string& text :
       {"`touch " + file + "`", "'; system 'touch " + file + "' #", "\"; !touch " + file,
        "a\n!touch " + file + "\n", "\nE\nsystem(\"touch " + file + "\")\n", std::string{"$(x)\\"},
        std::string{"@touch %s 10^{2} _a"}, std::string{"<script>alert(1)</script>"},
        std::string{"</text></svg>&"}, std::string{"L0 L1 L2"}}) {
    const Chart chart{
        .title = text,
        .x_label = text,
        .y_label = text,
        .curves = {{.name = text, .x = {0.0, 1.0}, .y = {0.0, 1.0}}},
        .marks = {{Orientation::kVertical, 0.5, text}, {Orientation::kHorizontal, 0.5, text}}};
    const std::string script = picture_script(chart).script;
    EXPECT_EQ(script.find("touch"), std::string::npos);
    EXPECT_EQ(script.find("script"), std::string::npos);
    const Markup svg = drawn(chart);
    ASSERT_EQ(svg.error, "") << text;
    EXPECT_TRUE(svg.named("script").empty());
    EXPECT_NE(text_of(svg).find(escaped(shortened(text, 40))), std::string::npos) << text;
  }
  EXPECT_EQ(file_count(), 0U);
}

TEST(ChartAbuse, LabelsThatLookLikePlaceholdersStayThemselves) {
  const Chart chart{
      .title = "a", .x_label = "L1", .y_label = "L0", .marks = {{.at = 1, .label = "L2"}}};
  const std::string texts = text_of(drawn(chart));
  EXPECT_NE(texts.find("L0\n"), std::string::npos);
  EXPECT_NE(texts.find("L1\n"), std::string::npos);
  EXPECT_NE(texts.find("L2\n"), std::string::npos);
}

TEST(ChartAbuse, NothingToDrawSaysNoData) {
  for (const AxisScale scale : {AxisScale::kLinear, AxisScale::kLogarithmic}) {
    for (const std::vector<Curve>& curves : std::vector<std::vector<Curve>>{
             {}, {line({}, {})}, {line({kNan, 1.0}, {1.0, kInfinity})}}) {
      const Chart chart{.title = "a",
                        .x_label = "",
                        .y_label = "",
                        .x_scale = scale,
                        .y_scale = scale,
                        .curves = curves};
      const Markup svg = drawn(chart);
      EXPECT_EQ(svg.error, "");
      EXPECT_NE(text_of(svg).find("no data\n"), std::string::npos);
    }
  }
}

TEST(ChartAbuse, WhatCannotBeDrawnIsAGap) {
  Chart chart{.title = "a", .x_label = "x", .y_label = "y"};
  chart.curves = {line({0, 1, 2, 3, 4, 5, 6}, {1, 2, kNan, 3, 4, -kInfinity, 1e308})};
  EXPECT_EQ(first_curve(drawn(chart)).size(), 4U);
  chart.y_scale = AxisScale::kLogarithmic;
  chart.curves = {line({0, 1, 2, 3, 4, 5}, {1, 2, 0, 3, 4, -1})};
  const Markup svg = drawn(chart);
  EXPECT_EQ(svg.error, "");
  EXPECT_EQ(first_curve(svg).size(), 4U);
}

TEST(ChartAbuse, ExtremeValuesStillMakeAPicture) {
  for (const std::vector<double>& y : std::vector<std::vector<double>>{
           {1e280, -1e280}, {5.0, 5.0}, {0.0, 0.0}, {1e-308, 2e-308}, {1e15, 1e15 + 1.0}}) {
    const Chart chart{
        .title = "a", .x_label = "x", .y_label = "y", .curves = {line({0.0, 1.0}, y)}};
    const Markup svg = drawn(chart);
    EXPECT_EQ(svg.error, "");
    EXPECT_EQ(first_curve(svg).size(), 2U) << y[0];
  }
}

TEST(ChartAbuse, MarksAndGuidesOutsideAreLeftOut) {
  Chart chart{.title = "a", .x_label = "x", .y_label = "y", .curves = {line({0, 1}, {0, 1})}};
  chart.y_range = ValueRange{0.0, 1.0};
  chart.marks = {{Orientation::kHorizontal, 7.0, "far"}, {Orientation::kVertical, kNan, "never"}};
  const std::string texts = text_of(drawn(chart));
  EXPECT_EQ(texts.find("far"), std::string::npos);
  EXPECT_EQ(texts.find("never"), std::string::npos);
}

TEST(ChartAbuse, ManyCurvesKeepTheirNamesInTheLegendWithinThePicture) {
  Chart chart{.title = "a", .x_label = "x", .y_label = "y"};
  for (int i = 0; i < 30; ++i)
    chart.curves.push_back(
        {.name = std::string(100, 'n') + std::to_string(i), .x = {0, 1}, .y = {0.0, 1.0 * i}});
  const Markup svg = drawn(chart);
  const double height = pixels_of(svg.elements[0].attributes.at("viewBox")).at(1).y;
  int names = 0;
  for (const Element& text : svg.named("text")) {
    if (!text.attributes.contains("y")) continue;
    ++names;
    EXPECT_LT(std::stod(text.attributes.at("y")), height);
    EXPECT_GE(std::stod(text.attributes.at("x")), 0.0);
  }
  EXPECT_EQ(names, 30);
}

TEST(ChartValidation, NamesTheCurveAndWhatWouldBeRight) {
  Chart chart{.title = "T", .x_label = "", .y_label = "", .curves = {line({1, 2}, {1})}};
  EXPECT_EQ(validate(chart),
            "chart 'T': curve 'curve' has 1 values of y; as many as x, 2, would be right");
  EXPECT_THROW(static_cast<void>(svg_of(chart, "a-", "")), std::invalid_argument);
  chart.curves = {line({2, 1}, {1, 1})};
  chart.curves[0].lower = chart.curves[0].upper = {1, 1};
  EXPECT_EQ(validate(chart),
            "chart 'T': curve 'curve' has a band and x that descends; x must ascend then");
  chart.curves[0].upper.clear();
  EXPECT_EQ(validate(chart),
            "chart 'T': curve 'curve' has 0 values of upper; as many as x, 2, would be right");
  chart.curves.clear();
  chart.y_range = ValueRange{0.0, 1.0};
  EXPECT_EQ(validate(chart), std::nullopt);
  chart.y_scale = AxisScale::kLogarithmic;
  EXPECT_NE(validate(chart), std::nullopt);
  chart.y_range = ValueRange{1.0, kNan};
  EXPECT_NE(validate(chart), std::nullopt);
}

class ForeignGnuplot : public ScratchFolder {};

TEST_F(ForeignGnuplot, WhatIsNoWholeSvgIsRefused) {
  const Chart chart{.title = "a", .x_label = "x", .y_label = "y", .curves = {line({0, 1}, {0, 1})}};
  for (const char* output :
       {"hello", "<svg viewBox=\"0 0 1 1\"><g", "</svg><svg", "<svg></svg><"}) {
    make_executable(write("gnuplot", std::string{"#!/bin/sh\nprintf '%s' '"} + output + "'\n"));
    const OtherPath other{path("").string()};
    EXPECT_THROW(static_cast<void>(svg_of(chart, "a-", "")), ReportError) << output;
  }
}

}  // namespace
}  // namespace zerodrift::report
