// SPDX-License-Identifier: Apache-2.0
#include "services/zerodrift/history_report.h"

#include <algorithm>
#include <utility>

#include "common/core/counted.h"
#include "common/report/numbers.h"
#include "common/report/plain_text.h"

namespace zerodrift::services {
namespace {

using core::counted;
using diagnosis::Coefficient;
using diagnosis::CoefficientHistory;
using diagnosis::Estimate;
using diagnosis::UnitHistory;
using report::significant;
using Json = nlohmann::ordered_json;

constexpr int kDigits = 3;
constexpr int kErrorDigits = 2;

std::string text_of(const Estimate& estimate) {
  return significant(estimate.value, kDigits) + " ± " +
         significant(estimate.standard_error, kErrorDigits);
}

std::string name_of(const Coefficient& coefficient) {
  return "axis " + std::string(core::name(coefficient.axis)) + ", " + coefficient.effect + "." +
         coefficient.parameter;
}

std::string sentence_of(const Coefficient& coefficient, const diagnosis::UnitChange& change) {
  return "Unit " + change.unit + " changed between " + change.last_before + " and " +
         change.first_after + ": " + name_of(coefficient) + " from " + text_of(change.before) +
         " (" + counted(change.records_before, "record") + ") to " + text_of(change.after) + " (" +
         counted(change.records_after, "record") + "); false-discovery rate " +
         significant(change.false_discovery_rate, kErrorDigits) + ".";
}

std::string sentence_of(const Coefficient& coefficient, const diagnosis::UnlikeUnit& unit) {
  return "Unit " + unit.unit + " is unlike the others: " + name_of(coefficient) + " is " +
         text_of(unit.mean) + ", theirs " + significant(unit.others.value, kDigits) +
         " with a standard deviation of " + significant(unit.others_scatter, kErrorDigits) +
         " between them; false-discovery rate " +
         significant(unit.false_discovery_rate, kErrorDigits) + ".";
}

std::string about_none(const UnitHistory& history, double false_discovery_rate, bool any_change,
                       bool any_unlike) {
  std::string text;
  if (history.tests_of_change == 0) {
    text +=
        "Whether anything changed can't be asked: it needs records of at least two dates of a "
        "unit, and more records than units by two.";
  } else if (!any_change) {
    text += "No unit changed (" + counted(history.tests_of_change, "question") +
            ", false-discovery rate at most " + significant(false_discovery_rate, 1) + ").";
  }
  if (!text.empty()) text += " ";
  if (history.tests_of_likeness == 0) {
    text += "Whether a unit is unlike the others can't be asked: it needs four of them.";
  } else if (!any_unlike) {
    text +=
        "No unit is unlike the others (" + counted(history.tests_of_likeness, "question") + ").";
  }
  return text;
}

Json json_of(const Estimate& estimate) {
  return {{"value", estimate.value}, {"standard_error", estimate.standard_error}};
}

Json json_of(const std::optional<double>& value) {
  return value ? Json(*value) : Json();
}

Json json_of(const diagnosis::UnitChange& change) {
  return {{"unit", change.unit},
          {"last_before", change.last_before},
          {"first_after", change.first_after},
          {"records_before", change.records_before},
          {"records_after", change.records_after},
          {"before", json_of(change.before)},
          {"after", json_of(change.after)},
          {"p_value", change.p_value},
          {"false_discovery_rate", change.false_discovery_rate}};
}

Json json_of(const diagnosis::UnlikeUnit& unit) {
  return {{"unit", unit.unit},
          {"mean", json_of(unit.mean)},
          {"others", json_of(unit.others)},
          {"others_scatter", unit.others_scatter},
          {"p_value", unit.p_value},
          {"false_discovery_rate", unit.false_discovery_rate}};
}

template <typename Findings>
Json list_of(const Findings& findings) {
  Json list = Json::array();
  for (const auto& finding : findings) list.push_back(json_of(finding));
  return list;
}

Json json_of(const CoefficientHistory& history) {
  const Coefficient& coefficient = history.coefficient;
  Json records = Json::array();
  for (const diagnosis::DatedEstimate& record : coefficient.records) {
    records.push_back({{"unit", record.unit},
                       {"date", record.date},
                       {"value", record.estimate.value},
                       {"standard_error", record.estimate.standard_error}});
  }
  return {{"axis", core::name(coefficient.axis)},
          {"effect", coefficient.effect},
          {"parameter", coefficient.parameter},
          {"units", history.units},
          {"not_comparable", coefficient.not_comparable},
          {"mean", history.mean},
          {"scatter_within_units", json_of(history.scatter_within_units)},
          {"scatter_between_units", json_of(history.scatter_between_units)},
          {"changes", list_of(history.changes)},
          {"unlike", list_of(history.unlike)},
          {"records", records}};
}

}  // namespace

std::vector<std::string> history_sentences(const UnitHistory& history,
                                           double false_discovery_rate) {
  std::vector<std::string> sentences;
  bool any_change = false;
  bool any_unlike = false;
  for (const CoefficientHistory& one : history.coefficients) {
    for (const auto& change : one.changes)
      sentences.push_back(sentence_of(one.coefficient, change));
    any_change = any_change || !one.changes.empty();
  }
  for (const CoefficientHistory& one : history.coefficients) {
    for (const auto& unit : one.unlike) sentences.push_back(sentence_of(one.coefficient, unit));
    any_unlike = any_unlike || !one.unlike.empty();
  }
  std::string none = about_none(history, false_discovery_rate, any_change, any_unlike);
  if (!none.empty()) sentences.push_back(std::move(none));
  return sentences;
}

report::Table history_table(const UnitHistory& history) {
  using report::Align;
  report::Table table{
      .caption = "Coefficients, in the units that their names end in",
      .columns = {{"axis", Align::kLeft},
                  {"effect", Align::kLeft},
                  {"parameter", Align::kLeft},
                  {"units"},
                  {"records"},
                  {"mean"},
                  {"sd within"},
                  {"sd between"}},
      .rows = {},
      .footnote = "sd: what records of one unit, and units, scatter beyond their standard errors."};
  std::size_t not_comparable = 0;
  const auto scatter = [](const std::optional<double>& sd) {
    return sd ? significant(*sd, kErrorDigits) : "too few";
  };
  for (const CoefficientHistory& one : history.coefficients) {
    const Coefficient& coefficient = one.coefficient;
    not_comparable = std::max(not_comparable, coefficient.not_comparable);
    table.rows.push_back(
        {.cells = {std::string(core::name(coefficient.axis)), report::one_line(coefficient.effect),
                   coefficient.parameter, std::to_string(one.units),
                   std::to_string(coefficient.records.size()), significant(one.mean, kDigits),
                   scatter(one.scatter_within_units), scatter(one.scatter_between_units)},
         .highlighted = !one.changes.empty() || !one.unlike.empty()});
  }
  if (not_comparable > 0) {
    table.footnote += " Left out, as their time constants or widths are others: up to " +
                      counted(not_comparable, "record") + " of an effect.";
  }
  return table;
}

Json history_json(const UnitHistory& history, double false_discovery_rate) {
  Json json{{"false_discovery_rate", false_discovery_rate},
            {"tests_of_change", history.tests_of_change},
            {"tests_of_likeness", history.tests_of_likeness},
            {"sentences", history_sentences(history, false_discovery_rate)}};
  Json coefficients = Json::array();
  for (const CoefficientHistory& one : history.coefficients) coefficients.push_back(json_of(one));
  json["coefficients"] = std::move(coefficients);
  return json;
}

}  // namespace zerodrift::services
