// SPDX-License-Identifier: Apache-2.0
// What is written of a diagnosis: the keys and units that programs read, and what an engineer finds
// on the terminal and on the page.
#include "services/zerodrift/diagnosis_report.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <string>

#include "common/core/units.h"
#include "tests/unit/zerodrift/example_diagnosis.h"

namespace zerodrift::services {
namespace {

using diagnosis::AxisDiagnosis;
using Json = nlohmann::ordered_json;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

AxisDiagnosis& axis_x(DiagnosisResult& result) {
  return *result.diagnosis.axes[core::index(core::Axis::kX)];
}

std::set<std::string> keys_of(const Json& json) {
  std::set<std::string> keys;
  for (const auto& [key, value] : json.items()) keys.insert(key);
  return keys;
}

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

std::string terminal_text(const DiagnosisResult& result) {
  std::string text;
  for (const auto& sentence : diagnosis_sentences(result)) text += sentence + "\n";
  for (const auto& table : diagnosis_tables(result)) text += report::text_table(table);
  for (const auto& note : diagnosis_notes(result)) text += note + "\n";
  return text;
}

std::size_t count_figures(const report::Document& page) {
  return static_cast<std::size_t>(std::count_if(
      page.blocks.begin(), page.blocks.end(),
      [](const report::Block& block) { return std::holds_alternative<report::Figure>(block); }));
}

bool has_no_numbers_that_json_lacks(const Json& json) {
  if (json.is_number_float()) return std::isfinite(json.get<double>());
  return std::all_of(json.begin(), json.end(), [](const Json& inner) {
    return !(inner.is_structured() || inner.is_number_float()) ||
           has_no_numbers_that_json_lacks(inner);
  });
}

// ------------------------------------------------------------------------------------- JSON

TEST(DiagnosisJson, HasTheAgreedKeysOfAnAxisWhateverWasFound) {
  const Json json = diagnosis_json(example_diagnosis());
  EXPECT_EQ(json.at("verdict"), "effect_named");
  const std::set<std::string> agreed{"verdict",      "sentence",         "where",
                                     "effects",      "recalibrated",     "unknown",
                                     "gap",          "held_out_kind",    "acceptance",
                                     "not_testable", "could_have_seen",  "next_experiment",
                                     "evidence",     "samples_left_out", "taken_back"};
  EXPECT_EQ(keys_of(json.at("axis")), (std::set<std::string>{"x", "z"}));
  for (const auto* axis : {"x", "z"}) EXPECT_EQ(keys_of(json.at("axis").at(axis)), agreed) << axis;
  const Json& quiet = json.at("axis").at("z");
  EXPECT_EQ(quiet.at("verdict"), "consistent");
  EXPECT_TRUE(quiet.at("unknown").is_null());
  for (const auto* key :
       {"where", "effects", "recalibrated", "not_testable", "could_have_seen", "evidence"}) {
    EXPECT_TRUE(quiet.at(key).is_array()) << key;
    EXPECT_TRUE(quiet.at(key).empty()) << key;
  }
}

TEST(DiagnosisJson, TellsEffectsAndGapsInDegreesAnHour) {
  const Json axis = diagnosis_json(example_diagnosis()).at("axis").at("x");
  const Json& effect = axis.at("effects").at(0);
  EXPECT_EQ(keys_of(effect),
            (std::set<std::string>{"name", "probability", "alternatives", "inputs", "parameters",
                                   "standard_errors", "log_evidence", "share_of_gap"}));
  EXPECT_EQ(effect.at("name"), "shupe");
  EXPECT_EQ(effect.at("alternatives").at(0).at("name"), "coil_lag");
  EXPECT_DOUBLE_EQ(effect.at("parameters").at("coefficient_deg_h_min_per_degc"), 2.0);
  EXPECT_DOUBLE_EQ(effect.at("standard_errors").at("coefficient_deg_h_min_per_degc"), 0.03);
  // Twice through the conversion: a few ulp.
  const double ulps = 1e-14;
  const Json& gap = axis.at("gap");
  EXPECT_NEAR(gap.at("fit").at("before_rms_deg_h"), 1.9, ulps);
  EXPECT_NEAR(gap.at("held_out").at("after_rms_deg_h"), 0.1, ulps);
  EXPECT_NEAR(gap.at("held_out").at("noise_floor_rms_deg_h"), 0.08, ulps);
  EXPECT_DOUBLE_EQ(gap.at("allan_log_distance").at("after"), 0.05);
  EXPECT_NEAR(axis.at("could_have_seen").at(0).at("rms_deg_h"), 0.05, ulps);
  EXPECT_EQ(axis.at("held_out_kind"), "records");
  EXPECT_EQ(axis.at("acceptance"), "accepted");
  EXPECT_EQ(axis.at("recalibrated").at(0).at("from"), 0.01);
  EXPECT_EQ(axis.at("where").at(0).at("kind"), "temperature_rate");
}

// A zero would read as a perfect proof.
TEST(DiagnosisJson, WithoutHeldOutDataItsGapIsNull) {
  const Json held_out =
      diagnosis_json(example_diagnosis()).at("axis").at("z").at("gap").at("held_out");
  for (const auto* key : {"before_rms_deg_h", "after_rms_deg_h", "noise_floor_rms_deg_h"})
    EXPECT_TRUE(held_out.at(key).is_null()) << key;
}

TEST(DiagnosisJson, WhatIsNotFiniteIsNull) {
  DiagnosisResult result = example_diagnosis();
  AxisDiagnosis& axis = axis_x(result);
  axis.effects[0].standard_errors["coefficient_deg_h_min_per_degc"] = kNaN;
  axis.effects[0].log_evidence = std::numeric_limits<double>::infinity();
  axis.where[0].to = kNaN;
  axis.fit.after_rms_radps = kNaN;
  axis.recalibrated[0].from = kNaN;
  axis.evidence[0].separation = kNaN;
  const Json json = diagnosis_json(result);
  EXPECT_TRUE(has_no_numbers_that_json_lacks(json));
  const Json& effect = json.at("axis").at("x").at("effects").at(0);
  EXPECT_TRUE(effect.at("log_evidence").is_null());
  EXPECT_TRUE(effect.at("standard_errors").at("coefficient_deg_h_min_per_degc").is_null());
  EXPECT_EQ(Json::parse(json.dump()), json);
}

TEST(DiagnosisJson, TellsWhatTheUnknownDependsOnAndItsShape) {
  DiagnosisResult result = example_diagnosis();
  axis_x(result).unknown = {.description = "bump at 24 °C in temperature_coil",
                            .depends_on = {"temperature_coil"},
                            .rms_radps = core::radps_from_deg_h(0.5),
                            .input = {20.0, 24.0, 28.0},
                            .rate_radps = {0.0, core::radps_from_deg_h(1.0), 0.0}};
  const Json unknown = diagnosis_json(result).at("axis").at("x").at("unknown");
  EXPECT_EQ(unknown.at("depends_on"), Json::array({"temperature_coil"}));
  EXPECT_NEAR(unknown.at("rms_deg_h"), 0.5, 1e-14);
  EXPECT_EQ(unknown.at("shape").at("input").size(), 3U);
  EXPECT_NEAR(unknown.at("shape").at("rate_deg_h").at(1), 1.0, 1e-14);
}

diagnosis::UnknownEffect told_by_a_formula() {
  return {.description = "k * tanh((T_coil - 20.3) / width) * B_x",
          .depends_on = {"temperature_coil", "magnetic_x"},
          .rms_radps = core::radps_from_deg_h(0.5),
          .formulas = {{.name = "formula",
                        .probability = 0.9,
                        .alternatives = {{"formula k * T_coil * B_x", 0.1}},
                        .parameters = {{"k", 8e-4}, {"width", 4.0}},
                        .standard_errors = {{"k", 2e-5}},
                        .log_evidence = 80.0,
                        .formula = "k * tanh((T_coil - 20.3) / width) * B_x"}}};
}

TEST(DiagnosisJson, TellsTheFormulaOfAnUnknownWithItsParameters) {
  DiagnosisResult result = example_diagnosis();
  axis_x(result).unknown = told_by_a_formula();
  const Json unknown = diagnosis_json(result).at("axis").at("x").at("unknown");
  ASSERT_EQ(unknown.at("formulas").size(), 1U);
  const Json& formula = unknown.at("formulas").at(0);
  EXPECT_EQ(formula.at("formula"), "k * tanh((T_coil - 20.3) / width) * B_x");
  EXPECT_DOUBLE_EQ(formula.at("parameters").at("k"), 8e-4);
  EXPECT_DOUBLE_EQ(formula.at("standard_errors").at("k"), 2e-5);
  EXPECT_EQ(formula.at("alternatives").size(), 1U);
}

// --------------------------------------------------------------------------------- terminal

TEST(DiagnosisTerminal, TellsTheFormulaOfAnUnknownInALine) {
  DiagnosisResult result = example_diagnosis();
  axis_x(result).unknown = told_by_a_formula();
  EXPECT_TRUE(contains(terminal_text(result),
                       "Axis x: in deg/h, k * tanh((T_coil - 20.3) / width) * B_x with "
                       "k = 8.00e-4 ± 2.0e-5, width = 4.00; another formula does nearly as well."))
      << terminal_text(result);
}

TEST(DiagnosisTerminal, BeginsWithASentenceForEachAxis) {
  const auto sentences = diagnosis_sentences(example_diagnosis());
  ASSERT_EQ(sentences.size(), 2U);
  EXPECT_TRUE(sentences[0].starts_with("Axis x: shupe was missing")) << sentences[0];
  EXPECT_TRUE(sentences[1].starts_with("Axis z: nothing is missing")) << sentences[1];
}

TEST(DiagnosisTerminal, ASentenceThatNamesItsAxisIsNotLedInTwice) {
  DiagnosisResult result = example_diagnosis();
  axis_x(result).sentence = "Axis x lacks a Shupe effect.";
  EXPECT_EQ(diagnosis_sentences(result)[0], "Axis x lacks a Shupe effect.");
  axis_x(result).sentence = "";
  EXPECT_EQ(diagnosis_sentences(result)[0], "Axis x: effect named.");
}

TEST(DiagnosisTerminal, ShowsGapEffectsAndParametersInLinesThatFit) {
  const DiagnosisResult result = example_diagnosis();
  const std::string text = terminal_text(result);
  for (const auto* part : {"held out: other records", "2.00", "0.100", "shupe", "coil_lag (0.0200)",
                           "coefficient_deg_h_min_per_degc", "0.030", "c1_deg_h_per_degc",
                           "scale_factor, magnetic", "turn the table"})
    EXPECT_TRUE(contains(text, part)) << part << " is not in:\n" << text;
  for (const auto& table : diagnosis_tables(result)) {
    const std::string lines = report::text_table(table);
    for (std::size_t begin = 0; begin < lines.size();) {
      const std::size_t end = lines.find('\n', begin);
      EXPECT_LE(end - begin, 130U) << lines.substr(begin, end - begin);
      begin = end + 1;
    }
  }
}

// Before: consistent, with gaps of 0.
TEST(DiagnosisTerminal, WhatCanNotBeDiagnosedHasAVerdictOfItsOwnAndNoFigures) {
  DiagnosisResult result = example_diagnosis();
  AxisDiagnosis& axis = axis_x(result);
  axis = {};
  axis.verdict = diagnosis::Verdict::kUndecidable;
  axis.sentence = "This axis can't be diagnosed: only 20 % of the series is valid.";
  axis.examined = false;
  const Json json = diagnosis_json(result).at("axis").at("x");
  EXPECT_EQ(json.at("verdict"), "undecidable");
  EXPECT_TRUE(json.at("gap").at("fit").at("after_rms_deg_h").is_null());
  EXPECT_TRUE(json.at("gap").at("allan_log_distance").at("before").is_null());
  const report::Document page = diagnosis_page(result);
  EXPECT_FALSE(report::validate(page));
  const std::string html = report::html_of(page);
  EXPECT_TRUE(contains(html, "undecidable"));
  EXPECT_TRUE(contains(html, "only 20 % of the series is valid"));
  EXPECT_TRUE(contains(diagnosis_sentences(result)[0], "only 20 % of the series is valid"));
}

TEST(DiagnosisTerminal, WildSamplesThatWereLeftOutAreCounted) {
  DiagnosisResult result = example_diagnosis();
  axis_x(result).samples_left_out = 1;
  EXPECT_EQ(diagnosis_json(result).at("axis").at("x").at("samples_left_out"), 1);
  EXPECT_TRUE(contains(terminal_text(result), "1 wild sample that stands alone was left out"));
  EXPECT_TRUE(contains(report::html_of(diagnosis_page(result)), "1 wild sample"));
}

TEST(DiagnosisTerminal, AChangeThatWasTakenBackIsSaidToBe) {
  DiagnosisResult result = example_diagnosis();
  for (const auto acceptance :
       {diagnosis::Acceptance::kReverted, diagnosis::Acceptance::kUnproven}) {
    axis_x(result).acceptance = acceptance;
    EXPECT_TRUE(contains(terminal_text(result), "taken back"));
  }
  EXPECT_FALSE(contains(terminal_text(example_diagnosis()), "taken back"));
}

// ------------------------------------------------------------------------------------- page

TEST(DiagnosisPage, HasThePicturesAndTablesThatAnEngineerFiles) {
  const report::Document page = diagnosis_page(example_diagnosis());
  EXPECT_FALSE(report::validate(page));
  EXPECT_EQ(count_figures(page), 4U);  // drift, gap, residual, Allan; nothing of the quiet axis
  EXPECT_TRUE(contains(page.verdict, "shupe was missing"));
  EXPECT_TRUE(contains(page.verdict, "Axis z: nothing is missing"));
  const std::string html = report::html_of(page);
  for (const auto* part :
       {"twin before", "twin after", "temperature rate of coil (°C/min)",
        "Candidates, strongest first", "no reference rate in the record", "The smallest effect",
        "turn the table", "1 gap, the longest", "s M_tau(dT/dt)", "v.csv", "hysteresis", "cluster time"})
    EXPECT_TRUE(contains(html, part)) << part;
}

TEST(DiagnosisPage, EqualDiagnosesGiveEqualBytes) {
  EXPECT_EQ(report::html_of(diagnosis_page(example_diagnosis())),
            report::html_of(diagnosis_page(example_diagnosis())));
  EXPECT_EQ(diagnosis_json(example_diagnosis()).dump(), diagnosis_json(example_diagnosis()).dump());
}

TEST(DiagnosisPage, ShowsTheShapeOfTheUnknown) {
  DiagnosisResult result = example_diagnosis();
  axis_x(result).unknown = {.description = "bump at 24 °C in temperature_coil",
                            .depends_on = {"temperature_coil"},
                            .rms_radps = 1e-6,
                            .input = {20.0, 24.0, 28.0},
                            .rate_radps = {0.0, 5e-6, 0.0}};
  const report::Document page = diagnosis_page(result);
  EXPECT_EQ(count_figures(page), 5U);
  EXPECT_TRUE(contains(report::html_of(page), "bump at 24 °C"));
}

// Curves of unequal length or none at all, text that is markup, numbers that aren't finite.
TEST(DiagnosisPage, HostileContentsStillMakeAWholePage) {
  DiagnosisResult result = example_diagnosis();
  AxisDiagnosis& axis = axis_x(result);
  axis.sentence = "<script>alert(1)</script>";
  axis.waveforms.after_radps.pop_back();
  axis.allan.tau_s.clear();
  axis.residual->explained_radps.clear();
  axis.effects[0].name = "\"><i>";
  axis.effects[0].parameters["x"] = kNaN;
  axis.fit.before_rms_radps = kNaN;
  axis.unknown = {.description = "no shape", .rms_radps = kNaN};
  result.warnings.emplace_back("\xff broken \n line");
  const report::Document page = diagnosis_page(result);
  ASSERT_FALSE(report::validate(page));
  const std::string html = report::html_of(page);
  EXPECT_FALSE(contains(html, "<script>"));
  EXPECT_FALSE(contains(html, "\"><i>"));
  EXPECT_TRUE(html.ends_with("</html>\n"));
  EXPECT_EQ(count_figures(page), 1U);  // only the points of the residual are whole
}

// -------------------------------------------------------------------------------- the change

TEST(ModelChange, IsSeenInAnyPartOfAnEffectButItsOrigin) {
  twin::Model model;
  model.effects = {{.kind = "shupe",
                    .parameters = {{"coefficient_deg_h_min_per_degc", 1.0}},
                    .inputs = {"coil"}}};
  EXPECT_EQ(change_between(model, model), ModelChange::kUnchanged);
  const auto changed = [&](auto change) {
    twin::Model other = model;
    change(other.effects);
    return change_between(model, other) == ModelChange::kRepaired;
  };
  using Effects = std::vector<twin::EffectSpec>;
  EXPECT_TRUE(changed([](Effects& e) { e.push_back(e.front()); }));
  EXPECT_TRUE(changed([](Effects& e) { e.clear(); }));
  EXPECT_TRUE(changed([](Effects& e) { e[0].kind = "bias"; }));
  EXPECT_TRUE(changed([](Effects& e) { e[0].axis = core::Axis::kY; }));
  EXPECT_TRUE(changed([](Effects& e) { e[0].parameters.begin()->second += 1e-12; }));
  EXPECT_TRUE(changed([](Effects& e) { e[0].standard_errors["a"] = 1.0; }));
  EXPECT_TRUE(changed([](Effects& e) { e[0].inputs = {"case"}; }));
  EXPECT_FALSE(changed([](Effects& e) { e[0].origin.date = "2026-01-01"; }));
}

}  // namespace
}  // namespace zerodrift::services
