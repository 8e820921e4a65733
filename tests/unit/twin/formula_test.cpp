// SPDX-License-Identifier: Apache-2.0
// Formulas of model files: what is taken, what is refused and how, and what they add.
#include "common/twin/formula.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "common/core/units.h"
#include "common/twin/simulation.h"
#include "tests/fuzz/formula_generator.h"
#include "tests/support/allocation_count.h"
#include "tests/unit/twin/examples.h"
#include "tests/unit/twin/excited_inputs.h"

namespace zerodrift::twin {
namespace {

using examples::excited_inputs;
using examples::excited_record;
using examples::model_of;
using examples::run;

EffectSpec formula(const std::string& text, const Parameters& parameters) {
  return {.kind = "formula", .parameters = parameters, .formula = text};
}

std::string refusal(const std::string& text) {
  const auto parsed = parse_formula(text);
  const auto* problem = std::get_if<FormulaProblem>(&parsed);
  return problem == nullptr ? "taken" : problem->text();
}

std::string use_of(const std::string& text, const std::string& parameter) {
  const auto parsed = parse_formula(text);
  for (const FormulaParameter& p : std::get<Formula>(parsed).parameters) {
    if (p.name != parameter) continue;
    switch (p.use) {
      case FormulaUse::kAmplitude: return "amplitude";
      case FormulaUse::kLag: return "lag";
      case FormulaUse::kTemperatureWidth: return "temperature width";
      case FormulaUse::kWidth: return "width";
      case FormulaUse::kShape: return "shape";
    }
  }
  return "none";
}

// A rule of hand-written arithmetic beside each: what the formula adds at the n-th of some inputs,
// in deg/h.
TEST(FormulaScenario, AddsWhatItsArithmeticSays) {
  const auto record = excited_record(200, 1.0);
  const auto expect = [&](const std::string& text, const Parameters& parameters,
                          const auto& by_hand) {
    const auto added = run(formula(text, parameters), record, 1.0);
    for (std::size_t i = 0; i < record.size(); ++i) {
      const double wanted = by_hand(record[i]);
      // Rounding of a handful of operations on numbers of the result's size.
      ASSERT_NEAR(core::deg_h_from_radps(added[i]), wanted, 1e-12 * (1.0 + std::abs(wanted)))
          << text << " at " << i;
    }
  };
  const auto coil = index(TemperaturePoint::kCoil);
  expect("k * T_coil * B_x - 2*m*a_z^2", {{"k", 0.3}, {"m", 0.1}}, [&](const EffectInputs& in) {
    return 0.3 * in.thermal.temperature_degc[coil] * in.magnetic_ut[0] -
           0.2 * in.acceleration_mps2[2] * in.acceleration_mps2[2];
  });
  expect("k * abs(w_y) / (1 + (supply - 5)^2 / u)", {{"k", 2.0}, {"u", 0.5}},
         [](const EffectInputs& in) {
           const double off = in.supply_v - 5.0;
           return 2.0 * std::abs(in.true_rate_radps[1] / core::kRadPerDeg) /
                  (1.0 + off * off / 0.5);
         });
  expect("k * tanh(time_on / t) + c * exp(-vibration / v)",
         {{"k", 1.0}, {"t", 50.0}, {"c", 3.0}, {"v", 2.0}}, [](const EffectInputs& in) {
           return std::tanh(in.since_power_on_s / 50.0) + 3.0 * std::exp(-in.vibration_g / 2.0);
         });
  expect("k * rate(T_coil) * (source_current - 100)", {{"k", 60.0}}, [&](const EffectInputs& in) {
    return 60.0 * in.thermal.temperature_rate_degc_per_s[coil] * (in.source_current_ma - 100.0);
  });
}

// The catalogue's own effects, written as formulas, are the same to rounding.
TEST(FormulaLaws, WrittenAsACataloguedEffectItIsThatEffect) {
  const auto record = excited_record(3000, 1.0);
  const EffectSpec lagged = {
      .kind = "bias_temperature",
      .parameters = {{"c1_deg_h_per_degc", 0.05}, {"lag_s", 180.0}, {"reference_degc", 25.0}}};
  const auto expected = run(lagged, record, 1.0);
  const auto added =
      run(formula("c1 * lag(T_coil - 25, tau)", {{"c1", 0.05}, {"tau", 180.0}}), record, 1.0);
  for (std::size_t i = 0; i < record.size(); ++i) ASSERT_NEAR(added[i], expected[i], 1e-18) << i;
}

TEST(FormulaScenario, APlayFollowsWhenItsWidthIsTakenUp) {
  const auto effect =
      make_effect(formula("k * play(T_case, 2)", {{"k", 1.0}}), 1.0, NoiseStream(0, "none"));
  EffectInputs inputs;
  const std::vector<std::pair<double, double>> steps{{10, 10}, {11, 10},  {13, 11},
                                                     {12, 11}, {9.5, 11}, {8, 10}};
  for (const auto& [temperature, wanted] : steps) {
    inputs.thermal.temperature_degc[index(TemperaturePoint::kCase)] = temperature;
    EXPECT_NEAR(core::deg_h_from_radps(effect->step(inputs)), wanted, 1e-12) << temperature;
  }
}

TEST(FormulaScenario, ALagOfTwoConstantsIsSlowerOneWayThanTheOther) {
  const auto effect = make_effect(formula("k * lag(B_x, 10, fall)", {{"k", 1.0}, {"fall", 2.0}}),
                                  0.5, NoiseStream(0, "none"));
  EffectInputs inputs;
  double wanted = 3.0;  // steady at the first
  for (const double field : {3.0, 8.0, 8.0, 8.0, -1.0, -1.0, 2.5, 2.5}) {
    inputs.magnetic_ut[0] = field;
    wanted += (field - wanted) * (1.0 - std::exp(-0.5 / (field < wanted ? 2.0 : 10.0)));
    EXPECT_NEAR(core::deg_h_from_radps(effect->step(inputs)), wanted, 1e-12) << field;
  }
}

TEST(FormulaLaws, ALagOfTwoEqualConstantsIsALagOfOne) {
  const auto record = excited_record(3000, 1.0);
  const auto one = run(formula("k * lag(T_coil, 90)", {{"k", 1.0}}), record, 1.0);
  const auto two = run(formula("k * lag(T_coil, 90, 90)", {{"k", 1.0}}), record, 1.0);
  EXPECT_EQ(one, two);
}

// The recursion of Cox and de Boor as the book has it, over knots counted in intervals.
double cox_de_boor(std::size_t i, std::size_t degree, const std::vector<double>& knots, double x) {
  if (degree == 0) return knots[i] <= x && x < knots[i + 1] ? 1.0 : 0.0;
  const auto share = [&](double from, double to, double at) {
    return to > from ? (at - from) / (to - from) : 0.0;
  };
  return share(knots[i], knots[i + degree], x) * cox_de_boor(i, degree - 1, knots, x) +
         (knots[i + degree + 1] > knots[i + 1] ? 1.0 - share(knots[i + 1], knots[i + degree + 1], x)
                                               : 0.0) *
             cox_de_boor(i + 1, degree - 1, knots, x);
}

TEST(FormulaScenario, ASplineIsTheSumOfItsBSplinesAndKeepsItsEnds) {
  const std::vector<double> k{0.0, 1.5, -2.0, 0.25, 4.0, -1.0};  // the first is no parameter
  const std::vector<double> knots{0, 0, 0, 0, 1, 2, 3, 3, 3, 3};
  const auto effect =
      make_effect(formula("spline(T_board, -10, 20, k1, k2, k3, k4, k5)",
                          {{"k1", k[1]}, {"k2", k[2]}, {"k3", k[3]}, {"k4", k[4]}, {"k5", k[5]}}),
                  1.0, NoiseStream(0, "none"));
  EffectInputs inputs;
  for (double t = -20.0; t < 30.0; t += 0.37) {
    inputs.thermal.temperature_degc[index(TemperaturePoint::kBoard)] = t;
    double wanted = t < -10.0 ? 0.0 : t >= 20.0 ? k.back() : 0.0;
    for (std::size_t i = 0; i < k.size() && t >= -10.0 && t < 20.0; ++i)
      wanted += k[i] * cox_de_boor(i, 3, knots, (t + 10.0) / 10.0);
    ASSERT_NEAR(core::deg_h_from_radps(effect->step(inputs)), wanted, 1e-12) << t;
  }
}

TEST(FormulaLaws, TheParametersOfASplineAreItsAmplitudes) {
  const std::string text = "spline(T_coil, 0, 50, a, b, c) * lag(B_x, tau) + k * T_coil";
  for (const char* parameter : {"a", "b", "c", "k"})
    EXPECT_EQ(use_of(text, parameter), "amplitude");
  EXPECT_EQ(use_of(text, "tau"), "lag");
}

TEST(FormulaScenario, TheRateOfAFieldIsTheDifferenceOfTwoSteps) {
  const auto effect =
      make_effect(formula("k * rate(B_y)", {{"k", 1.0}}), 0.5, NoiseStream(0, "none"));
  EffectInputs inputs;
  for (const auto& [field, wanted] : {std::pair{4.0, 0.0}, {5.0, 2.0}, {5.0, 0.0}, {2.0, -6.0}}) {
    inputs.magnetic_ut[1] = field;
    EXPECT_NEAR(core::deg_h_from_radps(effect->step(inputs)), wanted, 1e-12) << field;
  }
}

TEST(FormulaLaws, ItsParametersEnterAsItsFormSays) {
  const std::string text = "k * lag(T_coil - t0, tau) * B_x / (1 + play(T_board, w) / v) - j*a_z^2";
  EXPECT_EQ(use_of(text, "k"), "amplitude");
  EXPECT_EQ(use_of(text, "j"), "amplitude");
  EXPECT_EQ(use_of(text, "t0"), "shape");
  EXPECT_EQ(use_of(text, "tau"), "lag");
  EXPECT_EQ(use_of(text, "w"), "temperature width");
  EXPECT_EQ(use_of("k * lag(T_coil, rise, fall)", "fall"), "lag");
  EXPECT_EQ(use_of("k * play(a_x, w) * g", "w"), "width");
  EXPECT_EQ(use_of("k * play(a_x, w) * g", "g"), "shape");
}

TEST(FormulaLaws, TheEffectNamesItsTemperaturesAndNeeds) {
  const auto definition = definition_of(
      formula("k * T_board * B_x + j * (T_coil - T_board) * w_x + l * rate(supply) * w_y", {}));
  ASSERT_NE(definition, nullptr);
  EXPECT_EQ(definition->inputs,
            (std::vector<TemperaturePoint>{TemperaturePoint::kBoard, TemperaturePoint::kCoil}));
  EXPECT_EQ(definition->needs,
            (std::vector<Need>{Need::kTemperature, Need::kMagnetic, Need::kReferenceRate,
                               Need::kSupply, Need::kCrossAxisRate}));
}

TEST(FormulaAbuse, ARefusalNamesThePlaceWhatWasFoundAndWhatIsRight) {
  EXPECT_EQ(refusal("k * T_coil +"),
            "at character 13: found the end, expected a number, an input, a parameter, a function "
            "or '('");
  EXPECT_EQ(refusal("k * T_coli"),
            "at character 5: no input is called 'T_coli'; did you mean 'T_coil'?");
  EXPECT_EQ(refusal("k * suply"),
            "at character 5: no input is called 'suply'; did you mean "
            "'supply'?");
  EXPECT_EQ(refusal("k * sin(T_coil)"),
            "at character 5: no function is called 'sin'; valid: abs, tanh, exp, rate, lag, play, "
            "spline");
  EXPECT_EQ(refusal("k * exp(T_coil)"),
            "at character 9: found degC in exp, expected none; a parameter as a factor or divisor "
            "takes it away");
  EXPECT_EQ(refusal("k * (T_coil + B_x)"),
            "at character 13: found degC and uT in one sum, expected one unit; a parameter as a "
            "factor takes any");
  EXPECT_EQ(refusal("k * T_coil + T_board * 3"),
            "at character 14: found a summand without a parameter of its own as a factor, expected "
            "one as the k of k * T_coil");
  EXPECT_EQ(refusal("k * T_coil^7"), "at character 12: found '7', expected a power of 1 to 6");
  EXPECT_EQ(refusal("k * T_coil^2.5"), "at character 12: found '2', expected a power of 1 to 6");
  EXPECT_EQ(refusal("k * ((T_coil^6)^4)^6"),
            "at character 5: found the unit degC^144, expected powers of a unit up to 24");
  EXPECT_EQ(refusal("k * ((T_coil^6)^4)"), "taken");
  EXPECT_EQ(refusal("k * lag(T_coil, B_x)"),
            "at character 17: found 'B', expected a number or a parameter as the second argument "
            "of lag");
  EXPECT_EQ(refusal("k * lag(T_coil, 60, B_x)"),
            "at character 21: found 'B', expected a number or a parameter as the third argument "
            "of lag");
  EXPECT_EQ(refusal("k * lag(T_coil, 60, 2e5)"),
            "at character 21: found a lag of 2e+05 s, expected at most 1e5 s");
  EXPECT_EQ(refusal("k * play(T_coil, 1, 2)"), "at character 19: found ',', expected ')'");
  EXPECT_EQ(refusal("k * rate(T_coil + 1)"), "at character 17: found '+', expected ')'");
  EXPECT_EQ(refusal("k * rate(k)"),
            "at character 10: found 'k', expected the name of an input: rate takes nothing else");
  EXPECT_EQ(refusal("k * T_coil; x"),
            "at character 11: found ';', expected an operator or the end");
  EXPECT_EQ(refusal("k * 1e13 * T_coil"),
            "at character 5: found a number beyond 1e12 or none, expected one like 18 or 2.5e-3");
  EXPECT_NE(refusal("k * 3").find("reads no input"), std::string::npos);
  EXPECT_NE(refusal("").find("at character 1: found the end"), std::string::npos);
}

TEST(FormulaAbuse, ASplineThatIsNoneIsRefused) {
  EXPECT_EQ(refusal("spline(T_coil, 0, 50, a, b)"),
            "at character 1: found a spline of 2 parameters, expected 3 or more");
  EXPECT_EQ(refusal("spline(T_coil, 50, -5, a, b, c)"),
            "at character 19: found a spline from 50 to -5, expected an end above its begin");
  EXPECT_EQ(refusal("spline(T_coil, t, 50, a, b, c)"),
            "at character 16: found 't', expected a number: an end of the spline");
  EXPECT_EQ(refusal("spline(T_coil, 0, 50, a, b, 3)"),
            "at character 29: found '3', expected a parameter of the spline");
  EXPECT_EQ(refusal("spline(T_coil, 0, 50, a, b, B_x)"),
            "at character 29: found 'B', expected a parameter of the spline");
  EXPECT_EQ(refusal("spline(T_coil, 0, 50, a, b, a)"),
            "at character 29: found 'a' once more, expected a parameter of the spline's own");
  EXPECT_EQ(refusal("spline(T_coil, 0, 50, a, b, c) * tanh(B_x / a)"),
            "at character 1: found 'a' in a spline and elsewhere, expected it in the spline alone");
  EXPECT_EQ(refusal("k * spline(T_coil, 0, 50, a, b, c)"),
            "at character 1: found a spline beside another factor that is fitted, expected one of "
            "them: the spline's parameters are its size");
  for (const char* text :
       {"k * tanh(spline(T_coil, 0, 50, a, b, c))", "spline(T_coil, 0, 50, a, b, c)^2 * k",
        "k * T_coil / spline(T_coil, 0, 50, a, b, c)"}) {
    EXPECT_EQ(refusal(text),
              "at character 1: found a spline within a function or power, expected it as a factor "
              "of a summand");
  }
  std::string many = "spline(T_coil, 0, 50";
  for (int i = 0; i < 24; ++i) many += ", k" + std::to_string(i);
  EXPECT_EQ(refusal(many + ")"), "taken");
  EXPECT_NE(refusal(many + ", k24)").find("more than 24"), std::string::npos);
}

TEST(FormulaAbuse, WhatIsTooLongDeepOrManyIsRefused) {
  EXPECT_NE(refusal(std::string(401, 'k')).find("401 characters"), std::string::npos);
  const std::string open(18, '(');
  const std::string close(18, ')');
  EXPECT_NE(refusal("k * " + open + "T_coil" + close).find("more than 16"), std::string::npos);
  EXPECT_NE(refusal("k * " + std::string(18, '-') + "T_coil").find("more than 16"),
            std::string::npos);
  std::string many = "k*B_x";
  for (int i = 0; i < 40; ++i) many += "*B_x";
  EXPECT_NE(refusal(many).find("more than 64"), std::string::npos);
  std::string parameters = "k*B_x";
  for (int i = 0; i < 8; ++i) parameters += "+p" + std::to_string(i) + "*B_y";
  EXPECT_NE(refusal(parameters).find("at most 8 are taken"), std::string::npos);
}

TEST(FormulaAbuse, AModelsValuesAreAllOrNone) {
  const auto problem = [](const EffectSpec& spec) {
    return model_of({spec}).validate().value_or("valid");
  };
  EXPECT_EQ(problem(formula("k * lag(T_coil, tau)", {})), "valid");
  EXPECT_EQ(problem(formula("k * lag(T_coil, tau)", {{"k", 1.0}})),
            "effects[0].parameters.tau: must be given, as all of a formula's parameters or none");
  EXPECT_EQ(problem(formula("k * (T_coil - t0)^2", {})),
            "effects[0].parameters.t0: must be given, or a number in its place in the formula: a "
            "record finds factors of summands, time constants of lags and widths of plays of a "
            "temperature only");
  EXPECT_EQ(problem(formula("k * T_coil", {{"K", 1.0}})),
            "effects[0].parameters.K: 'formula' has no such parameter; valid: k");
  EXPECT_EQ(problem(formula("", {{"k", 1.0}})).find("effects[0].formula: at character 1"), 0U);
  EffectSpec other = examples::effect("bias", {{"bias_deg_h", 1.0}});
  other.formula = "k * T_coil";
  EXPECT_EQ(problem(other), "effects[0].formula: only kind 'formula' has one, found 'bias'");
  EffectSpec listed = formula("k * T_coil", {{"k", 1.0}});
  listed.inputs = {"board"};
  EXPECT_EQ(problem(listed),
            "effects[0].inputs: a formula names its temperatures itself, found a list");
}

// An input that is missing gives no rate and leaves the states; what is finite gives a finite one.
TEST(FormulaLaws, WhatIsMissingPassesAndAPoleAddsNothing) {
  const auto effect = make_effect(formula("k * lag(T_coil, 100) + j * B_x / B_y + l * exp(B_x / u)",
                                          {{"k", 1.0}, {"j", 1.0}, {"l", 1.0}, {"u", 1e-3}}),
                                  1.0, NoiseStream(0, "none"));
  EffectInputs inputs;
  inputs.thermal.temperature_degc.fill(20.0);
  EXPECT_NEAR(core::deg_h_from_radps(effect->step(inputs)), 21.0, 1e-9);  // 20, pole, exp(0)
  inputs.thermal.temperature_degc.fill(std::numeric_limits<double>::quiet_NaN());
  EXPECT_TRUE(std::isnan(effect->step(inputs)));
  inputs.thermal.temperature_degc.fill(20.0);
  EXPECT_NEAR(core::deg_h_from_radps(effect->step(inputs)), 21.0, 1e-9);
  inputs.magnetic_ut[0] = 50.0;  // exp(50 000)
  EXPECT_NEAR(core::deg_h_from_radps(effect->step(inputs)), 1e6, 1e-3);
}

TEST(FormulaLaws, RunTwiceItGivesTheSameBitsAndTakesNoMemory) {
  const EffectSpec spec =
      formula("k * lag(T_coil - 18, tau) * B_x + j * play(T_board, w) * rate(a_z)",
              {{"k", 0.1}, {"tau", 60.0}, {"j", 0.2}, {"w", 3.0}});
  const auto record = excited_record(2000, 0.1);
  const auto first = make_effect(spec, 0.1, NoiseStream(1, "a"));
  const auto second = make_effect(spec, 0.1, NoiseStream(2, "b"));
  const std::size_t before = allocation_count();
  for (const EffectInputs& inputs : record) {
    const double a = first->step(inputs);
    const double b = second->step(inputs);
    ASSERT_EQ(std::bit_cast<std::uint64_t>(a), std::bit_cast<std::uint64_t>(b));
  }
  EXPECT_EQ(allocation_count(), before);
}

TEST(FormulaLaws, ASimulationAddsItToTheTrueDrift) {
  const Model without = model_of({});
  const Model with = model_of({formula("k * (T_coil - 20)", {{"k", 2.0}})});
  const Profile profile = examples::heating_and_cooling();
  GyroSimulation plain(without, profile, 1, 1.0);
  GyroSimulation added(with, profile, 1, 1.0);
  double largest = 0.0;
  while (const auto sample = added.next()) {
    const auto other = plain.next();
    ASSERT_TRUE(other);
    const double more = core::deg_h_from_radps(sample->rate_radps[0] - other->rate_radps[0]);
    const double coil = added.inputs().thermal.temperature_degc[index(TemperaturePoint::kCoil)];
    ASSERT_NEAR(more, 2.0 * (coil - 20.0), 1e-6);
    largest = std::max(largest, std::abs(more));
  }
  EXPECT_GT(largest, 10.0) << "there must be something to compare";
}

// 20 000 formulas by the grammar: each is taken or refused in a line that points into it, adds 0 at
// amplitudes 0, and scales with them.
TEST(FormulaAbuse, WhateverTheGrammarGivesIsBoundedAndLinearInItsAmplitudes) {
  const auto record = excited_record(30, 1.0);
  std::size_t taken = 0;
  std::size_t with_spline = 0;
  std::vector<std::uint8_t> choices(60);
  for (std::uint64_t n = 0; n < 20'000; ++n) {
    const NoiseStream stream(n, "formula");
    for (std::size_t i = 0; i < choices.size(); ++i)
      choices[i] = static_cast<std::uint8_t>(255.0 * stream.uniform(i));
    const std::string text = fuzz::FormulaGenerator(choices).formula();
    const auto parsed = parse_formula(text);
    if (const auto* problem = std::get_if<FormulaProblem>(&parsed)) {
      ASSERT_GE(problem->position, 1U) << text;
      ASSERT_LE(problem->position, text.size() + 1) << text;
      continue;
    }
    ++taken;
    if (!std::get<Formula>(parsed).splines.empty()) ++with_spline;
    Parameters once, twice, none;
    for (const FormulaParameter& p : std::get<Formula>(parsed).parameters) {
      const bool is_amplitude = p.use == FormulaUse::kAmplitude;
      once[p.name] = 0.25;
      twice[p.name] = is_amplitude ? 0.5 : 0.25;
      none[p.name] = is_amplitude ? 0.0 : 0.25;
    }
    const auto single = run(formula(text, once), record, 1.0);
    const auto doubled = run(formula(text, twice), record, 1.0);
    const auto nothing = run(formula(text, none), record, 1.0);
    const double bound = core::radps_from_deg_h(1e6);
    for (std::size_t i = 0; i < record.size(); ++i) {
      ASSERT_TRUE(std::isfinite(single[i])) << text;
      ASSERT_EQ(nothing[i], 0.0) << text;
      // Twice a factor is exact but for numbers next to 0; only the bound isn't linear.
      if (std::abs(doubled[i]) < 0.999 * bound) {
        ASSERT_NEAR(doubled[i], 2.0 * single[i], 1e-300) << text;
      }
    }
  }
  EXPECT_GT(taken, 5000U);
  EXPECT_GT(with_spline, 300U);
}

}  // namespace
}  // namespace zerodrift::twin
