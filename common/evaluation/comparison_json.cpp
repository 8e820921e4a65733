// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "common/allan/noise_units.h"
#include "common/core/not_known.h"
#include "common/evaluation/comparison_figures.h"
#include "common/evaluation/comparison_report.h"
#include "common/evaluation/comparison_verdict.h"
#include "common/measurement/doubts_json.h"
#include "common/report/json_object.h"

namespace zerodrift::evaluation {
namespace {

using core::deg_h_from_radps;

using core::kNaN;

nlohmann::ordered_json json_of(const comparison::StreamReport& stream) {
  using allan::NoiseTerm;
  auto json = nlohmann::ordered_json::object();
  json["block_s"] = stream.block_s;
  json["blocks"] = stream.minute_means.blocks;
  json["std_60s_deg_h"] = deg_h_or_nothing(stream.minute_means);
  const auto add = [&](const char* key, NoiseTerm term, double unit) {
    const auto& c = stream.coefficients[term];
    const bool known = c.identification == allan::Identification::kInterval;
    const bool bounded = known || c.identification == allan::Identification::kUpperBound;
    json[key] = {{"value", known ? unit * c.value : kNaN},
                 {"lower", known ? unit * c.lower : kNaN},
                 {"upper", bounded ? unit * c.upper : kNaN}};
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

// What depends on the machine stands apart under "times".
nlohmann::ordered_json times(double seconds, std::size_t points) {
  return {{"seconds", seconds}, {"seconds_per_point", seconds / static_cast<double>(points)}};
}

nlohmann::ordered_json json_of(const SchemeOutcome& scheme) {
  const auto& s = scheme.statistics;
  nlohmann::ordered_json json{{"points", s.points},
                              {"mean_deg_h", deg_h_from_radps(s.mean)},
                              {"std_deg_h", deg_h_from_radps(s.standard_deviation)},
                              {"mae_deg_h", deg_h_from_radps(s.mean_absolute)},
                              {"rmse_deg_h", deg_h_from_radps(s.root_mean_square)},
                              {"coverage_95", s.coverage},
                              {"times", times(scheme.seconds, scheme.predicted.size())}};
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
          {"times", times(outcome.seconds, outcome.residual_radps.size())}};
}

// The drift as measured, by label; the residual is this less what a scheme predicted.
nlohmann::ordered_json json_of(const std::vector<comparison::LabelledPoint>& points) {
  nlohmann::ordered_json json{{"end_s", nlohmann::ordered_json::array()},
                              {"drift_deg_h", nlohmann::ordered_json::array()}};
  for (const auto& point : points) {
    json["end_s"].push_back(core::seconds(point.end));
    json["drift_deg_h"].push_back(deg_h_from_radps(point.drift_radps));
  }
  return json;
}

nlohmann::ordered_json predicted_of(const SchemeOutcome& scheme) {
  auto json = nlohmann::ordered_json::array();
  for (const auto& predicted : scheme.predicted)
    json.push_back(predicted ? deg_h_from_radps(predicted->drift_radps) : kNaN);
  return json;
}

// "one_ahead", "delayed_600_s", "frozen": nothing of the record is in a key.
std::string key_of(const comparison::Protocol& protocol) {
  if (is_frozen(protocol)) return "frozen";
  std::string key = protocol.name;
  std::replace(key.begin(), key.end(), ' ', '_');
  return key;
}

nlohmann::ordered_json json_of(const AxisComparison& axis, const ProtocolOutcome& outcome) {
  const comparison::Protocol& protocol = outcome.protocol;
  nlohmann::ordered_json json{
      {"delay_s", protocol.delay_s},
      {"median_age_s", comparison::median_age_s(protocol, axis.points)},
      {"frozen_from_s", is_frozen(protocol) ? core::seconds(protocol.frozen_from) : kNaN},
      {"judged_from_s", core::seconds(protocol.judged_from)},
      {"before", json_of(outcome.raw)}};
  for (const SchemeOutcome& scheme : outcome.schemes) {
    auto& shown = report::object_at(json, "schemes")[scheme.name] = json_of(scheme);
    if (is_drawn(outcome, scheme)) shown["predicted_deg_h"] = predicted_of(scheme);
  }
  return json;
}

}  // namespace

nlohmann::ordered_json comparison_json(const ComparisonResult& result) {
  const Standing standing = standing_of(result);
  nlohmann::ordered_json json{
      {"advice", recommendation(result)},   {"record", result.record},
      {"paper_like", result.is_paper_like}, {"doubts", doubts_json(result.doubts)},
      {"warnings", result.warnings},        {"verdict", verdict(result, standing)}};
  if (const auto best = recommendation_of(result)) {
    json["recommendation"] = {{"scheme", best->scheme},
                              {"rmse_over_holding_late", best->over_holding},
                              {"stack_rmse_over_holding_late", best->ours},
                              {"better_not_run", best->better},
                              {"better_rmse_over_holding_late", best->better_over_holding}};
  }
  auto& better = json["better_than_stack"] = nlohmann::ordered_json::array();
  for (const Behind& b : standing.behind) {
    better.push_back({{"axis", b.axis},
                      {"judged", b.judged},
                      {"figure", b.figure},
                      {"scheme", b.best.scheme},
                      {"value_deg_h", deg_h_from_radps(b.best.value)},
                      {"stack_deg_h", deg_h_from_radps(b.ours)}});
  }
  for (const AxisComparison& axis : result.axes) {
    auto& own =
        report::object_at(report::object_at(json, "axis"), std::string(core::name(axis.axis)));
    own["label_s"] = label_s(axis);
    own["initial_labels"] = axis.initial_labels;
    own["labels"] = json_of(axis.points);
    for (const ProtocolOutcome& protocol : axis.protocols)
      report::object_at(own, "protocols")[key_of(protocol.protocol)] = json_of(axis, protocol);
    for (const PaperOutcome& outcome : axis.paper)
      report::object_at(own, "paper_procedure")[outcome.name] = json_of(outcome);
  }
  return json;
}

}  // namespace zerodrift::evaluation
