// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <map>
#include <optional>

#include "common/core/not_known.h"
#include "common/core/units.h"
#include "common/measurement/doubts_json.h"
#include "services/zerodrift/diagnosis_report.h"
#include "services/zerodrift/diagnosis_words.h"

namespace zerodrift::services {
namespace {

using core::deg_h_from_radps;
using diagnosis::AxisDiagnosis;
using diagnosis::Gap;
using Json = nlohmann::ordered_json;

using core::kNaN;

std::string key_of(diagnosis::HeldOut kind) {
  switch (kind) {
    case diagnosis::HeldOut::kNothing: break;
    case diagnosis::HeldOut::kRecords: return "records";
    case diagnosis::HeldOut::kBlocks: return "blocks";
  }
  return "nothing";
}

std::string key_of(diagnosis::Acceptance acceptance) {
  switch (acceptance) {
    case diagnosis::Acceptance::kNothingToProve: break;
    case diagnosis::Acceptance::kAccepted: return "accepted";
    case diagnosis::Acceptance::kReverted: return "reverted";
    case diagnosis::Acceptance::kUnproven: return "unproven";
  }
  return "nothing_to_prove";
}

Json number(double value) {
  return std::isfinite(value) ? Json(value) : Json(nullptr);
}

Json rate(double radps) {
  return number(deg_h_from_radps(radps));
}

Json json_of(const std::map<std::string, double>& values) {
  Json json = Json::object();
  for (const auto& [key, value] : values) json[key] = number(value);
  return json;
}

template <typename Items, typename Function>
Json array_of(const Items& items, Function function) {
  Json json = Json::array();
  for (const auto& item : items) json.push_back(function(item));
  return json;
}

Json json_of(const Gap& gap, bool is_known) {
  const auto figure = [&](double radps) { return is_known ? rate(radps) : Json(nullptr); };
  return {{"before_rms_deg_h", figure(gap.before_rms_radps)},
          {"after_rms_deg_h", figure(gap.after_rms_radps)},
          {"noise_floor_rms_deg_h", figure(gap.noise_floor_rms_radps)}};
}

Json json_of(const diagnosis::Disagreement& place) {
  return {{"kind", place.kind},
          {"from", number(place.from)},
          {"to", number(place.to)},
          {"excess", number(place.excess)},
          {"p_value", number(place.p_value)}};
}

Json json_of(const diagnosis::NamedEffect& effect) {
  return {{"name", effect.name},
          {"probability", number(effect.probability)},
          {"alternatives", array_of(effect.alternatives,
                                    [](const auto& other) {
                                      return Json{{"name", other.name},
                                                  {"probability", number(other.probability)},
                                                  {"inputs", other.inputs},
                                                  {"parameters", json_of(other.parameters)}};
                                    })},
          {"inputs", effect.inputs},
          {"parameters", json_of(effect.parameters)},
          {"standard_errors", json_of(effect.standard_errors)},
          {"log_evidence", number(effect.log_evidence)},
          {"share_of_gap", number(effect.share_of_gap)}};
}

Json json_of(const diagnosis::Recalibration& change) {
  return {{"name", change.name},
          {"parameter", change.parameter},
          {"from", number(change.from)},
          {"to", number(change.to)},
          {"standard_error", number(change.standard_error)}};
}

Json json_of_formula(const diagnosis::NamedEffect& summand) {
  Json json = json_of(summand);
  json.erase("inputs");  // the formula says them
  json["formula"] = summand.formula;
  return json;
}

Json json_of(const std::optional<diagnosis::UnknownEffect>& unknown) {
  if (!unknown) return nullptr;
  return {{"description", unknown->description},
          {"depends_on", unknown->depends_on},
          {"rms_deg_h", rate(unknown->rms_radps)},
          {"shape",
           {{"input", array_of(unknown->input, number)},
            {"rate_deg_h", array_of(unknown->rate_radps, rate)}}},
          {"formulas", array_of(unknown->formulas, json_of_formula)},
          {"noise", array_of(unknown->noise, [](const auto& effect) { return json_of(effect); })}};
}

Json json_of(const AxisDiagnosis& axis) {
  const bool held_out = axis.held_out_kind != diagnosis::HeldOut::kNothing;
  Json json{{"verdict", diagnosis::name(axis.verdict)},
            {"sentence", axis.sentence},
            {"where", array_of(axis.where, [](const auto& place) { return json_of(place); })},
            {"effects", array_of(axis.effects, [](const auto& effect) { return json_of(effect); })},
            {"recalibrated",
             array_of(axis.recalibrated, [](const auto& change) { return json_of(change); })},
            {"unknown", json_of(axis.unknown)}};
  json["gap"] = {{"fit", json_of(axis.fit, axis.examined)},
                 {"held_out", json_of(axis.held_out, held_out)},
                 {"allan_log_distance",
                  {{"before", number(axis.examined ? axis.allan_log_distance.before : kNaN)},
                   {"after", number(axis.examined ? axis.allan_log_distance.after : kNaN)}}}};
  json["samples_left_out"] = axis.samples_left_out;
  json["held_out_kind"] = key_of(axis.held_out_kind);
  json["acceptance"] = key_of(axis.acceptance);
  json["taken_back"] =
      array_of(axis.taken_back, [](const auto& effect) { return json_of(effect); });
  json["not_testable"] = array_of(axis.not_testable, [](const auto& effect) {
    return Json{{"name", effect.name}, {"why", effect.why}};
  });
  json["could_have_seen"] = array_of(axis.could_have_seen, [](const auto& effect) {
    return Json{{"name", effect.name}, {"rms_deg_h", rate(effect.rms_radps)}};
  });
  json["next_experiment"] = axis.next_experiment;
  json["evidence"] = array_of(axis.evidence, [](const auto& candidate) {
    return Json{{"name", candidate.name},
                {"log_evidence", number(candidate.log_evidence)},
                {"separation", number(candidate.separation)},
                {"rms_deg_h", rate(candidate.rms_radps)}};
  });
  return json;
}

}  // namespace

Json diagnosis_json(const DiagnosisResult& result) {
  Json json{{"verdict", diagnosis::name(result.diagnosis.verdict)},
            {"model", result.model},
            {"record", result.record.file},
            {"validation",
             array_of(result.validation, [](const RecordSummary& record) { return record.file; })},
            {"model_changed", result.change == ModelChange::kRepaired},
            {"doubts", doubts_json(result.doubts)},
            {"warnings", result.warnings}};
  json["axis"] = Json::object();
  for (const Diagnosed& axis : diagnosed_axes(result)) json["axis"][axis.axis] = json_of(axis.of);
  return json;
}

}  // namespace zerodrift::services
