// SPDX-License-Identifier: Apache-2.0
#include "common/evaluation/comparison_report.h"

#include <algorithm>
#include <cmath>

#include "common/allan/noise_units.h"
#include "common/core/not_known.h"
#include "common/core/units.h"
#include "common/evaluation/comparison_figures.h"
#include "common/evaluation/comparison_verdict.h"
#include "common/report/numbers.h"

namespace zerodrift::evaluation {
namespace {

using core::deg_h_from_radps;
using report::Align;
using report::significant;

constexpr int kDigits = 3;
using core::kNaN;

std::string deg_h(double radps) {
  return significant(deg_h_from_radps(radps), kDigits);
}

// "1.2e-3 [1.1, 1.3]e-3" is hard to read in a column: value, or "< upper" where only that is known.
std::string coefficient(const allan::Coefficient& c, double unit) {
  switch (c.identification) {
    case allan::Identification::kInterval: return report::scientific(unit * c.value, kDigits);
    case allan::Identification::kUpperBound:
      return "< " + report::scientific(unit * c.upper, kDigits);
    case allan::Identification::kNotFitted:
    case allan::Identification::kWithheld: break;
  }
  return "n/a";
}

std::vector<std::string> allan_cells(const comparison::StreamReport& stream) {
  using allan::NoiseTerm;
  return {
      coefficient(stream.coefficients[NoiseTerm::kAngleRandomWalk], allan::kDegPerRootHour),
      coefficient(stream.coefficients[NoiseTerm::kBiasInstability], b_unit()),
      coefficient(stream.coefficients[NoiseTerm::kRateRandomWalk], allan::kDegPerHourPerRootHour)};
}

// "60 s std"; of another length where a minute is no whole number of samples.
std::string means_title(const comparison::StreamReport& stream) {
  return significant(stream.block_s, 2) + " s std";
}

// Without a figure with the number of means that there are: "n/a (2)".
std::string means_cell(const comparison::StreamReport& stream) {
  const auto& minutes = stream.minute_means;
  const std::string figure = significant(deg_h_or_nothing(minutes), kDigits);
  return minutes.blocks < kFewestMinutes ? figure + " (" + std::to_string(minutes.blocks) + ")"
                                         : figure;
}

const SchemeOutcome* smallest_rmse(const ProtocolOutcome& protocol) {
  const SchemeOutcome* best = nullptr;
  for (const SchemeOutcome& scheme : protocol.schemes) {
    const double rmse = scheme.statistics.root_mean_square;
    if (std::isfinite(rmse) && (!best || rmse < best->statistics.root_mean_square)) best = &scheme;
  }
  return best;
}

report::Table protocol_table(const AxisComparison& axis, const ProtocolOutcome& protocol) {
  report::Table table;
  table.caption = axis_name(axis) + ", " + protocol.protocol.name + ": residual of " +
                  std::to_string(protocol.schemes.front().statistics.points) + " labels of " +
                  significant(label_s(axis), 2) + " s, deg/h";
  if (const auto age_s = age_behind_motion_s(axis, protocol.protocol))
    table.caption += "; the newest label known is " + significant(*age_s, 2) + " s old (median)";
  table.columns = {{"scheme", Align::kLeft},      {"mean", Align::kRight},
                   {"std", Align::kRight},        {"MAE", Align::kRight},
                   {"RMSE", Align::kRight},       {means_title(protocol.raw), Align::kRight},
                   {"95 % holds", Align::kRight}, {"N deg/√h", Align::kRight},
                   {"B deg/h", Align::kRight},    {"K deg/h^1.5", Align::kRight},
                   {"us/label", Align::kRight}};
  const SchemeOutcome* best = smallest_rmse(protocol);
  const auto add = [&](std::vector<std::string> cells, const comparison::StreamReport& stream,
                       std::string time, bool highlighted) {
    for (auto& cell : allan_cells(stream)) cells.push_back(std::move(cell));
    cells.push_back(std::move(time));
    table.rows.push_back({std::move(cells), highlighted});
  };
  if (find(protocol, kNothingTakenOff) == nullptr) {
    add({"before", "", "", "", "", means_cell(protocol.raw), ""}, protocol.raw, "", false);
  }
  const auto labels = static_cast<double>(axis.points.size());
  for (const SchemeOutcome& scheme : protocol.schemes) {
    const auto& s = scheme.statistics;
    add({scheme.name == kNothingTakenOff ? "none (before)" : scheme.name, deg_h(s.mean),
         deg_h(s.standard_deviation), deg_h(s.mean_absolute), deg_h(s.root_mean_square),
         means_cell(scheme.stream),
         std::isfinite(s.coverage) ? significant(100.0 * s.coverage, kDigits) + " %" : "n/a"},
        scheme.stream, significant(1e6 * scheme.seconds / labels, 2), &scheme == best);
  }
  return table;
}

// "" where before or after is not known.
std::string ratio(double before, double after) {
  return after > 0.0 && std::isfinite(before) ? significant(before / after, kDigits) : "n/a";
}

const PaperOutcome* find(const std::vector<PaperOutcome>& outcomes, std::string_view name) {
  const auto found = std::find_if(outcomes.begin(), outcomes.end(),
                                  [&](const PaperOutcome& o) { return o.name == name; });
  return found == outcomes.end() ? nullptr : &*found;
}

// How many times smaller online-svr leaves what the paper measured before.
std::string before_over_after(const AxisComparison& axis, bool beside_the_paper) {
  const PaperOutcome* before = find(axis.paper, kNothingTakenOff);
  const PaperOutcome* after = find(axis.paper, kPapers);
  if (!before || !after || !before->coefficients || !after->coefficients) return {};
  const auto& b = *before->coefficients;
  const auto& a = *after->coefficients;
  const auto compared = [&](const char* name, const std::string& ours, const char* papers) {
    return std::string(name) + " " + ours +
           (beside_the_paper ? std::string(" (paper ") + papers + ")" : "");
  };
  return "Before over after, " + std::string(kPapers) + ": " +
         compared("std",
                  ratio(before->moments.standard_deviation, after->moments.standard_deviation),
                  "51.6") +
         ", " + compared("B", ratio(b.bias_instability_radps, a.bias_instability_radps), "8.7") +
         ", " +
         compared("K", ratio(b.rate_random_walk_radps_rts, a.rate_random_walk_radps_rts), "2.9") +
         ".";
}

// The shipped model's axis x has the paper's statistics before compensation.
bool is_beside_the_paper(const AxisComparison& axis, const ComparisonResult& result) {
  return result.is_paper_like && axis.axis == core::Axis::kX;
}

report::Table paper_table(const AxisComparison& axis, const ComparisonResult& result) {
  report::Table table;
  table.caption = axis_name(axis) + ", " + std::string(kPaperProcedure) + ": residual of " +
                  std::to_string(axis.paper.front().residual_radps.size()) +
                  " points of a moving minute, one step ahead, deg/h";
  table.columns = {{"scheme", Align::kLeft},    {"mean", Align::kRight},
                   {"std", Align::kRight},      {"MAE", Align::kRight},
                   {"RMSE", Align::kRight},     {"N deg/√h", Align::kRight},
                   {"B deg/h", Align::kRight},  {"K deg/h^1.5", Align::kRight},
                   {"s in all", Align::kRight}, {"s/point", Align::kRight}};
  const bool beside = is_beside_the_paper(axis, result);
  for (const PaperOutcome& outcome : axis.paper) {
    const auto& m = outcome.moments;
    const auto& c = outcome.coefficients;
    const auto points = static_cast<double>(outcome.residual_radps.size());
    report::Row row;
    row.cells = {
        outcome.name == kNothingTakenOff ? "none (before)" : outcome.name,
        deg_h(m.mean),
        deg_h(m.standard_deviation),
        deg_h(m.mean_absolute_error),
        deg_h(m.root_mean_square),
        c ? report::scientific(c->angle_random_walk_rad_rts * allan::kDegPerRootHour, 3) : "n/a",
        c ? report::scientific(deg_h_from_radps(c->bias_instability_radps), 3) : "n/a",
        c ? report::scientific(c->rate_random_walk_radps_rts * allan::kDegPerHourPerRootHour, 3)
          : "n/a",
        significant(outcome.seconds, kDigits),
        report::scientific(outcome.seconds / points, 3)};
    table.rows.push_back(std::move(row));
    if (!beside) continue;
    for (const auto& printed : comparison::paper_figures()) {
      if (printed.scheme != outcome.name) continue;
      const auto cell = [](double value) {
        return std::isfinite(value) ? significant(value, 3) : std::string();
      };
      table.rows.push_back(
          {{"  the paper's", cell(printed.mean_deg_h), cell(printed.standard_deviation_deg_h),
            cell(printed.mean_absolute_deg_h), cell(printed.root_mean_square_deg_h),
            report::scientific(printed.angle_random_walk_deg_rth, 3),
            report::scientific(printed.bias_instability_deg_h, 3),
            report::scientific(printed.rate_random_walk_deg_h_rth, 3),
            cell(printed.seconds_a_point * 15'000.0), cell(printed.seconds_a_point)},
           false});
    }
  }
  table.footnote = before_over_after(axis, beside);
  return table;
}

report::Chart drift_chart(const AxisComparison& axis, const ProtocolOutcome& protocol,
                          bool residuals) {
  report::Chart chart;
  chart.title = (residuals ? "Residual, " : "Drift and what was predicted, ") + axis_name(axis) +
                ", " + protocol.protocol.name;
  chart.x_label = "time (h)";
  chart.y_label = residuals ? "label less prediction (deg/h)" : "drift (deg/h)";
  const auto hours = [](const comparison::LabelledPoint& point) {
    return core::seconds(point.end) / core::kSecondsPerHour;
  };
  if (!residuals) {
    report::Curve labels{.name = "label"};
    labels.colour = 0;
    for (const auto& point : axis.points) {
      labels.x.push_back(hours(point));
      labels.y.push_back(deg_h_from_radps(point.drift_radps));
    }
    chart.curves.push_back(std::move(labels));
  }
  for (const SchemeOutcome& scheme : protocol.schemes) {
    if (!is_drawn(protocol, scheme)) continue;
    report::Curve curve{.name = scheme.name};
    curve.colour = colour_of(scheme.name);
    for (std::size_t i = 0; i < axis.points.size(); ++i) {
      if (!scheme.predicted[i]) continue;
      const double predicted = scheme.predicted[i]->drift_radps;
      curve.x.push_back(hours(axis.points[i]));
      curve.y.push_back(
          deg_h_from_radps(residuals ? axis.points[i].drift_radps - predicted : predicted));
    }
    chart.curves.push_back(std::move(curve));
  }
  return chart;
}

report::Curve allan_curve(std::string name, const comparison::StreamReport& stream) {
  report::Curve curve{.name = std::move(name)};
  for (const auto& point : stream.allan) {
    curve.x.push_back(point.tau_s);
    curve.y.push_back(deg_h_from_radps(point.deviation_radps));
    curve.lower.push_back(deg_h_from_radps(point.lower_radps));
    curve.upper.push_back(deg_h_from_radps(point.upper_radps));
  }
  return curve;
}

report::Chart allan_chart(const AxisComparison& axis, const ProtocolOutcome& protocol) {
  report::Chart chart;
  chart.title = "Overlapping Allan deviation, " + axis_name(axis) + ", " + protocol.protocol.name;
  chart.x_label = "cluster time (s)";
  chart.y_label = "deviation (deg/h)";
  chart.x_scale = chart.y_scale = report::AxisScale::kLogarithmic;
  chart.curves.push_back(allan_curve("before", protocol.raw));
  for (const SchemeOutcome& scheme : protocol.schemes) {
    if (!is_drawn(protocol, scheme)) continue;
    chart.curves.push_back(allan_curve(scheme.name, scheme.stream));
    chart.curves.back().colour = colour_of(scheme.name);
  }
  return chart;
}

std::optional<report::Table> behind_table(const Standing& standing) {
  if (standing.behind.empty()) return std::nullopt;
  report::Table table;
  table.caption = "Where another scheme is better than the stack, deg/h";
  table.columns = {{"axis", Align::kLeft},        {"judged", Align::kLeft},
                   {"figure", Align::kLeft},      {"best scheme", Align::kLeft},
                   {"its figure", Align::kRight}, {"the stack's", Align::kRight},
                   {"times", Align::kRight}};
  for (const Behind& b : standing.behind) {
    table.rows.push_back({{b.axis, b.judged, b.figure, b.best.scheme,
                           (b.best.is_bound ? "< " : "") + deg_h(b.best.value), deg_h(b.ours),
                           significant(b.ours / b.best.value, kDigits)},
                          false});
  }
  return table;
}

// Said once for all tables.
std::vector<std::string> notes(const ComparisonResult& result) {
  std::vector<std::string> text{
      "Every label, a mean of the drift at rest, was predicted before it or anything later was "
      "learned. One ahead: labels are learned as they end. Delayed: only so long afterwards, as in "
      "a motion of that length. Frozen: nothing is learned from that time on.",
      "rbf and svr are trained once: on the labels before the first judged one, for the frozen "
      "judgement on all before it. *, or a marked row: smallest RMSE. 95 % holds: share of the "
      "judged labels within the interval stated for them, by stack and online-svr the one that the "
      "service sends out, by the others one that their own past errors make; n/a: none is stated. "
      "60 s std: of the means over a minute, of which four fifths of the samples are judged; over "
      "as many seconds as it says where a minute is no whole number of samples; of fewer than ten "
      "their number. N, B and K: of "
      "every sample of the judged labels less its prediction, fitted to the overlapping Allan "
      "deviation together with a ramp; <: not seen, "
      "and at 95 % confidence below. B is the floor within minutes and knows nothing of slow "
      "drift, so that of an uncompensated stream can be lower. us/label: to predict and to learn "
      "one "
      "label."};
  const bool paper = std::any_of(result.axes.begin(), result.axes.end(),
                                 [](const AxisComparison& axis) { return !axis.paper.empty(); });
  if (paper) {
    text.emplace_back(
        "The paper's procedure is shown for comparison with the paper only: neighbouring points "
        "share nearly all their samples, so persistence does well; rbf and svr are trained on "
        "every "
        "25th point of the series that they are judged on; N, B and K of a smoothed series "
        "describe "
        "its drift more than the gyro's noise. Seconds are from the temperature rate to the "
        "compensated output, on this machine and on the paper's.");
  }
  return text;
}

// The page is narrower than a terminal: the columns of a protocol's table in two.
report::Table without_columns(report::Table table, std::size_t first, std::size_t count) {
  const auto cut = [&](auto& all) {
    const auto begin = all.begin() + static_cast<std::ptrdiff_t>(first);
    all.erase(begin, begin + static_cast<std::ptrdiff_t>(count));
  };
  cut(table.columns);
  for (report::Row& row : table.rows) cut(row.cells);
  return table;
}

std::string with_interval(const allan::Coefficient& c, double unit) {
  if (c.identification != allan::Identification::kInterval) return coefficient(c, unit);
  return coefficient(c, unit) + " (" + report::scientific(unit * c.lower, 2) + " to " +
         report::scientific(unit * c.upper, 2) + ")";
}

report::Table noise_table(const AxisComparison& axis, const ProtocolOutcome& protocol) {
  using allan::NoiseTerm;
  report::Table table;
  table.caption = axis_name(axis) + ", " + protocol.protocol.name +
                  ": noise of the compensated stream, with 95 % intervals";
  table.columns = {{"scheme", Align::kLeft},
                   {"N deg/√h", Align::kRight},
                   {"B deg/h", Align::kRight},
                   {"K deg/h^1.5", Align::kRight}};
  const auto add = [&](const std::string& name, const comparison::StreamReport& stream) {
    const auto& c = stream.coefficients;
    table.rows.push_back(
        {{name, with_interval(c[NoiseTerm::kAngleRandomWalk], allan::kDegPerRootHour),
          with_interval(c[NoiseTerm::kBiasInstability], b_unit()),
          with_interval(c[NoiseTerm::kRateRandomWalk], allan::kDegPerHourPerRootHour)},
         false});
  };
  add("before", protocol.raw);
  for (const SchemeOutcome& scheme : protocol.schemes) {
    if (scheme.name != kNothingTakenOff) add(scheme.name, scheme.stream);
  }
  return table;
}

// As the paper's table 2.
report::Table time_table(const AxisComparison& axis, bool beside_the_paper) {
  report::Table table;
  table.caption = axis_name(axis) + ", " + std::string(kPaperProcedure) +
                  ": time from temperature rate to compensated output";
  table.columns = {{"scheme", Align::kLeft},
                   {"points", Align::kRight},
                   {"s in all", Align::kRight},
                   {"s/point", Align::kRight}};
  if (beside_the_paper) {
    table.columns.push_back({"paper: s in all", Align::kRight});
    table.columns.push_back({"paper: s/point", Align::kRight});
  }
  for (const PaperOutcome& outcome : axis.paper) {
    const std::size_t points = outcome.residual_radps.size();
    report::Row row{{outcome.name, std::to_string(points), significant(outcome.seconds, kDigits),
                     report::scientific(outcome.seconds / static_cast<double>(points), kDigits)}};
    if (beside_the_paper) {
      double printed_s = kNaN;
      for (const auto& printed : comparison::paper_figures()) {
        if (printed.scheme == outcome.name) printed_s = printed.seconds_a_point;
      }
      const bool known = std::isfinite(printed_s);
      row.cells.push_back(known ? significant(printed_s * 15'000.0, kDigits) : "");
      row.cells.push_back(known ? report::scientific(printed_s, kDigits) : "");
    }
    table.rows.push_back(std::move(row));
  }
  return table;
}

void add_tables(report::Document& page, const AxisComparison& axis,
                const ComparisonResult& result) {
  constexpr std::size_t kFirstNoiseColumn = 7;
  for (const ProtocolOutcome& protocol : axis.protocols) {
    page.blocks.emplace_back(report::Subheading{protocol.protocol.name});
    page.blocks.emplace_back(without_columns(protocol_table(axis, protocol), kFirstNoiseColumn, 3));
    page.blocks.emplace_back(noise_table(axis, protocol));
  }
  if (axis.paper.empty()) return;
  constexpr std::size_t kFirstTimeColumn = 8;
  page.blocks.emplace_back(report::Subheading{std::string(kPaperProcedure)});
  page.blocks.emplace_back(without_columns(paper_table(axis, result), kFirstTimeColumn, 2));
  page.blocks.emplace_back(time_table(axis, is_beside_the_paper(axis, result)));
}

// The pictures of one axis: the hardest horizon, and the Allan curves of the easiest and of the
// unseen leg.
void add_figures(report::Document& page, const AxisComparison& axis) {
  const ProtocolOutcome* latest = &axis.protocols.front();
  for (const ProtocolOutcome& protocol : axis.protocols) {
    if (protocol.protocol.delay_s > latest->protocol.delay_s) latest = &protocol;
  }
  const ProtocolOutcome& last = axis.protocols.back();
  page.blocks.emplace_back(report::Figure{
      drift_chart(axis, *latest, false),
      "Labels as measured, and what was predicted for them with the newest label so old."});
  page.blocks.emplace_back(
      report::Figure{drift_chart(axis, *latest, true), "What each scheme leaves of the labels."});
  if (is_frozen(last.protocol)) {
    page.blocks.emplace_back(
        report::Figure{drift_chart(axis, last, true), "What each scheme leaves of the last leg."});
  }
  const char* caption =
      "Of every sample of the judged labels less its prediction, with 95 % confidence bands.";
  page.blocks.emplace_back(report::Figure{allan_chart(axis, axis.protocols.front()), caption});
  if (&last != &axis.protocols.front())
    page.blocks.emplace_back(report::Figure{allan_chart(axis, last), caption});
}

}  // namespace

std::vector<report::Table> comparison_tables(const ComparisonResult& result) {
  std::vector<report::Table> tables;
  for (const AxisComparison& axis : result.axes) {
    for (const ProtocolOutcome& protocol : axis.protocols)
      tables.push_back(protocol_table(axis, protocol));
    if (!axis.paper.empty()) tables.push_back(paper_table(axis, result));
  }
  if (auto behind = behind_table(standing_of(result))) tables.push_back(std::move(*behind));
  return tables;
}

report::Document comparison_page(const ComparisonResult& result) {
  const Standing standing = standing_of(result);
  report::Document page;
  page.title = "Compensation schemes compared";
  page.subtitle = result.record;
  page.doubts = measurement::lines_of(result.doubts);
  page.verdict = recommendation(result);
  if (result.no_model.empty()) page.verdict += " " + verdict(result, standing);
  if (auto behind = behind_table(standing)) page.blocks.emplace_back(std::move(*behind));
  page.blocks.emplace_back(report::Heading{"How to read this"});
  for (std::string& note : notes(result))
    page.blocks.emplace_back(report::Paragraph{std::move(note)});
  for (const std::string& warning : result.warnings)
    page.blocks.emplace_back(report::Paragraph{"Note: " + warning + "."});
  for (const AxisComparison& axis : result.axes) {
    page.blocks.emplace_back(report::Heading{"Axis " + std::string(core::name(axis.axis))});
    add_figures(page, axis);
    add_tables(page, axis, result);
  }
  return page;
}

std::vector<std::string> comparison_notes(const ComparisonResult& result) {
  std::vector<std::string> text = notes(result);
  text.push_back(verdict(result, standing_of(result)));
  return text;
}

}  // namespace zerodrift::evaluation
