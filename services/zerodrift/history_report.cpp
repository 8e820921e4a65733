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

std::string with_records(const Estimate& estimate, std::size_t records) {
  return text_of(estimate) + " (" + counted(records, "record") + ")";
}

std::string rate_text(double false_discovery_rate) {
  return "; false-discovery rate " + significant(false_discovery_rate, kErrorDigits) + ".";
}

std::string sentence_of(const Coefficient& coefficient, const diagnosis::UnitChange& change) {
  const std::string text = "Unit " + change.unit + " changed between " + change.last_before +
                           " and " + change.first_after + ": " + name_of(coefficient) + " from " +
                           with_records(change.before, change.records_before) + " to " +
                           with_records(change.after, change.records_after) +
                           rate_text(change.false_discovery_rate);
  return diagnosis::may_be_one_record(change)
             ? text + " Or a record that stands alone there is the odd one: one more tells."
             : text;
}

// Of a record with a step on either side.
std::string sentence_of(const Coefficient& coefficient, const diagnosis::UnitChange& into,
                        const diagnosis::UnitChange& out_of) {
  return "Unit " + into.unit + ", record of " + into.first_after + ": " + name_of(coefficient) +
         " is " + text_of(into.after) + " in it alone, " +
         with_records(into.before, into.records_before) + " before and " +
         with_records(out_of.after, out_of.records_after) + " after" +
         rate_text(std::max(into.false_discovery_rate, out_of.false_discovery_rate));
}

bool is_one_record_between(const diagnosis::UnitChange& into, const diagnosis::UnitChange& out_of) {
  return into.unit == out_of.unit && into.records_after == 1 && out_of.records_before == 1 &&
         into.first_after == out_of.last_before;
}

void add_sentences(const CoefficientHistory& history, std::vector<std::string>& sentences) {
  const auto& changes = history.changes;
  for (std::size_t i = 0; i < changes.size(); ++i) {
    if (i + 1 < changes.size() && is_one_record_between(changes[i], changes[i + 1])) {
      sentences.push_back(sentence_of(history.coefficient, changes[i], changes[i + 1]));
      ++i;
    } else {
      sentences.push_back(sentence_of(history.coefficient, changes[i]));
    }
  }
}

std::string sentence_of(const Coefficient& coefficient, const diagnosis::UnlikeUnit& unit) {
  return "Unit " + unit.unit + " is unlike the others: " + name_of(coefficient) + " is " +
         text_of(unit.mean) + ", theirs " + significant(unit.others.value, kDigits) +
         " with a standard deviation of " + significant(unit.others_scatter, kErrorDigits) +
         " between them" + rate_text(unit.false_discovery_rate);
}

// "unit 17 in 4 of 8, from 2026-05-01 on"
std::string text_of(const diagnosis::UnitShare& share) {
  if (share.sized == share.records)
    return "unit " + share.unit + " in all " + std::to_string(share.records);
  const std::string text = "unit " + share.unit + " in " + std::to_string(share.sized) + " of " +
                           std::to_string(share.records);
  if (share.only_late) return text + ", from " + share.first + " on";
  return share.only_early ? text + ", until " + share.last : text;
}

std::string sentence_of(const diagnosis::PartlySized& effect) {
  constexpr std::size_t kMostUnits = 8;
  std::string text = "Axis " + std::string(core::name(effect.axis)) + ", " + effect.effect +
                     " was sized in " + std::to_string(effect.sized) + " of " +
                     counted(effect.records, "record") + ":";
  for (std::size_t i = 0; i < std::min(kMostUnits, effect.units.size()); ++i)
    text += (i == 0 ? " of " : "; ") + text_of(effect.units[i]);
  if (effect.units.size() > kMostUnits)
    text += "; of " + counted(effect.units.size() - kMostUnits, "more unit");
  return text +
         ". Whether it came or went there isn't asked: a record that doesn't have it may not "
         "have shown it.";
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
          {"may_be_one_record", diagnosis::may_be_one_record(change)},
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

Json json_of(const diagnosis::UnitShare& share) {
  return {{"unit", share.unit},
          {"sized", share.sized},
          {"records", share.records},
          {"first", share.first},
          {"last", share.last}};
}

Json json_of(const diagnosis::DatedEstimate& record) {
  return {{"unit", record.unit},
          {"date", record.date},
          {"value", record.estimate.value},
          {"standard_error", record.estimate.standard_error}};
}

Json json_of(const diagnosis::PartlySized& effect);
Json json_of(const CoefficientHistory& history);

template <typename Findings>
Json list_of(const Findings& findings) {
  Json list = Json::array();
  for (const auto& finding : findings) list.push_back(json_of(finding));
  return list;
}

Json json_of(const diagnosis::PartlySized& effect) {
  return {{"axis", core::name(effect.axis)},
          {"effect", effect.effect},
          {"sized", effect.sized},
          {"records", effect.records},
          {"units", list_of(effect.units)}};
}

Json json_of(const CoefficientHistory& history) {
  const Coefficient& coefficient = history.coefficient;
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
          {"records", list_of(coefficient.records)}};
}

}  // namespace

std::vector<std::string> history_sentences(const FleetHistory& fleet) {
  const UnitHistory& history = fleet.history;
  std::vector<std::string> sentences;
  bool any_change = false;
  bool any_unlike = false;
  for (const CoefficientHistory& one : history.coefficients) {
    add_sentences(one, sentences);
    any_change = any_change || !one.changes.empty();
  }
  for (const CoefficientHistory& one : history.coefficients) {
    for (const auto& unit : one.unlike) sentences.push_back(sentence_of(one.coefficient, unit));
    any_unlike = any_unlike || !one.unlike.empty();
  }
  for (const auto& effect : fleet.partly_sized) sentences.push_back(sentence_of(effect));
  std::string none = about_none(history, fleet.false_discovery_rate, any_change, any_unlike);
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

Json history_json(const FleetHistory& fleet) {
  const UnitHistory& history = fleet.history;
  return {{"false_discovery_rate", fleet.false_discovery_rate},
          {"tests_of_change", history.tests_of_change},
          {"tests_of_likeness", history.tests_of_likeness},
          {"sentences", history_sentences(fleet)},
          {"partly_sized", list_of(fleet.partly_sized)},
          {"coefficients", list_of(history.coefficients)}};
}

}  // namespace zerodrift::services
