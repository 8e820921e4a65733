// SPDX-License-Identifier: Apache-2.0
#include "services/zerodrift/diagnosis_tables.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <utility>

#include "common/report/numbers.h"

namespace zerodrift::services {
namespace {

using diagnosis::AxisDiagnosis;
using diagnosis::Gap;
using report::Align;
using report::significant;

std::string percent(double share) {
  return std::isfinite(share) ? significant(100.0 * share, kDiagnosisDigits) + " %" : "n/a";
}

std::string probability(double p) {
  constexpr double kPrintsAsOne = 0.9995;
  if (p >= kPrintsAsOne) return "> 0.999";
  constexpr double kPrintsAsZero = 0.001;
  return p < kPrintsAsZero ? "< 0.001" : significant(p, kDiagnosisDigits);
}

// Of a test; far below what anyone tells apart.
std::string p_value(double p) {
  constexpr double kSmallest = 1e-12;
  return p < kSmallest ? "< 1e-12" : significant(p, 2);
}

// The unit of diagnosis::Disagreement::from and to; "" for a kind nobody knows.
std::string_view unit_of(std::string_view kind) {
  // Longer beginnings first.
  constexpr std::array<std::pair<std::string_view, std::string_view>, 11> kUnits{
      {{"time", "s"},
       {"temperature_rate", "°C/min"},
       {"temperature", "°C"},
       {"rate", "deg/h"},
       {"frequency", "Hz"},
       {"allan_tau", "s"},
       {"magnetic_", "µT"},
       {"acceleration", "m/s²"},
       {"vibration", "g"},
       {"source_current", "mA"},
       {"supply", "V"}}};
  const auto* const found = std::find_if(
      kUnits.begin(), kUnits.end(), [&](const auto& unit) { return kind.starts_with(unit.first); });
  return found == kUnits.end() ? "" : found->second;
}

std::string held_out_text(diagnosis::HeldOut kind) {
  switch (kind) {
    case diagnosis::HeldOut::kNothing: break;
    case diagnosis::HeldOut::kRecords: return "held out: other records";
    case diagnosis::HeldOut::kBlocks: return "held out: parts of the record";
  }
  return "held out: nothing";
}

std::string alternatives(const diagnosis::NamedEffect& effect) {
  if (effect.alternatives.empty()) return "none";
  return joined(effect.alternatives, [](const diagnosis::Alternative& other) {
    return other.name + " (" + probability(other.probability) + ")";
  });
}

std::string outcome(const AxisDiagnosis& axis) {
  if (axis.acceptance == diagnosis::Acceptance::kReverted ||
      axis.acceptance == diagnosis::Acceptance::kUnproven)
    return "taken back";
  if (axis.acceptance == diagnosis::Acceptance::kAccepted) return "accepted";
  return "unchanged";
}

// Named effects; what was recalibrated; the unknown's formula, else what it depends on.
std::string finding(const AxisDiagnosis& axis) {
  std::vector<std::string> found;
  for (const auto& effect : axis.effects) found.push_back(effect.name);
  for (const auto& change : axis.recalibrated) {
    const std::string text = change.name + " recalibrated";
    if (found.empty() || found.back() != text) found.push_back(text);
  }
  if (axis.unknown && !axis.unknown->formulas.empty()) {
    found.push_back("unknown: " + axis.unknown->description);
  } else if (axis.unknown) {
    found.push_back("unknown" + (axis.unknown->depends_on.empty()
                                     ? std::string()
                                     : " in " + joined(axis.unknown->depends_on)));
  }
  return found.empty() ? "nothing" : joined(found);
}

// "axis" leads where several axes share a table.
class AxisTable {
 public:
  AxisTable(std::string caption, TableAxes axes, const std::vector<report::Column>& columns)
      : axes_(axes) {
    table_.caption = std::move(caption);
    if (axes_ == TableAxes::kNamed) table_.columns.push_back({"axis", Align::kLeft});
    table_.columns.insert(table_.columns.end(), columns.begin(), columns.end());
  }

  void add(const Diagnosed& axis, const std::vector<std::string>& cells, bool highlighted = false) {
    report::Row row{.cells = {}, .highlighted = highlighted};
    if (axes_ == TableAxes::kNamed) row.cells.push_back(axis.axis);
    row.cells.insert(row.cells.end(), cells.begin(), cells.end());
    table_.rows.push_back(std::move(row));
  }
  [[nodiscard]] report::Table take() { return std::move(table_); }

 private:
  TableAxes axes_;
  report::Table table_;
};

}  // namespace

report::Table gap_table(const DiagnosedAxes& group, TableAxes axes) {
  AxisTable table("Measurement minus twin, RMS of the 60 s means, deg/h", axes,
                  {{"judged on", Align::kLeft},
                   {"before", Align::kRight},
                   {"after", Align::kRight},
                   {"after/before", Align::kRight},
                   {"noise alone", Align::kRight}});
  for (const Diagnosed& axis : group) {
    if (!axis.of.examined) continue;
    const auto add = [&](const std::string& judged, const Gap& gap) {
      table.add(
          axis,
          {judged, in_deg_per_hour(gap.before_rms_radps), in_deg_per_hour(gap.after_rms_radps),
           gap.before_rms_radps > 0.0
               ? significant(gap.after_rms_radps / gap.before_rms_radps, kDiagnosisDigits)
               : "n/a",
           in_deg_per_hour(gap.noise_floor_rms_radps)});
    };
    add("the record it was fitted to", axis.of.fit);
    if (axis.of.held_out_kind != diagnosis::HeldOut::kNothing)
      add(held_out_text(axis.of.held_out_kind), axis.of.held_out);
    const auto& allan = axis.of.allan_log_distance;
    table.add(axis, {"Allan curves: mean |ln ratio|", significant(allan.before, kDiagnosisDigits),
                     significant(allan.after, kDiagnosisDigits),
                     allan.before > 0.0 ? significant(allan.after / allan.before, kDiagnosisDigits)
                                        : "n/a",
                     ""});
  }
  return table.take();
}

report::Table effect_table(const DiagnosedAxes& group, TableAxes axes) {
  AxisTable table("Effects that were missing", axes,
                  {{"effect", Align::kLeft},
                   {"probability", Align::kRight},
                   {"it might also be", Align::kLeft},
                   {"reads", Align::kLeft},
                   {"share of gap", Align::kRight},
                   {"ln evidence", Align::kRight}});
  for (const Diagnosed& axis : group) {
    for (const auto& effect : axis.of.effects) {
      table.add(axis, {effect.name, probability(effect.probability), alternatives(effect),
                       joined(effect.inputs), percent(effect.share_of_gap),
                       significant(effect.log_evidence, kDiagnosisDigits)});
    }
  }
  return table.take();
}

report::Table parameter_table(const DiagnosedAxes& group, TableAxes axes) {
  AxisTable table("Their parameters, with standard errors", axes,
                  {{"effect", Align::kLeft},
                   {"parameter", Align::kLeft},
                   {"value", Align::kRight},
                   {"± standard error", Align::kRight}});
  for (const Diagnosed& axis : group) {
    for (const auto& effect : axis.of.effects) {
      for (const auto& [parameter, value] : effect.parameters) {
        const auto error = effect.standard_errors.find(parameter);
        table.add(axis, {effect.name, parameter, significant(value, 4),
                         error == effect.standard_errors.end() ? "not fitted"
                                                               : significant(error->second, 2)});
      }
    }
  }
  return table.take();
}

report::Table recalibration_table(const DiagnosedAxes& group, TableAxes axes) {
  AxisTable table("Known effects with new parameters", axes,
                  {{"effect", Align::kLeft},
                   {"parameter", Align::kLeft},
                   {"from", Align::kRight},
                   {"to", Align::kRight},
                   {"± standard error", Align::kRight}});
  for (const Diagnosed& axis : group) {
    for (const auto& change : axis.of.recalibrated) {
      table.add(axis, {change.name, change.parameter,
                       std::isfinite(change.from) ? significant(change.from, 4) : "not known",
                       significant(change.to, 4),
                       std::isfinite(change.standard_error) ? significant(change.standard_error, 2)
                                                            : "not known"});
    }
  }
  return table.take();
}

report::Table where_table(const DiagnosedAxes& group) {
  AxisTable table("Where measurement and the twin as given disagree more than noise allows",
                  TableAxes::kOne,
                  {{"in", Align::kLeft},
                   {"from", Align::kRight},
                   {"to", Align::kRight},
                   {"unit", Align::kLeft},
                   {"excess", Align::kRight},
                   {"p", Align::kRight}});
  for (const Diagnosed& axis : group) {
    for (const auto& place : axis.of.where) {
      table.add(axis, {spelled_out(place.kind), significant(place.from, 4),
                       significant(place.to, 4), std::string(unit_of(place.kind)),
                       significant(place.excess, kDiagnosisDigits), p_value(place.p_value)});
    }
  }
  return table.take();
}

// Named or not; what was named is marked. The weakest are left out of a long list.
std::optional<report::Table> evidence_table(const Diagnosed& axis) {
  constexpr std::size_t kMostShown = 30;
  const auto& all = axis.of.evidence;
  if (all.empty()) return std::nullopt;
  AxisTable table("Candidates, strongest first; marked: named", TableAxes::kOne,
                  {{"effect", Align::kLeft},
                   {"ln evidence", Align::kRight},
                   {"d", Align::kRight},
                   {"RMS deg/h", Align::kRight}});
  std::size_t left_out = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const bool named = std::any_of(axis.of.effects.begin(), axis.of.effects.end(),
                                   [&](const auto& effect) { return effect.name == all[i].name; });
    if (i >= kMostShown && !named) {
      ++left_out;
      continue;
    }
    table.add(axis,
              {all[i].name, significant(all[i].log_evidence, kDiagnosisDigits),
               significant(all[i].separation, kDiagnosisDigits), in_deg_per_hour(all[i].rms_radps)},
              named);
  }
  report::Table shown = table.take();
  shown.footnote = "f(...): any smooth function of these inputs, for what the catalogue lacks.";
  if (left_out > 0)
    shown.footnote += " " + std::to_string(left_out) + " weaker candidates are in the JSON.";
  return shown;
}

report::Table not_testable_table(const DiagnosedAxes& group) {
  AxisTable table("What this record can't tell", TableAxes::kOne,
                  {{"effect", Align::kLeft}, {"why", Align::kLeft}});
  for (const Diagnosed& axis : group) {
    for (const auto& effect : axis.of.not_testable) table.add(axis, {effect.name, effect.why});
  }
  return table.take();
}

report::Table visible_table(const DiagnosedAxes& group) {
  AxisTable table("The smallest effect that this record could have shown", TableAxes::kOne,
                  {{"effect", Align::kLeft}, {"RMS deg/h", Align::kRight}});
  for (const Diagnosed& axis : group) {
    for (const auto& effect : axis.of.could_have_seen)
      table.add(axis, {effect.name, in_deg_per_hour(effect.rms_radps)});
  }
  return table.take();
}

report::Table summary_table(const DiagnosedAxes& group) {
  AxisTable table("The axes", TableAxes::kNamed,
                  {{"verdict", Align::kLeft},
                   {"found", Align::kLeft},
                   {"model", Align::kLeft},
                   {"held-out gap, deg/h", Align::kRight}});
  for (const Diagnosed& axis : group) {
    const bool proved = axis.of.held_out_kind != diagnosis::HeldOut::kNothing;
    table.add(axis,
              {spelled_out(diagnosis::name(axis.of.verdict)), finding(axis.of), outcome(axis.of),
               proved ? in_deg_per_hour(axis.of.held_out.before_rms_radps) + " → " +
                            in_deg_per_hour(axis.of.held_out.after_rms_radps)
                      : "nothing held out"});
  }
  return table.take();
}

}  // namespace zerodrift::services
