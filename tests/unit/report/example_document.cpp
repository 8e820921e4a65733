// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/report/example_document.h"

#include <cmath>
#include <cstdint>

#include "common/report/numbers.h"

namespace zerodrift::report {
namespace {

// Knuth's MMIX generator; -1 to 1.
class Uniform {
 public:
  double next() {
    state_ = state_ * 6364136223846793005U + 1442695040888963407U;
    return static_cast<double>(state_ >> 11U) * 0x1p-52 - 1.0;
  }

 private:
  std::uint64_t state_ = 17;
};

Curve allan_curve(const std::string& name, double n, double b, double k) {
  Curve curve{.name = name};
  for (int i = 0; i <= 76; ++i) {
    const double tau_s = 0.005 * std::pow(2.0, i / 4.0);
    const double sigma =
        std::sqrt(n * n / tau_s + 0.441 * b * b + k * k * tau_s / 3.0);  // allan.md's model
    const double freedom = std::max(1.2, 18000.0 / tau_s);
    const double width = std::min(0.9, 1.4 / std::sqrt(freedom));
    curve.x.push_back(tau_s);
    curve.y.push_back(sigma);
    curve.lower.push_back(sigma * (1.0 - width));
    curve.upper.push_back(sigma * (1.0 + 1.6 * width));
  }
  return curve;
}

Curve guide(const std::string& name, double slope, double at_one) {
  return {.name = name,
          .x = {1e-3, 1e5},
          .y = {at_one * std::pow(1e-3, slope), at_one * std::pow(1e5, slope)},
          .style = CurveStyle::kGuide};
}

}  // namespace

Chart allan_chart() {
  Chart chart{.title = "Overlapping Allan deviation, axis z",
              .x_label = "cluster time τ (s)",
              .y_label = "σ(τ) (deg/h)",
              .x_scale = AxisScale::kLogarithmic,
              .y_scale = AxisScale::kLogarithmic};
  chart.curves.push_back(allan_curve("raw", 0.06, 0.01, 0.003));
  chart.curves.push_back(allan_curve("compensated (online SVR)", 0.06, 0.008, 0.0004));
  chart.curves.push_back(guide("slope −1/2", -0.5, 0.06));
  chart.curves.push_back(guide("slope +1/2", 0.5, 0.0017));
  chart.curves.push_back({.name = "N = 1.00e-3 deg/√h, read at 1 s",
                          .x = {1.0},
                          .y = {0.0605},
                          .style = CurveStyle::kPoints});
  chart.marks.push_back({Orientation::kHorizontal, 0.01, "limit 0.01 deg/h"});
  return chart;
}

Chart drift_chart(std::size_t samples) {
  Chart chart{.title = "Drift before and after compensation",
              .x_label = "time (h)",
              .y_label = "rate at rest (deg/h)"};
  Curve raw{.name = "raw"};
  Curve compensated{.name = "compensated (online SVR)"};
  Curve model{.name = "drift that was applied"};
  Uniform noise;
  for (std::size_t i = 0; i < samples; ++i) {
    const double t_h = 5.0 * static_cast<double>(i) / static_cast<double>(samples);
    const double drift = 0.4 * std::exp(-t_h) * std::sin(1.5 * t_h) + 0.02 * t_h;
    const double white = 0.03 * (noise.next() + noise.next() + noise.next());
    raw.x.push_back(t_h);
    raw.y.push_back(drift + white + (i == samples / 3 ? 0.6 : 0.0));
    model.x.push_back(t_h);
    model.y.push_back(drift);
    compensated.x.push_back(t_h);
    const bool missing = t_h > 3.2 && t_h < 3.4;
    compensated.y.push_back(missing ? std::nan("") : white * 0.6 - 0.25);
  }
  chart.curves = {std::move(raw), std::move(compensated), std::move(model)};
  chart.marks = {{Orientation::kVertical, 1.0, "learning ends"},
                 {Orientation::kVertical, 3.2, "gap"},
                 {Orientation::kVertical, 3.4, "record resumes"}};
  return chart;
}

Document example_document() {
  Document document{
      .title = "Comparison of compensation schemes",
      .subtitle = "Record static_5h.csv, 200 Hz, 5.0 h, axes x y z",
      .verdict =
          "Online SVR leaves the smallest drift on all three axes; on axis z its bias "
          "instability is 5.1 times smaller than without compensation."};
  document.blocks.push_back(Heading{"Result"});
  document.blocks.push_back(
      Paragraph{"Each scheme learns on the first hour and is judged on the remaining four, which "
                "took no part in learning.",
                "Blocks of 60 s at both sides of the cut are left out."});
  Table table{.caption = "Drift that remains, 60 s means, axis z",
              .columns = {{"scheme", Align::kLeft},
                          {"RMSE (deg/h)"},
                          {"N (deg/√h)"},
                          {"B (deg/h)"},
                          {"time per sample (µs)"}},
              .rows = {},
              .footnote = "B is the smallest deviation divided by 0.664."};
  int row = 0;
  for (const char* scheme : {"none", "persistence", "polynomial", "rbf", "svr", "online-svr"}) {
    const double part = std::pow(0.7, row);
    table.rows.push_back({{scheme, significant(0.217 * part, 3), scientific(9.33e-4, 3),
                           significant(0.0157 * part, 3), significant(0.02 + 1.7 * row, 3)},
                          row == 5});
    ++row;
  }
  document.blocks.push_back(table);
  document.blocks.push_back(Figure{drift_chart(200'000),
                                   "Means are shifted by 0.25 deg/h so that the curves can be told "
                                   "apart."});
  document.blocks.push_back(Heading{"Noise"});
  document.blocks.push_back(Subheading{"Allan deviation"});
  document.blocks.push_back(Figure{
      allan_chart(), "Shaded: 95 % confidence. Compensation does not touch angle random walk.",
      "Long cluster times reach up to twice their length before the window."});
  return document;
}

}  // namespace zerodrift::report
