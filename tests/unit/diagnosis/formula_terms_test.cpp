// SPDX-License-Identifier: Apache-2.0
// The grammar that a search of formulas looks through, and what a term of it is for the twin.
#include "common/diagnosis/formula_terms.h"

#include <gtest/gtest.h>

#include <cmath>
#include <variant>

#include "common/diagnosis/candidates.h"
#include "common/diagnosis/measured_series.h"
#include "common/twin/formula.h"
#include "tests/unit/diagnosis/simulated_series.h"

namespace zerodrift::diagnosis {
namespace {

constexpr core::Axis kX = core::Axis::kX;

std::vector<Operand> operands() {
  return {
      {.text = "T_coil", .has_zero = false, .is_temperature = true, .lowest = -5, .highest = 45},
      {.text = "rate(T_board)", .lowest = -0.03, .highest = 0.03},
      {.text = "T_coil_outer - T_coil_inner", .lowest = -2.0, .highest = 3.0},
      {.text = "B_x", .lowest = -200.0, .highest = 200.0},
      {.text = "supply", .has_zero = false, .lowest = 4.5, .highest = 5.5}};
}

std::vector<Factor> all_factors(const std::vector<Operand>& of) {
  std::vector<Factor> all;
  for (std::size_t o = 0; o < of.size(); ++o) {
    for (std::size_t f = 0; f < kFormCount; ++f) {
      for (const Factor& factor : grid_of(of[o], o, static_cast<Form>(f))) all.push_back(factor);
    }
  }
  return all;
}

// Every summand that a search may write is a formula of the model file: whatever is looked at can
// be written, read and simulated.
TEST(FormulaTermLaws, EveryTermIsAFormulaOfTheTwinWithOneAmplitude) {
  const std::vector<Operand> of = operands();
  const std::vector<Factor> factors = all_factors(of);
  std::size_t checked = 0;
  const auto check = [&](const Term& term) {
    const WrittenTerm text = written(term, of);
    const auto parsed = twin::parse_formula(text.formula);
    const auto* problem = std::get_if<twin::FormulaProblem>(&parsed);
    ASSERT_EQ(problem, nullptr) << text.formula << ": " << problem->text();
    const auto definition = definition_of(text, kX);
    EXPECT_EQ(names_of(*definition, twin::ParameterRole::kAmplitude),
              std::vector<std::string>{"k"});
    const auto shapes = names_of(*definition, twin::ParameterRole::kShape);
    EXPECT_EQ(shapes.size(), text.shapes.size()) << text.formula;
    for (const std::string& shape : shapes) EXPECT_TRUE(text.shapes.contains(shape)) << shape;
    ++checked;
  };
  for (std::size_t a = 0; a < factors.size(); ++a) {
    check({.factors = {factors[a]}});
    check({.factors = {factors[a]}, .lag_s = 100.0});
    for (std::size_t b = a % 7; b < factors.size(); b += 7) {
      if (factors[a].operand == factors[b].operand) continue;
      check({.factors = {factors[a], factors[b]}, .lag_s = b % 2 == 0 ? 30.0 : 0.0});
    }
  }
  EXPECT_GT(checked, 1000U);
}

TEST(FormulaTermLaws, ThePriorsOfTheWholeGrammarAreAtMostOne) {
  const std::vector<Operand> of = operands();
  const std::vector<Factor> factors = all_factors(of);
  const auto lags = static_cast<double>(lags_looked_at_s().size());
  double sum = 0.0;
  const auto add = [&](const Term& term) {
    sum += std::exp(log_prior_of(term, of));
    Term lagged = term;
    lagged.lag_s = 60.0;
    sum += lags * std::exp(log_prior_of(lagged, of));
  };
  for (std::size_t a = 0; a < factors.size(); ++a) {
    add({.factors = {factors[a]}});
    for (std::size_t b = 0; b < a; ++b) add({.factors = {factors[a], factors[b]}});
  }
  EXPECT_GT(sum, 0.5);
  EXPECT_LE(sum, 1.0);  // no factor twice, and a play of temperatures alone: rounding is far below
}

TEST(FormulaTermLaws, MoreChoicesCostMore) {
  const std::vector<Operand> of = operands();
  const Factor plain{.operand = 3};
  const Factor bent{.operand = 3, .form = Form::kTanh, .width = 50.0};
  const Factor other{.operand = 1};
  const double one = log_prior_of({.factors = {plain}}, of);
  EXPECT_LT(log_prior_of({.factors = {bent}}, of), one);
  EXPECT_LT(log_prior_of({.factors = {plain, other}}, of), one);
  EXPECT_LT(log_prior_of({.factors = {plain}, .lag_s = 60.0}, of), one);
}

TEST(FormulaTermScenario, IsWrittenAsAnEngineerWould) {
  const std::vector<Operand> of = operands();
  const Term term{.factors = {{0, Form::kTanh, 20.25, 4.0}, {3, Form::kPlain, 0.0, 0.0}}};
  EXPECT_EQ(written(term, of).formula, "k * tanh((T_coil - 20.25) / width) * B_x");
  EXPECT_EQ(written(term, of).shapes, (twin::Parameters{{"width", 4.0}}));
  const Term lagged{.factors = {{0, Form::kLag, -3.0, 600.0}, {2, Form::kSquare, 0.0, 0.0}},
                    .lag_s = 90.0};
  EXPECT_EQ(written(lagged, of).formula,
            "k * lag(lag(T_coil + 3, tau) * (T_coil_outer - T_coil_inner)^2, tau2)");
}

TEST(FormulaTermScenario, ACurveIsWrittenWithTheRangeItWasSeenOver) {
  const std::vector<Operand> of = {
      {.text = "T_board", .lowest = -3.25, .highest = 48.123456},
      {.text = "B_x", .has_zero = true},
      {.text = "supply", .has_zero = false, .lowest = 4.0, .highest = 6.0}};
  EXPECT_EQ(written({.over = 0, .parameters = 3}, of).formula,
            "spline(T_board, -3.25, 48.123, k1, k2, k3)");
  const WrittenTerm lagged = written({.over = 0, .by = 1, .lag_s = 60.0, .parameters = 3}, of);
  EXPECT_EQ(lagged.formula, "spline(lag(T_board, tau), -3.25, 48.123, k1, k2, k3) * B_x + k * B_x");
  EXPECT_EQ(lagged.shapes, (twin::Parameters{{"tau", 60.0}}));
  EXPECT_EQ(written({.over = 0, .by = 2, .parameters = 3}, of).formula,
            "spline(T_board, -3.25, 48.123, k1, k2, k3) * (supply - 5) + k * (supply - 5)");
  EXPECT_NE(written({.over = 0, .parameters = 11}, of).formula.find("k09, k10"), std::string::npos);
}

// Whatever an input's values, and the longest that there is.
TEST(FormulaTermAbuse, EveryCurveIsReadAgain) {
  for (const double middle : {0.0, 1e-9, -5.0, 99.99991, 1e6}) {
    for (const double half : {1e-8, 3e-5, 0.7, 1e4}) {
      const double least = 1e-9 * (std::abs(middle) + half);
      std::vector<Operand> of = {{.text = "rate(T_coil_outer)", .has_zero = false},
                                 {.text = "rate(T_coil_inner)", .has_zero = false}};
      for (Operand& operand : of) {
        operand.lowest = middle - std::max(half, least);
        operand.highest = middle + std::max(half, least);
      }
      for (const std::size_t count : {3U, 22U}) {
        const Curve curve{.over = 0, .by = 1, .lag_s = 60.0, .parameters = count};
        EXPECT_NE(definition_of(written(curve, of), kX), nullptr) << middle << " " << half;
      }
    }
  }
}

TEST(FormulaTermScenario, OperandsAreWhatMovesWhileTheAxisIsMeasured) {
  const MeasuredSeries record = test::simulated(test::lab_model(), test::chamber_profile(), 3);
  const Playback playback(record);
  std::vector<std::string> texts;
  for (const Operand& operand : operands_of(playback, record.valid[0], kX)) {
    texts.push_back(operand.text);
    EXPECT_LT(operand.lowest, operand.highest) << operand.text;
  }
  const auto has = [&](const std::string& text) {
    return std::find(texts.begin(), texts.end(), text) != texts.end();
  };
  EXPECT_TRUE(has("T_board") && has("rate(T_coil)") && has("B_y") && has("w_x") && has("supply"));
  EXPECT_FALSE(has("T_chamber")) << "nothing measures it";
  MeasuredSeries poor = record;
  poor.probes.clear();
  poor.supply_v.assign(poor.size, 5.0);
  for (auto& component : poor.magnetic_ut) component.clear();
  const Playback of_poor(poor);
  for (const Operand& operand : operands_of(of_poor, poor.valid[0], kX))
    EXPECT_TRUE(operand.text.starts_with("a_") || operand.text.starts_with("w_") ||
                operand.text == "vibration" || operand.text == "source_current")
        << operand.text;
}

// Before: the rate of a formula is bounded, so that a column for an amplitude of 1 was cut off.
TEST(FormulaTermAbuse, AColumnOfAFormulaInLargeUnitsIsWhole) {
  const MeasuredSeries record = test::simulated(test::lab_model(), test::chamber_profile(), 3);
  const Playback playback(record);
  const auto cube = definition_of(WrittenTerm{.formula = "k * B_x^3 * T_coil^2", .shapes = {}}, kX);
  const auto column =
      columns_of(playback, *cube, default_context(*cube, kX, record.interval_s)).front();
  for (std::size_t i = 0; i < column.size(); i += 97) {
    const auto& in = playback.inputs()[i];
    const double field = in.magnetic_ut[0];
    const double temperature =
        in.thermal.temperature_degc[twin::index(twin::TemperaturePoint::kCoil)];
    const double expected =
        core::radps_from_deg_h(field * field * field * temperature * temperature);
    EXPECT_NEAR(column[i], expected, 1e-12 * std::abs(expected)) << i;  // a few roundings
  }
}

}  // namespace
}  // namespace zerodrift::diagnosis
