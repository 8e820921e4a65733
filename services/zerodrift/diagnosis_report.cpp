// SPDX-License-Identifier: Apache-2.0
#include "services/zerodrift/diagnosis_report.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <string_view>

#include "common/core/units.h"
#include "common/report/numbers.h"
#include "common/twin/effect_catalogue.h"

namespace zerodrift::services {
namespace {

using core::deg_h_from_radps;
using diagnosis::AxisDiagnosis;
using diagnosis::Gap;
using report::Align;
using report::significant;
using Json = nlohmann::ordered_json;

constexpr int kDigits = 3;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// One axis that was diagnosed.
struct Diagnosed {
  std::string axis;  // "x"
  const AxisDiagnosis& of;

  [[nodiscard]] std::string name() const { return "axis " + axis; }
};

std::vector<Diagnosed> axes_of(const DiagnosisResult& result) {
  std::vector<Diagnosed> axes;
  for (const auto axis : core::kAxes) {
    if (const auto& one = result.diagnosis.axes[core::index(axis)])
      axes.push_back({std::string(core::name(axis)), *one});
  }
  return axes;
}

// ------------------------------------------------------------------------------------ words

std::string deg_h(double radps) {
  return significant(deg_h_from_radps(radps), kDigits);
}

std::string percent(double share) {
  return std::isfinite(share) ? significant(100.0 * share, kDigits) + " %" : "n/a";
}

std::string probability(double p) {
  constexpr double kPrintsAsOne = 0.9995;
  if (p >= kPrintsAsOne) return "> 0.999";
  constexpr double kPrintsAsZero = 0.001;
  return p < kPrintsAsZero ? "< 0.001" : significant(p, kDigits);
}

// Of a test; far below what anyone tells apart.
std::string p_value(double p) {
  constexpr double kSmallest = 1e-12;
  return p < kSmallest ? "< 1e-12" : significant(p, 2);
}

template <typename Items, typename Text>
std::string joined(const Items& items, Text text, const char* separator = ", ") {
  std::string all;
  for (const auto& item : items) (all += all.empty() ? "" : separator) += text(item);
  return all;
}

std::string joined(const std::vector<std::string>& items) {
  return joined(items, [](const std::string& item) { return item; });
}

std::string words(std::string_view key) {
  std::string text(key);
  std::replace(text.begin(), text.end(), '_', ' ');
  return text;
}

std::string minutes_or_hours(double seconds) {
  return seconds < core::kSecondsPerHour
             ? significant(seconds / 60.0, kDigits) + " min"
             : significant(seconds / core::kSecondsPerHour, kDigits) + " h";
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

std::string key_of(diagnosis::HeldOut kind) {
  switch (kind) {
    case diagnosis::HeldOut::kNothing:
      break;
    case diagnosis::HeldOut::kRecords:
      return "records";
    case diagnosis::HeldOut::kBlocks:
      return "blocks";
  }
  return "nothing";
}

std::string key_of(diagnosis::Acceptance acceptance) {
  switch (acceptance) {
    case diagnosis::Acceptance::kNothingToProve:
      break;
    case diagnosis::Acceptance::kAccepted:
      return "accepted";
    case diagnosis::Acceptance::kReverted:
      return "reverted";
    case diagnosis::Acceptance::kUnproven:
      return "unproven";
  }
  return "nothing_to_prove";
}

std::string told(diagnosis::HeldOut kind) {
  switch (kind) {
    case diagnosis::HeldOut::kNothing:
      break;
    case diagnosis::HeldOut::kRecords:
      return "held out: the records for validation";
    case diagnosis::HeldOut::kBlocks:
      return "held out: blocks of the record";
  }
  return "held out: nothing";
}

std::string told(const AxisDiagnosis& axis) {
  switch (axis.acceptance) {
    case diagnosis::Acceptance::kNothingToProve:
      break;
    case diagnosis::Acceptance::kAccepted:
      return "The change was accepted: data that took no part in choosing or fitting agrees.";
    case diagnosis::Acceptance::kReverted:
      return "The change was taken back: data that took no part in choosing or fitting did not "
             "agree. The model is left as it was.";
    case diagnosis::Acceptance::kUnproven:
      return "The change was taken back: nothing could be kept back to prove it on. The model is "
             "left as it was.";
  }
  return "Nothing was changed, so there was nothing to prove.";
}

std::string left_out(const AxisDiagnosis& axis) {
  const std::string count = std::to_string(axis.samples_left_out);
  return axis.samples_left_out == 1 ? count + " wild sample that stands alone was left out."
                                    : count + " wild samples that stand alone were left out.";
}

std::string sentence_of(const Diagnosed& axis) {
  const std::string& text = axis.of.sentence;
  const std::string lead = "Axis " + axis.axis + ": ";
  if (text.empty()) return lead + words(diagnosis::name(axis.of.verdict)) + ".";
  return text.starts_with("Axis ") || text.starts_with("axis ") ? text : lead + text;
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

// Named effects; else what was recalibrated; else what the unknown depends on.
std::string finding(const AxisDiagnosis& axis) {
  std::vector<std::string> found;
  for (const auto& effect : axis.effects) found.push_back(effect.name);
  for (const auto& change : axis.recalibrated) {
    const std::string text = change.name + " recalibrated";
    if (found.empty() || found.back() != text) found.push_back(text);
  }
  if (axis.unknown) {
    found.push_back("unknown" + (axis.unknown->depends_on.empty()
                                     ? std::string()
                                     : " in " + joined(axis.unknown->depends_on)));
  }
  return found.empty() ? "nothing" : joined(found);
}

// ----------------------------------------------------------------------------------- tables

// "axis" leads where several axes share a table.
class AxisTable {
 public:
  enum class Axes { kNamed, kOne };

  AxisTable(std::string caption, Axes axes, const std::vector<report::Column>& columns)
      : axes_(axes) {
    table_.caption = std::move(caption);
    if (axes_ == Axes::kNamed) table_.columns.push_back({"axis", Align::kLeft});
    table_.columns.insert(table_.columns.end(), columns.begin(), columns.end());
  }

  void add(const Diagnosed& axis, const std::vector<std::string>& cells, bool highlighted = false) {
    report::Row row{.cells = {}, .highlighted = highlighted};
    if (axes_ == Axes::kNamed) row.cells.push_back(axis.axis);
    row.cells.insert(row.cells.end(), cells.begin(), cells.end());
    table_.rows.push_back(std::move(row));
  }
  [[nodiscard]] bool empty() const { return table_.rows.empty(); }
  [[nodiscard]] report::Table take() { return std::move(table_); }

 private:
  Axes axes_;
  report::Table table_;
};

using Axes = AxisTable::Axes;
using Group = std::vector<Diagnosed>;

AxisTable gap_table(const Group& group, Axes axes) {
  AxisTable table("Measurement minus twin, RMS of the 60 s means, deg/h", axes,
                  {{"judged on", Align::kLeft},
                   {"before", Align::kRight},
                   {"after", Align::kRight},
                   {"after/before", Align::kRight},
                   {"noise alone", Align::kRight}});
  for (const Diagnosed& axis : group) {
    if (!axis.of.examined) continue;
    const auto add = [&](const std::string& judged, const Gap& gap) {
      table.add(axis, {judged, deg_h(gap.before_rms_radps), deg_h(gap.after_rms_radps),
                       gap.before_rms_radps > 0.0
                           ? significant(gap.after_rms_radps / gap.before_rms_radps, kDigits)
                           : "n/a",
                       deg_h(gap.noise_floor_rms_radps)});
    };
    add("the record it was fitted to", axis.of.fit);
    if (axis.of.held_out_kind != diagnosis::HeldOut::kNothing)
      add(told(axis.of.held_out_kind), axis.of.held_out);
    const auto& allan = axis.of.allan_log_distance;
    table.add(axis,
              {"Allan curves: mean |ln ratio|", significant(allan.before, kDigits),
               significant(allan.after, kDigits),
               allan.before > 0.0 ? significant(allan.after / allan.before, kDigits) : "n/a", ""});
  }
  return table;
}

AxisTable effect_table(const Group& group, Axes axes) {
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
                       significant(effect.log_evidence, kDigits)});
    }
  }
  return table;
}

AxisTable parameter_table(const Group& group, Axes axes) {
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
  return table;
}

AxisTable recalibration_table(const Group& group, Axes axes) {
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
                       significant(change.to, 4), significant(change.standard_error, 2)});
    }
  }
  return table;
}

AxisTable where_table(const Group& group) {
  AxisTable table("Where measurement and the twin as given disagree more than noise allows",
                  Axes::kOne,
                  {{"in", Align::kLeft},
                   {"from", Align::kRight},
                   {"to", Align::kRight},
                   {"unit", Align::kLeft},
                   {"excess", Align::kRight},
                   {"p", Align::kRight}});
  for (const Diagnosed& axis : group) {
    for (const auto& place : axis.of.where) {
      table.add(axis, {words(place.kind), significant(place.from, 4), significant(place.to, 4),
                       std::string(unit_of(place.kind)), significant(place.excess, kDigits),
                       p_value(place.p_value)});
    }
  }
  return table;
}

// Named or not; what was named is marked. The weakest are left out of a long list.
std::optional<report::Table> evidence_table(const Diagnosed& axis) {
  constexpr std::size_t kMostShown = 30;
  const auto& all = axis.of.evidence;
  if (all.empty()) return std::nullopt;
  AxisTable table("Candidates, strongest first; marked: named", Axes::kOne,
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
              {all[i].name, significant(all[i].log_evidence, kDigits),
               significant(all[i].separation, kDigits), deg_h(all[i].rms_radps)},
              named);
  }
  report::Table shown = table.take();
  shown.footnote = "f(...): any smooth function of these inputs, for what the catalogue lacks.";
  if (left_out > 0)
    shown.footnote += " " + std::to_string(left_out) + " weaker candidates are in the JSON.";
  return shown;
}

AxisTable not_testable_table(const Group& group) {
  AxisTable table("What this record can't tell", Axes::kOne,
                  {{"effect", Align::kLeft}, {"why", Align::kLeft}});
  for (const Diagnosed& axis : group) {
    for (const auto& effect : axis.of.not_testable) table.add(axis, {effect.name, effect.why});
  }
  return table;
}

AxisTable visible_table(const Group& group) {
  AxisTable table("The smallest effect that this record could have shown", Axes::kOne,
                  {{"effect", Align::kLeft}, {"RMS deg/h", Align::kRight}});
  for (const Diagnosed& axis : group) {
    for (const auto& effect : axis.of.could_have_seen)
      table.add(axis, {effect.name, deg_h(effect.rms_radps)});
  }
  return table;
}

report::Table summary_table(const Group& group) {
  AxisTable table("The axes", Axes::kNamed,
                  {{"verdict", Align::kLeft},
                   {"found", Align::kLeft},
                   {"model", Align::kLeft},
                   {"held-out gap, deg/h", Align::kRight}});
  for (const Diagnosed& axis : group) {
    const bool proved = axis.of.held_out_kind != diagnosis::HeldOut::kNothing;
    table.add(axis, {words(diagnosis::name(axis.of.verdict)), finding(axis.of), outcome(axis.of),
                     proved ? deg_h(axis.of.held_out.before_rms_radps) + " → " +
                                  deg_h(axis.of.held_out.after_rms_radps)
                            : "nothing held out"});
  }
  return table.take();
}

// --------------------------------------------------------------------------------- pictures

std::vector<double> in_deg_h(const std::vector<double>& radps) {
  std::vector<double> converted(radps.size());
  std::transform(radps.begin(), radps.end(), converted.begin(),
                 [](double value) { return deg_h_from_radps(value); });
  return converted;
}

std::vector<double> hours_since(const std::vector<double>& time_s, double start_s) {
  std::vector<double> hours(time_s.size());
  std::transform(time_s.begin(), time_s.end(), hours.begin(),
                 [&](double t) { return (t - start_s) / core::kSecondsPerHour; });
  return hours;
}

// a - b less its mean, in deg/h.
std::vector<double> centred_difference(const std::vector<double>& a, const std::vector<double>& b) {
  std::vector<double> difference(a.size(), kNaN);
  double sum = 0.0;
  double count = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    difference[i] = deg_h_from_radps(a[i] - b[i]);
    if (!std::isfinite(difference[i])) continue;
    sum += difference[i];
    count += 1.0;
  }
  for (double& value : difference) value -= count > 0.0 ? sum / count : 0.0;
  return difference;
}

// A curve only where both columns are whole, so that a page never fails for want of one.
void add_curve(report::Chart& chart, report::Curve curve) {
  if (curve.x.size() == curve.y.size() && !curve.x.empty())
    chart.curves.push_back(std::move(curve));
}

report::Chart time_chart(std::string title, std::string y_label) {
  return {.title = std::move(title), .x_label = "time (h)", .y_label = std::move(y_label)};
}

void add_waveforms(report::Document& page, const Diagnosed& axis) {
  const auto& w = axis.of.waveforms;
  const std::size_t size = w.time_s.size();
  if (size == 0 || w.measured_radps.size() != size || w.before_radps.size() != size ||
      w.after_radps.size() != size)
    return;
  const std::vector<double> hours = hours_since(w.time_s, w.time_s.front());
  report::Chart drift =
      time_chart("Measurement and twin, " + axis.name(), "rate less the true rate (deg/h)");
  add_curve(drift, {.name = "measured", .x = hours, .y = in_deg_h(w.measured_radps)});
  add_curve(drift, {.name = "twin before", .x = hours, .y = in_deg_h(w.before_radps)});
  add_curve(drift, {.name = "twin after", .x = hours, .y = in_deg_h(w.after_radps)});
  page.blocks.emplace_back(
      report::Figure{std::move(drift), "Means over 60 s, from the first one of the record on."});
  report::Chart gap =
      time_chart("What the twin leaves, " + axis.name(), "measurement less twin (deg/h)");
  add_curve(
      gap,
      {.name = "before", .x = hours, .y = centred_difference(w.measured_radps, w.before_radps)});
  add_curve(
      gap, {.name = "after", .x = hours, .y = centred_difference(w.measured_radps, w.after_radps)});
  page.blocks.emplace_back(
      report::Figure{std::move(gap), "Means over 60 s, each curve less its mean over the record."});
}

void add_residual(report::Document& page, const Diagnosed& axis) {
  if (!axis.of.residual) return;
  const auto& r = *axis.of.residual;
  report::Chart chart{.title = "What was missing against " + r.input + ", " + axis.name(),
                      .x_label = r.input,
                      .y_label = "measurement less twin (deg/h)"};
  add_curve(chart, {.name = "residual",
                    .x = r.value,
                    .y = in_deg_h(r.residual_radps),
                    .style = report::CurveStyle::kPoints});
  add_curve(chart, {.name = "explained", .x = r.value, .y = in_deg_h(r.explained_radps)});
  if (chart.curves.empty()) return;
  page.blocks.emplace_back(report::Figure{
      std::move(chart), "Points: what the twin as given leaves. Line: what the change explains."});
}

void add_allan(report::Document& page, const Diagnosed& axis) {
  const auto& a = axis.of.allan;
  report::Chart chart{.title = "Overlapping Allan deviation, " + axis.name(),
                      .x_label = "cluster time (s)",
                      .y_label = "deviation (deg/h)",
                      .x_scale = report::AxisScale::kLogarithmic,
                      .y_scale = report::AxisScale::kLogarithmic};
  add_curve(chart, {.name = "measured", .x = a.tau_s, .y = in_deg_h(a.measured_radps)});
  add_curve(chart, {.name = "twin before", .x = a.tau_s, .y = in_deg_h(a.before_radps)});
  add_curve(chart, {.name = "twin after", .x = a.tau_s, .y = in_deg_h(a.after_radps)});
  if (chart.curves.empty()) return;
  page.blocks.emplace_back(
      report::Figure{std::move(chart), "The drift as measured, and what the twin expects of it."});
}

void add_unknown(report::Document& page, const Diagnosed& axis) {
  if (!axis.of.unknown) return;
  const auto& unknown = *axis.of.unknown;
  page.blocks.emplace_back(report::Subheading{"What the catalogue doesn't know"});
  page.blocks.emplace_back(report::Paragraph{
      unknown.description +
      (unknown.depends_on.empty() ? std::string(". No input was found that it depends on")
                                  : ". It depends on " + joined(unknown.depends_on)) +
      "; its RMS over the record is " + deg_h(unknown.rms_radps) + " deg/h."});
  const std::string input = unknown.depends_on.empty() ? "input" : unknown.depends_on.front();
  report::Chart chart{.title = "Shape of the unknown effect, " + axis.name(),
                      .x_label = input,
                      .y_label = "unexplained rate (deg/h)"};
  add_curve(chart, {.name = "", .x = unknown.input, .y = in_deg_h(unknown.rate_radps)});
  if (!chart.curves.empty()) {
    page.blocks.emplace_back(
        report::Figure{std::move(chart), "The unexplained rate as a function of " + input + "."});
  }
}

void add_table(report::Document& page, AxisTable table) {
  if (!table.empty()) page.blocks.emplace_back(table.take());
}

// What each candidate's equation is, of those that were named or nearly so.
void add_equations(report::Document& page, const Diagnosed& axis) {
  for (const auto& effect : axis.of.effects) {
    const twin::EffectDefinition* definition = twin::find_effect(effect.name);
    if (definition == nullptr) continue;
    page.blocks.emplace_back(
        report::Paragraph{effect.name + ": " + definition->equation + ".", definition->source});
  }
}

void add_axis(report::Document& page, const Diagnosed& axis) {
  const Group one{axis};
  page.blocks.emplace_back(report::Heading{"Axis " + axis.axis});
  page.blocks.emplace_back(report::Paragraph{sentence_of(axis)});
  if (!axis.of.examined) {
    add_table(page, not_testable_table(one));
    return;
  }
  page.blocks.emplace_back(report::Paragraph{told(axis.of)});
  if (axis.of.samples_left_out > 0) page.blocks.emplace_back(report::Paragraph{left_out(axis.of)});
  add_table(page, gap_table(one, Axes::kOne));
  add_waveforms(page, axis);
  if (!axis.of.effects.empty()) {
    page.blocks.emplace_back(report::Subheading{"What was missing"});
    add_table(page, effect_table(one, Axes::kOne));
    add_equations(page, axis);
    add_table(page, parameter_table(one, Axes::kOne));
  }
  add_residual(page, axis);
  if (!axis.of.recalibrated.empty()) {
    page.blocks.emplace_back(report::Subheading{"What was recalibrated"});
    add_table(page, recalibration_table(one, Axes::kOne));
  }
  add_unknown(page, axis);
  page.blocks.emplace_back(report::Subheading{"Allan deviation"});
  add_allan(page, axis);
  page.blocks.emplace_back(report::Subheading{"Where they disagree"});
  if (axis.of.where.empty())
    page.blocks.emplace_back(report::Paragraph{"Nowhere by more than noise allows."});
  add_table(page, where_table(one));
  page.blocks.emplace_back(report::Subheading{"Evidence, and what it can't reach"});
  if (auto table = evidence_table(axis)) page.blocks.emplace_back(std::move(*table));
  add_table(page, not_testable_table(one));
  add_table(page, visible_table(one));
  if (axis.of.next_experiment.empty()) return;
  page.blocks.emplace_back(report::Subheading{"The next experiment"});
  page.blocks.emplace_back(report::Paragraph{axis.of.next_experiment});
}

std::string described(const RecordSummary& record) {
  std::string text = record.file + ": " + std::to_string(record.rows) + " samples, " +
                     minutes_or_hours(record.duration_s) + ", one every " +
                     significant(record.sample_period_s, kDigits) + " s";
  if (record.interval_s > record.sample_period_s)
    text += ", looked at as means over " + significant(record.interval_s, kDigits) + " s";
  text += record.probes.empty() ? "; no temperature" : "; temperatures " + joined(record.probes);
  return text + (record.has_reference ? "; with the true rate." : "; at rest, no true rate.");
}

// How the page is to be read, said once.
std::vector<std::string> reading_notes() {
  return {
      "The twin was run over the record's own temperatures, rates and other inputs. What is left "
      "between measurement and twin was then searched for, against noise that is not white: a "
      "slow wander of the size that this noise has by itself is no effect.",
      "RMS figures are of the 60 s means of measurement minus twin, less their mean over the "
      "record. Noise alone: what would be left of a perfect twin. Held out: no sample of it took "
      "part in choosing or fitting; a change that doesn't shrink its gap is taken back.",
      "ln evidence: natural logarithm of the Bayes factor against the model without the effect. "
      "Probability: that it is this effect, of all in the catalogue. It might also be: the rest of "
      "the 95 % set. d: the size of the effect's waveform in units of the noise; the smallest "
      "visible effects have d = 8. Excess: measured over expected mean square; p: that noise alone "
      "does it, corrected for the number of ranges looked at."};
}

// ------------------------------------------------------------------------------------- JSON

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
          {"alternatives",
           array_of(effect.alternatives,
                    [](const auto& other) {
                      return Json{{"name", other.name}, {"probability", number(other.probability)}};
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

Json json_of(const std::optional<diagnosis::UnknownEffect>& unknown) {
  if (!unknown) return nullptr;
  return {{"description", unknown->description},
          {"depends_on", unknown->depends_on},
          {"rms_deg_h", rate(unknown->rms_radps)},
          {"shape",
           {{"input", array_of(unknown->input, number)},
            {"rate_deg_h", array_of(unknown->rate_radps, rate)}}}};
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

std::vector<std::string> diagnosis_sentences(const DiagnosisResult& result) {
  std::vector<std::string> sentences;
  for (const Diagnosed& axis : axes_of(result)) sentences.push_back(sentence_of(axis));
  return sentences;
}

std::vector<report::Table> diagnosis_tables(const DiagnosisResult& result) {
  const Group group = axes_of(result);
  std::vector<report::Table> tables;
  for (auto* make : {gap_table, effect_table, parameter_table, recalibration_table}) {
    AxisTable table = make(group, Axes::kNamed);
    if (!table.empty()) tables.push_back(table.take());
  }
  return tables;
}

std::vector<std::string> diagnosis_notes(const DiagnosisResult& result) {
  std::vector<std::string> notes;
  for (const Diagnosed& axis : axes_of(result)) {
    const std::string lead = "Axis " + axis.axis + ": ";
    if (axis.of.samples_left_out > 0) notes.push_back(lead + left_out(axis.of));
    if (axis.of.acceptance != diagnosis::Acceptance::kNothingToProve)
      notes.push_back(lead + told(axis.of));
    if (axis.of.unknown) {
      notes.push_back(lead + "unknown to the catalogue: " + axis.of.unknown->description +
                      "; RMS " + deg_h(axis.of.unknown->rms_radps) + " deg/h.");
    }
    if (!axis.of.not_testable.empty()) {
      notes.push_back(lead + "not testable with this record: " +
                      joined(axis.of.not_testable, [](const auto& effect) { return effect.name; }) +
                      ".");
    }
    if (!axis.of.next_experiment.empty())
      notes.push_back(lead + "next experiment: " + axis.of.next_experiment);
  }
  return notes;
}

report::Document diagnosis_page(const DiagnosisResult& result) {
  const Group group = axes_of(result);
  report::Document page;
  page.title = "Diagnosis of a gyro's twin";
  page.subtitle = result.record.file + " against " + result.model +
                  (result.gyro.empty() ? "" : " (" + result.gyro + ")");
  page.verdict = joined(
      group, [](const Diagnosed& axis) { return sentence_of(axis); }, " ");
  page.blocks.emplace_back(summary_table(group));
  page.blocks.emplace_back(report::Heading{"What was looked at"});
  page.blocks.emplace_back(report::Paragraph{described(result.record)});
  for (const RecordSummary& record : result.validation)
    page.blocks.emplace_back(report::Paragraph{"For validation: " + described(record)});
  for (const std::string& warning : result.warnings)
    page.blocks.emplace_back(report::Paragraph{"Note: " + warning + "."});
  for (const Diagnosed& axis : group) add_axis(page, axis);
  page.blocks.emplace_back(report::Heading{"How to read this"});
  for (std::string& note : reading_notes())
    page.blocks.emplace_back(report::Paragraph{std::move(note)});
  return page;
}

Json diagnosis_json(const DiagnosisResult& result) {
  Json json{{"verdict", diagnosis::name(result.diagnosis.verdict)},
            {"model", result.model},
            {"record", result.record.file},
            {"validation",
             array_of(result.validation, [](const RecordSummary& record) { return record.file; })},
            {"model_changed", result.change == ModelChange::kRepaired},
            {"warnings", result.warnings}};
  json["axis"] = Json::object();
  for (const Diagnosed& axis : axes_of(result)) json["axis"][axis.axis] = json_of(axis.of);
  return json;
}

}  // namespace zerodrift::services
