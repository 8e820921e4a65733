// SPDX-License-Identifier: Apache-2.0
// A formula of a model file, `k * lag(T_coil - 18, tau) * B_x`: parsed once, then evaluated step by
// step. Nothing of it is code.
//
//   sum:     product (('+' | '-') product)*
//   product: factor (('*' | '/') factor)*
//   factor:  '-' factor | atom ('^' 1 to 6)?
//   atom:    number | input | parameter | '(' sum ')' | abs(sum) | tanh(sum) | exp(sum)
//            | rate(input) | lag(sum, constant) | lag(sum, constant, constant)
//            | play(sum, constant)
//            | spline(sum, from, to, parameter, ...)
//   constant: number | parameter
//   from, to: '-'? number
//
// Inputs: T_chamber, T_case, T_coil_outer, T_coil_inner, T_board, T_coil (°C); B_x, B_y, B_z (uT);
// a_x, a_y, a_z (m/s²); w_x, w_y, w_z (true rate, deg/s); vibration (g), source_current (mA),
// supply (V), time_on (s since power-on). All other identifiers are parameters. The result is in
// deg/h.
//
// lag(x, tau): first-order lag of tau s, steady at the first step. lag(x, rise, fall): the same, of
// `rise` s while x is above it and of `fall` s while x is below. rate(x): time derivative per s; of
// a temperature the thermometer's, else the difference of two steps, 0 at the first. play(x, w):
// backlash, moved by x as soon as it is w away from it. spline(x, a, b, k1, ..., kn): a curve over
// x from a to b, 0 at a, kn at b, and outside as at the nearer end: the sum of k_i N_i(x), where
// N_0 to N_n are the cubic B-splines over n - 2 equal intervals, 3 <= n <= 24 (b_spline.h).
//
// Each summand has one parameter as a factor that stands nowhere but as such a factor, or one
// spline, whose parameters stand nowhere else: the result is linear in these amplitudes. Units:
// what is added has one unit, tanh and exp take none; a number takes the unit beside it in a sum
// and has none in a product; a parameter has whichever is missing.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "common/core/axis.h"
#include "common/twin/effect.h"
#include "common/twin/temperature_point.h"

namespace zerodrift::twin {

inline constexpr std::string_view kFormulaKind = "formula";

enum class FormulaOperation : std::uint8_t {
  kNumber,
  kParameter,
  kInput,
  kAdd,
  kSubtract,
  kMultiply,
  kDivide,
  kNegate,
  kPower,
  kAbs,
  kTanh,
  kExp,
  kRate,
  kLag,
  kPlay,
  kSpline,
};

struct FormulaNode {
  FormulaOperation operation = FormulaOperation::kNumber;
  double number = 0.0;    // kNumber
  std::size_t which = 0;  // kParameter, kInput, kSpline: its place; kPower: the exponent
  std::size_t left = 0;   // operands: places of nodes before this one
  std::size_t right = 0;
  std::size_t third = 0;  // kLag: what `right` is where x is below
};

// How a parameter enters.
enum class FormulaUse : std::uint8_t {
  kAmplitude,
  kLag,               // time constant of a lag, s
  kTemperatureWidth,  // of a play of a temperature, °C
  kWidth,             // of another play
  kShape,             // anywhere else
};

struct FormulaParameter {
  std::string name;
  FormulaUse use = FormulaUse::kShape;
};

struct FormulaSpline {
  double from = 0.0;  // < to
  double to = 0.0;
  std::size_t first_parameter = 0;  // the others follow it
  std::size_t count = 0;
};

// Operands stand before what is made of them; the last node is the result.
struct Formula {
  static constexpr std::size_t kLongest = 400;  // characters
  static constexpr std::size_t kMostNodes = 64;
  static constexpr std::size_t kDeepest = 16;
  static constexpr std::size_t kMostParameters = 8;  // beside those of splines
  static constexpr std::size_t kFewestOfSplines = 3;
  static constexpr std::size_t kMostOfSplines = 24;  // of all together

  std::vector<FormulaNode> nodes{};
  std::vector<FormulaSpline> splines{};
  std::vector<FormulaParameter> parameters{};  // in the order of their first use
};

struct FormulaProblem {
  std::size_t position = 0;  // of a character, the first is 1
  std::string what;          // what was found and what would be right

  [[nodiscard]] std::string text() const;
};

// O(length).
[[nodiscard]] std::variant<Formula, FormulaProblem> parse_formula(std::string_view text);

// The names of all inputs, in the order of FormulaNode::which.
[[nodiscard]] std::span<const std::string> formula_inputs();

// Of an input: the temperature that it is, if it is one.
[[nodiscard]] std::optional<TemperaturePoint> formula_temperature(std::size_t input);

// The effect of a formula on one axis: its parameters by their roles, the temperatures it reads, in
// the order of their first use, and what a record must hold. The formula's temperatures are fixed:
// `inputs` of a context are not read.
[[nodiscard]] EffectDefinition formula_effect(const Formula& formula, const std::string& text,
                                              core::Axis axis);

// What `kind: formula` means without its formula: a function of inputs, none of them known.
[[nodiscard]] const EffectDefinition& formula_in_general();

}  // namespace zerodrift::twin
