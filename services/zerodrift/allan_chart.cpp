// SPDX-License-Identifier: Apache-2.0
#include "services/zerodrift/allan_chart.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/core/units.h"
#include "common/report/numbers.h"
#include "services/zerodrift/allan_units.h"

namespace zerodrift::services {
namespace {

using allan::Coefficient;
using allan::Identification;
using allan::NoiseTerm;
using core::deg_h_from_radps;
using report::significant;

// A mark further below the curve would squeeze it: 1.5 decades.
constexpr double kLowestMark = 0.03;

report::Chart log_chart(std::string title) {
  report::Chart chart;
  chart.title = std::move(title);
  chart.x_label = "cluster time (s)";
  chart.y_label = "deviation (deg/h)";
  chart.x_scale = chart.y_scale = report::AxisScale::kLogarithmic;
  return chart;
}

report::Curve deviation_curve(std::string name, const std::vector<allan::GappedPoint>& points) {
  report::Curve curve{.name = std::move(name)};
  for (const auto& [point, rule] : points) {
    curve.x.push_back(point.tau_s);
    curve.y.push_back(deg_h_from_radps(point.deviation_radps));
    curve.lower.push_back(deg_h_from_radps(point.lower_radps));
    curve.upper.push_back(deg_h_from_radps(point.upper_radps));
  }
  return curve;
}

std::string axis_title(const char* what, core::Axis axis) {
  return std::string(what) + ", axis " + std::string(core::name(axis));
}

// Slope of the term's line in a log-log picture.
double slope_of(NoiseTerm term) {
  constexpr allan::PerNoiseTerm<double> kSlopes{-1.0, -0.5, 0.0, 0.5, 1.0};
  return kSlopes[allan::index(term)];
}

struct Place {
  double tau_s = 0.0;
  double deviation_radps = 0.0;
};

// Where a coefficient is read: on the term's own line, at its reading point.
Place reading_of(NoiseTerm term, double coefficient, const allan::SeriesReport& r) {
  constexpr allan::PerNoiseTerm<double> kTauS{std::numbers::sqrt3, 1.0, 0.0, 3.0,
                                              std::numbers::sqrt2};
  const double tau_s =
      term == NoiseTerm::kBiasInstability ? r.lowest->tau_s : kTauS[allan::index(term)];
  return {tau_s, coefficient * std::sqrt(allan::unit_variance(term, tau_s))};
}

std::string mark_name(NoiseTerm term, const std::string& value, const Place& place,
                      const char* how) {
  return std::string(allan::symbol(term)) + " " + value + " " + std::string(texts_of(term).unit) +
         " at " + significant(place.tau_s, 3) + " s" + how;
}

struct MarkedTerm {
  NoiseTerm term = NoiseTerm::kAngleRandomWalk;
  std::string name;
  Place place;
};

std::optional<MarkedTerm> marked(NoiseTerm term, const allan::SeriesReport& r) {
  if (!r.lowest) return std::nullopt;
  const double per_si = texts_of(term).per_si;
  const Coefficient& c = r.coefficients[term];
  const auto at = [&](double value, const std::string& prefix, const char* how) {
    const Place place = reading_of(term, value, r);
    return MarkedTerm{term, mark_name(term, prefix + significant(per_si * value, 3), place, how),
                      place};
  };
  switch (c.identification) {
    case Identification::kInterval: return at(c.value, "", "");
    case Identification::kUpperBound: return at(c.upper, "< ", "");
    case Identification::kNotFitted:
    case Identification::kWithheld: break;
  }
  if (const auto& slope = r.slopes[allan::index(term)]) return at(*slope, "~ ", ", off the slope");
  return std::nullopt;
}

// Where a line whose term is not known touches the curve: falling ones at its begin, rising ones at
// its end.
Place anchor_of(NoiseTerm term, const allan::SeriesReport& r) {
  if (slope_of(term) == 0.0 && r.lowest) return {r.lowest->tau_s, r.lowest->deviation_radps};
  const allan::AllanPoint& p = slope_of(term) < 0.0 ? r.allan.front().point : r.allan.back().point;
  return {p.tau_s, p.deviation_radps};
}

report::Curve guide(const std::string& name, double slope, const Place& through, double from_s,
                    double to_s) {
  report::Curve line{.name = name, .style = report::CurveStyle::kGuide};
  for (const double tau_s : {from_s, to_s}) {
    line.x.push_back(tau_s);
    line.y.push_back(
        deg_h_from_radps(through.deviation_radps * std::pow(tau_s / through.tau_s, slope)));
  }
  return line;
}

// The model that was fitted, at the taus of the points.
std::optional<report::Curve> model_curve(const allan::SeriesReport& r) {
  const allan::FitStatus status = r.coefficients.status;
  if (status == allan::FitStatus::kTooFewPoints || status == allan::FitStatus::kUnexplained)
    return std::nullopt;
  report::Curve curve{.name = "fitted model"};
  for (const auto& [point, rule] : r.allan) {
    curve.x.push_back(point.tau_s);
    curve.y.push_back(
        deg_h_from_radps(std::sqrt(allan::model_variance(r.coefficients, point.tau_s))));
  }
  return curve;
}

// All of the curve and its band, and the marks that are not far below it.
report::ValueRange range_of(const allan::SeriesReport& r, const std::vector<MarkedTerm>& marks) {
  report::ValueRange range{.low = r.allan.front().point.deviation_radps, .high = 0.0};
  for (const auto& [p, rule] : r.allan) {
    range.low = std::min(range.low, p.deviation_radps);
    range.high = std::max(
        {range.high, p.deviation_radps, std::min(p.upper_radps, 10.0 * p.deviation_radps)});
  }
  const double lowest = kLowestMark * range.low;
  range.low *= 0.5;
  for (const MarkedTerm& mark : marks) {
    if (mark.place.deviation_radps > lowest)
      range.low = std::min(range.low, 0.7 * mark.place.deviation_radps);
    range.high = std::max(range.high, mark.place.deviation_radps);
  }
  return {.low = deg_h_from_radps(range.low), .high = deg_h_from_radps(1.3 * range.high)};
}

}  // namespace

report::Chart noise_chart(const AllanStream& stream, const AllanResult& result) {
  const allan::SeriesReport& r = stream.report;
  const bool less_reference = result.less_reference[core::index(stream.axis)];
  report::Chart chart = log_chart(axis_title(less_reference ? "Allan deviation of rate - reference"
                                                            : "Allan deviation of the rate",
                                             stream.axis) +
                                  ", " + std::string(name(stream.kind)));
  chart.curves.push_back(deviation_curve("overlapping Allan deviation", r.allan));
  if (auto model = model_curve(r)) chart.curves.push_back(std::move(*model));
  std::vector<MarkedTerm> marks;
  for (const NoiseTerm term : allan::kNoiseTerms) {
    const auto mark = marked(term, r);
    const Place through = mark ? mark->place : anchor_of(term, r);
    chart.curves.push_back(
        guide(term == allan::kNoiseTerms.front() ? "slopes -1, -½, 0, +½, +1" : "", slope_of(term),
              through, r.allan.front().point.tau_s, r.allan.back().point.tau_s));
    if (mark) marks.push_back(*mark);
  }
  chart.y_range = range_of(r, marks);
  for (const MarkedTerm& mark : marks) {
    chart.curves.push_back({.name = mark.name,
                            .x = {mark.place.tau_s},
                            .y = {deg_h_from_radps(mark.place.deviation_radps)},
                            .style = report::CurveStyle::kPoints});
  }
  return chart;
}

std::string noise_caption(double confidence) {
  return "Deviation with its " + significant(100.0 * confidence, 2) +
         " % confidence band and the fitted model. Dashed: the line of each term, through its mark "
         "or, where nothing is known of it, through an end of the curve. Marks stand where a "
         "coefficient is read off its line: Q at √3 s, N at 1 s, B (0.664 of it) at the lowest "
         "point, K at 3 s, R at √2 s; <: an upper bound.";
}

report::Chart beside_chart(core::Axis axis, const AllanResult& result) {
  report::Chart chart = log_chart(axis_title("Allan deviation, raw and compensated", axis));
  for (const AllanStream& stream : result.streams) {
    if (stream.axis == axis)
      chart.curves.push_back(deviation_curve(std::string(name(stream.kind)), stream.report.allan));
  }
  return chart;
}

std::optional<report::Chart> statistics_chart(const AllanStream& stream) {
  report::Chart chart =
      log_chart(axis_title("Statistics", stream.axis) + ", " + std::string(name(stream.kind)));
  for (const auto& statistic : stream.report.curves) {
    if (statistic.statistic == allan::Statistic::kTdev) continue;
    report::Curve curve{.name = std::string(allan::name(statistic.statistic))};
    for (const auto& p : statistic.points) {
      curve.x.push_back(p.tau_s);
      curve.y.push_back(deg_h_from_radps(p.deviation));
      curve.lower.push_back(deg_h_from_radps(p.lower));
      curve.upper.push_back(deg_h_from_radps(p.upper));
    }
    chart.curves.push_back(std::move(curve));
  }
  if (chart.curves.size() < 2) return std::nullopt;
  return chart;
}

}  // namespace zerodrift::services
