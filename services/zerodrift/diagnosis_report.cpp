// SPDX-License-Identifier: Apache-2.0
#include "services/zerodrift/diagnosis_report.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/core/not_known.h"
#include "common/core/units.h"
#include "common/report/numbers.h"
#include "common/twin/effect_catalogue.h"
#include "services/zerodrift/diagnosis_tables.h"
#include "services/zerodrift/diagnosis_words.h"

namespace zerodrift::services {
namespace {

using core::deg_h_from_radps;
using diagnosis::AxisDiagnosis;
using report::significant;

using core::kNaN;

// --------------------------------------------------------------------------------- sentences

std::string minutes_or_hours(double seconds) {
  return seconds < core::kSecondsPerHour
             ? significant(seconds / 60.0, kDiagnosisDigits) + " min"
             : significant(seconds / core::kSecondsPerHour, kDiagnosisDigits) + " h";
}

std::string outcome_text(const AxisDiagnosis& axis) {
  switch (axis.acceptance) {
    case diagnosis::Acceptance::kNothingToProve: break;
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

// The end of what is said of it; noise has none.
std::string with_rms(const diagnosis::UnknownEffect& unknown, const std::string& lead) {
  if (!std::isfinite(unknown.rms_radps)) return ".";
  return "; " + lead + in_deg_per_hour(unknown.rms_radps) + " deg/h.";
}

std::string left_out(const AxisDiagnosis& axis) {
  const std::string count = std::to_string(axis.samples_left_out);
  return axis.samples_left_out == 1 ? count + " wild sample that stands alone was left out."
                                    : count + " wild samples that stand alone were left out.";
}

std::string sentence_of(const Diagnosed& axis) {
  const std::string& text = axis.of.sentence;
  const std::string lead = "Axis " + axis.axis + ": ";
  if (text.empty()) return lead + spelled_out(diagnosis::name(axis.of.verdict)) + ".";
  return text.starts_with("Axis ") || text.starts_with("axis ") ? text : lead + text;
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
      (unknown.depends_on.empty() ? "" : ". It depends on " + joined(unknown.depends_on)) +
      with_rms(unknown, "its RMS over the record is ")});
  for (const auto& summand : unknown.formulas) {
    page.blocks.emplace_back(
        report::Paragraph{"In deg/h: " + formula_text(summand) +
                          ". It stands in the repaired model as an effect of kind formula; no "
                          "physics beyond it is claimed."});
  }
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

void add_table(report::Document& page, report::Table table) {
  if (!table.rows.empty()) page.blocks.emplace_back(std::move(table));
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
  const DiagnosedAxes one{axis};
  page.blocks.emplace_back(report::Heading{"Axis " + axis.axis});
  page.blocks.emplace_back(report::Paragraph{sentence_of(axis)});
  if (!axis.of.examined) {
    add_table(page, not_testable_table(one));
    return;
  }
  page.blocks.emplace_back(report::Paragraph{outcome_text(axis.of)});
  if (axis.of.samples_left_out > 0) page.blocks.emplace_back(report::Paragraph{left_out(axis.of)});
  add_table(page, gap_table(one, TableAxes::kOne));
  add_waveforms(page, axis);
  if (!axis.of.effects.empty()) {
    page.blocks.emplace_back(report::Subheading{"What was missing"});
    add_table(page, effect_table(one, TableAxes::kOne));
    add_equations(page, axis);
    add_table(page, parameter_table(one, TableAxes::kOne));
  }
  add_residual(page, axis);
  if (!axis.of.recalibrated.empty()) {
    page.blocks.emplace_back(report::Subheading{"What was recalibrated"});
    add_table(page, recalibration_table(one, TableAxes::kOne));
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
                     significant(record.sample_period_s, kDiagnosisDigits) + " s";
  if (record.interval_s > record.sample_period_s)
    text += ", looked at as means over " + significant(record.interval_s, kDiagnosisDigits) + " s";
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

}  // namespace

std::vector<std::string> diagnosis_sentences(const DiagnosisResult& result) {
  std::vector<std::string> sentences;
  for (const Diagnosed& axis : diagnosed_axes(result)) sentences.push_back(sentence_of(axis));
  return sentences;
}

std::vector<report::Table> diagnosis_tables(const DiagnosisResult& result) {
  const DiagnosedAxes group = diagnosed_axes(result);
  std::vector<report::Table> tables;
  for (auto* make : {gap_table, effect_table, parameter_table, recalibration_table}) {
    report::Table table = make(group, TableAxes::kNamed);
    if (!table.rows.empty()) tables.push_back(std::move(table));
  }
  return tables;
}

std::vector<std::string> diagnosis_notes(const DiagnosisResult& result) {
  std::vector<std::string> notes;
  for (const Diagnosed& axis : diagnosed_axes(result)) {
    const std::string lead = "Axis " + axis.axis + ": ";
    if (axis.of.samples_left_out > 0) notes.push_back(lead + left_out(axis.of));
    if (axis.of.acceptance != diagnosis::Acceptance::kNothingToProve)
      notes.push_back(lead + outcome_text(axis.of));
    if (axis.of.unknown) {
      notes.push_back(lead + "unknown to the catalogue: " + axis.of.unknown->description +
                      with_rms(*axis.of.unknown, "RMS "));
      for (const auto& summand : axis.of.unknown->formulas)
        notes.push_back(lead + "in deg/h, " + formula_text(summand) + ".");
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
  const DiagnosedAxes group = diagnosed_axes(result);
  report::Document page;
  page.title = "Diagnosis of a gyro's twin";
  page.subtitle = result.record.file + " against " + result.model +
                  (result.gyro.empty() ? "" : " (" + result.gyro + ")");
  page.doubts = measurement::lines_of(result.doubts);
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

}  // namespace zerodrift::services
