// SPDX-License-Identifier: Apache-2.0
#include "services/zerodrift/comparison_report.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/allan/noise_units.h"
#include "common/core/units.h"
#include "common/report/numbers.h"

namespace zerodrift::services {
namespace {

using core::deg_h_from_radps;
using report::Align;
using report::significant;

constexpr int kDigits = 3;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
// Curves of the pictures: a reader tells so many apart.
constexpr std::array<std::string_view, 3> kDrawn{"persistence", "polynomial", "online-svr"};

bool is_drawn(const std::string& name) {
  return std::find(kDrawn.begin(), kDrawn.end(), name) != kDrawn.end();
}

std::string deg_h(double radps) {
  return significant(deg_h_from_radps(radps), kDigits);
}

std::string axis_name(const AxisComparison& axis) {
  return "axis " + std::string(core::name(axis.axis));
}

// "1.2e-3 [1.1, 1.3]e-3" is hard to read in a column: value, or "< upper" where only that is known.
std::string coefficient(const allan::Coefficient& c, double unit) {
  switch (c.identification) {
    case allan::Identification::kInterval:
      return report::scientific(unit * c.value, kDigits);
    case allan::Identification::kUpperBound:
      return "< " + report::scientific(unit * c.upper, kDigits);
    case allan::Identification::kNotFitted:
      break;
  }
  return "n/a";
}

double b_unit() {
  return 1.0 / core::kRadPerSecPerDegPerHour;
}

std::vector<std::string> allan_cells(const comparison::StreamReport& stream) {
  using allan::NoiseTerm;
  return {
      coefficient(stream.coefficients[NoiseTerm::kAngleRandomWalk], allan::kDegPerRootHour),
      coefficient(stream.coefficients[NoiseTerm::kBiasInstability], b_unit()),
      coefficient(stream.coefficients[NoiseTerm::kRateRandomWalk], allan::kDegPerHourPerRootHour)};
}

// The scheme of a protocol with the smallest value.
template <typename Value>
const SchemeOutcome* best_of(const ProtocolOutcome& protocol, Value&& value) {
  const auto found = std::min_element(
      protocol.schemes.begin(), protocol.schemes.end(),
      [&](const SchemeOutcome& a, const SchemeOutcome& b) { return value(a) < value(b); });
  return found == protocol.schemes.end() ? nullptr : &*found;
}

report::Table protocol_table(const AxisComparison& axis, const ProtocolOutcome& protocol,
                             const ComparisonResult& result) {
  report::Table table;
  table.caption = axis_name(axis) + ", " + protocol.protocol.name + ": residual of " +
                  std::to_string(protocol.schemes.front().statistics.points) + " labels of " +
                  significant(result.label_s, 2) + " s";
  table.columns = {
      {"scheme", Align::kLeft},      {"mean", Align::kRight},    {"std", Align::kRight},
      {"MAE", Align::kRight},        {"RMSE", Align::kRight},    {"60 s std", Align::kRight},
      {"95 % holds", Align::kRight}, {"N", Align::kRight},       {"B", Align::kRight},
      {"K", Align::kRight},          {"us/label", Align::kRight}};
  const SchemeOutcome* best =
      best_of(protocol, [](const SchemeOutcome& s) { return s.statistics.root_mean_square; });
  const auto add = [&](const std::string& name, const comparison::ResidualStatistics* s,
                       const comparison::StreamReport& stream, double seconds, bool highlighted) {
    report::Row row;
    row.cells = {
        name,
        s ? deg_h(s->mean) : "",
        s ? deg_h(s->standard_deviation) : "",
        s ? deg_h(s->mean_absolute) : "",
        s ? deg_h(s->root_mean_square) : "",
        deg_h(stream.minute_means.standard_deviation),
        s && std::isfinite(s->coverage) ? significant(100.0 * s->coverage, kDigits) + " %" : ""};
    for (auto& cell : allan_cells(stream)) row.cells.push_back(std::move(cell));
    row.cells.push_back(seconds > 0.0 ? significant(1e6 * seconds, 2) : "");
    row.highlighted = highlighted;
    table.rows.push_back(std::move(row));
  };
  add("raw", nullptr, protocol.raw, 0.0, false);
  for (const SchemeOutcome& scheme : protocol.schemes)
    add(scheme.name, &scheme.statistics, scheme.stream, scheme.seconds_a_point, &scheme == best);
  table.footnote =
      "deg/h; N deg/sqrt(h), B deg/h, K deg/h^1.5 of the unsmoothed stream, fitted with a ramp. "
      "Highlighted: smallest RMSE.";
  return table;
}

report::Table paper_table(const AxisComparison& axis, const ComparisonResult& result) {
  report::Table table;
  table.caption = axis_name(axis) + ", the paper's procedure: " +
                  std::to_string(axis.paper.front().residual_radps.size()) +
                  " points of a moving minute, one step ahead";
  table.columns = {{"scheme", Align::kLeft},  {"mean", Align::kRight}, {"std", Align::kRight},
                   {"MAE", Align::kRight},    {"RMSE", Align::kRight}, {"N", Align::kRight},
                   {"B", Align::kRight},      {"K", Align::kRight},    {"s in all", Align::kRight},
                   {"s/point", Align::kRight}};
  const bool beside = result.is_paper_like && axis.axis == core::Axis::kX;
  for (const PaperOutcome& outcome : axis.paper) {
    const auto& m = outcome.moments;
    const auto& c = outcome.coefficients;
    const auto points = static_cast<double>(outcome.residual_radps.size());
    report::Row row;
    row.cells = {
        outcome.name,
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
  table.footnote =
      "Neighbouring points share nearly all their samples: compare with persistence. rbf and svr "
      "were trained on every 25th point of the same series. Times are this machine's, the paper's "
      "its own.";
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
    report::Curve labels{.name = "label", .style = report::CurveStyle::kPoints};
    for (const auto& point : axis.points) {
      labels.x.push_back(hours(point));
      labels.y.push_back(deg_h_from_radps(point.drift_radps));
    }
    chart.curves.push_back(std::move(labels));
  }
  for (const SchemeOutcome& scheme : protocol.schemes) {
    if (!is_drawn(scheme.name)) continue;
    report::Curve curve{.name = scheme.name};
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
  chart.curves.push_back(allan_curve("raw", protocol.raw));
  for (const SchemeOutcome& scheme : protocol.schemes) {
    if (is_drawn(scheme.name)) chart.curves.push_back(allan_curve(scheme.name, scheme.stream));
  }
  return chart;
}

const SchemeOutcome* find(const ProtocolOutcome& protocol, std::string_view name) {
  const auto found = std::find_if(protocol.schemes.begin(), protocol.schemes.end(),
                                  [&](const SchemeOutcome& s) { return s.name == name; });
  return found == protocol.schemes.end() ? nullptr : &*found;
}

// Where online-svr stands: for each axis and protocol against the best of the others.
std::string verdict(const ComparisonResult& result) {
  std::size_t cases = 0;
  std::size_t best = 0;
  std::string behind;
  for (const AxisComparison& axis : result.axes) {
    for (const ProtocolOutcome& protocol : axis.protocols) {
      const SchemeOutcome* ours = find(protocol, "online-svr");
      const SchemeOutcome* least =
          best_of(protocol, [](const SchemeOutcome& s) { return s.statistics.root_mean_square; });
      if (ours == nullptr || protocol.schemes.size() < 2) continue;
      ++cases;
      if (least == ours) {
        ++best;
        continue;
      }
      behind += (behind.empty() ? "" : "; ") + axis_name(axis) + " " + protocol.protocol.name +
                ": " + least->name + " leaves " + deg_h(least->statistics.root_mean_square) +
                ", online-svr " + deg_h(ours->statistics.root_mean_square) + " deg/h";
    }
  }
  if (cases == 0) return "Statistics of the chosen schemes.";
  std::string text = "online-svr leaves the smallest RMSE in " + std::to_string(best) + " of " +
                     std::to_string(cases) + " comparisons of axis and protocol.";
  if (!behind.empty()) text += " Not so: " + behind + ".";
  return text;
}

nlohmann::ordered_json json_of(const comparison::StreamReport& stream) {
  using allan::NoiseTerm;
  nlohmann::ordered_json json;
  json["std_60s_deg_h"] = deg_h_from_radps(stream.minute_means.standard_deviation);
  const auto add = [&](const char* key, NoiseTerm term, double unit) {
    const auto& c = stream.coefficients[term];
    const bool known = c.identification == allan::Identification::kInterval;
    json[key] = {{"value", known ? unit * c.value : kNaN},
                 {"lower", known ? unit * c.lower : 0.0},
                 {"upper", unit * c.upper}};
  };
  add("angle_random_walk_deg_rth", NoiseTerm::kAngleRandomWalk, allan::kDegPerRootHour);
  add("bias_instability_deg_h", NoiseTerm::kBiasInstability, b_unit());
  add("rate_random_walk_deg_h_rth", NoiseTerm::kRateRandomWalk, allan::kDegPerHourPerRootHour);
  auto& allan = json["allan"] = nlohmann::ordered_json::array();
  for (const auto& point : stream.allan) {
    allan.push_back({{"tau_s", point.tau_s},
                     {"deviation_deg_h", deg_h_from_radps(point.deviation_radps)},
                     {"lower_deg_h", deg_h_from_radps(point.lower_radps)},
                     {"upper_deg_h", deg_h_from_radps(point.upper_radps)}});
  }
  return json;
}

nlohmann::ordered_json json_of(const SchemeOutcome& scheme) {
  const auto& s = scheme.statistics;
  nlohmann::ordered_json json{{"points", s.points},
                              {"mean_deg_h", deg_h_from_radps(s.mean)},
                              {"std_deg_h", deg_h_from_radps(s.standard_deviation)},
                              {"mae_deg_h", deg_h_from_radps(s.mean_absolute)},
                              {"rmse_deg_h", deg_h_from_radps(s.root_mean_square)},
                              {"coverage_95", s.coverage},
                              {"seconds_per_label", scheme.seconds_a_point}};
  json.update(json_of(scheme.stream));
  return json;
}

nlohmann::ordered_json json_of(const PaperOutcome& outcome) {
  const auto& c = outcome.coefficients;
  return {{"points", outcome.residual_radps.size()},
          {"mean_deg_h", deg_h_from_radps(outcome.moments.mean)},
          {"std_deg_h", deg_h_from_radps(outcome.moments.standard_deviation)},
          {"mae_deg_h", deg_h_from_radps(outcome.moments.mean_absolute_error)},
          {"rmse_deg_h", deg_h_from_radps(outcome.moments.root_mean_square)},
          {"angle_random_walk_deg_rth",
           c ? c->angle_random_walk_rad_rts * allan::kDegPerRootHour : kNaN},
          {"bias_instability_deg_h", c ? deg_h_from_radps(c->bias_instability_radps) : kNaN},
          {"rate_random_walk_deg_h_rth",
           c ? c->rate_random_walk_radps_rts * allan::kDegPerHourPerRootHour : kNaN},
          {"seconds", outcome.seconds}};
}

}  // namespace

std::vector<report::Table> comparison_tables(const AxisComparison& axis,
                                             const ComparisonResult& result) {
  std::vector<report::Table> tables;
  for (const ProtocolOutcome& protocol : axis.protocols)
    tables.push_back(protocol_table(axis, protocol, result));
  if (!axis.paper.empty()) tables.push_back(paper_table(axis, result));
  return tables;
}

report::Document comparison_page(const ComparisonResult& result) {
  report::Document page;
  page.title = "Compensation schemes compared";
  page.subtitle = result.record;
  page.verdict = verdict(result);
  page.blocks.emplace_back(report::Paragraph{
      "Every label, a mean of the drift at rest, was predicted before it or anything later was "
      "learned. One ahead: labels are learned as they end. Delayed: only so long afterwards, as "
      "in a motion of that length. Frozen: nothing is learned from that time on. The first " +
      std::to_string(result.initial_labels) +
      " labels train rbf and svr and are not judged; for the frozen judgement they are trained on "
      "all labels before it. 95 % holds: the share of labels within the interval stated for "
      "them."});
  for (const AxisComparison& axis : result.axes) {
    page.blocks.emplace_back(report::Heading{"Axis " + std::string(core::name(axis.axis))});
    for (const ProtocolOutcome& protocol : axis.protocols) {
      page.blocks.emplace_back(report::Subheading{protocol.protocol.name});
      page.blocks.emplace_back(protocol_table(axis, protocol, result));
      page.blocks.emplace_back(
          report::Figure{drift_chart(axis, protocol, false), "Drift and predictions."});
      page.blocks.emplace_back(
          report::Figure{drift_chart(axis, protocol, true), "What each scheme leaves."});
      page.blocks.emplace_back(report::Figure{
          allan_chart(axis, protocol),
          "Of the unsmoothed stream over the judged labels, with 95 % confidence bands."});
    }
    if (axis.paper.empty()) continue;
    page.blocks.emplace_back(report::Subheading{"the paper's procedure"});
    page.blocks.emplace_back(paper_table(axis, result));
  }
  return page;
}

nlohmann::ordered_json comparison_json(const ComparisonResult& result) {
  nlohmann::ordered_json json{{"record", result.record},
                              {"label_s", result.label_s},
                              {"initial_labels", result.initial_labels},
                              {"paper_like", result.is_paper_like},
                              {"verdict", verdict(result)}};
  for (const AxisComparison& axis : result.axes) {
    auto& own = json["axis"][std::string(core::name(axis.axis))];
    for (const ProtocolOutcome& protocol : axis.protocols) {
      auto& told = own["protocols"][protocol.protocol.name];
      told["delay_s"] = protocol.protocol.delay_s;
      told["judged_from_s"] = core::seconds(protocol.protocol.judged_from);
      told["raw"] = json_of(protocol.raw);
      for (const SchemeOutcome& scheme : protocol.schemes)
        told["schemes"][scheme.name] = json_of(scheme);
    }
    for (const PaperOutcome& outcome : axis.paper)
      own["paper_procedure"][outcome.name] = json_of(outcome);
  }
  return json;
}

}  // namespace zerodrift::services
