// SPDX-License-Identifier: Apache-2.0
// What a search of formulas is made of: terms of one parameter, k times one or two functions of
// what a record has, each of one quantity, as text of the twin's own grammar (twin/formula.h).
//
//   operand:  an input, the rate of a temperature, the difference of two temperatures
//   factor:   u, u², u³, |u|, tanh(u/w), exp(-(u/w)²), exp(u/w), lag(u, tau), play(u, w),
//             lag(tanh(u/w), rise, fall) of an operand less a centre, u = x - c
//   term:     factor, factor * factor, or the lag of either
//
// The prior of a term is that of its choices, each of them uniform: one of four structures (one
// factor or two, a lag of them or none), of the operands, of the forms, of the values of a form
// that are looked at. So a term pays for the whole of the grammar that was searched.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/core/axis.h"
#include "common/diagnosis/playback.h"
#include "common/twin/effect.h"
#include "common/twin/effect_catalogue.h"

namespace zerodrift::diagnosis {

struct Operand {
  std::string text;  // of the grammar: "T_coil", "rate(T_coil)", "T_coil_outer - T_coil_inner"
  std::vector<std::string> channels{};  // as InputChannel::name has them
  bool has_zero = true;                 // else its values count from nowhere, as a temperature's
  bool is_temperature = false;          // in °C
  double lowest = 0.0;                  // over the record, in the grammar's units
  double highest = 0.0;

  [[nodiscard]] double middle() const { return 0.5 * (lowest + highest); }
  [[nodiscard]] double half_range() const { return 0.5 * (highest - lowest); }
};

// Of what moves while the axis is measured; without the time, which a drift of any noise follows.
[[nodiscard]] std::vector<Operand> operands_of(const Playback& playback,
                                               std::span<const std::uint8_t> valid,
                                               core::Axis axis);

enum class Form : std::uint8_t {
  kPlain,
  kSquare,
  kCube,
  kMagnitude,
  kTanh,
  kBump,
  kExp,
  kLag,
  kPlay,
  kCreep,  // to a state and back from it at speeds of their own, as water into a coating
};
inline constexpr std::size_t kFormCount = 10;

struct Factor {
  std::size_t operand = 0;
  Form form = Form::kPlain;
  double centre = 0.0;  // in the operand's unit
  double width = 0.0;   // of tanh, bump, exp and creep, of a play; s of a lag; else 0
  double rise_s = 0.0;  // of a creep
  double fall_s = 0.0;

  bool operator==(const Factor&) const = default;
};

struct Term {
  std::vector<Factor> factors{};  // one or two
  double lag_s = 0.0;             // of their product; 0: none

  bool operator==(const Term&) const = default;
};

// The same choices but for their values.
[[nodiscard]] bool same_structure(const Term& a, const Term& b);

// All values of a form at an operand that are looked at; empty where the form makes no sense of it.
// A factor by itself has no use for the centre of a plain operand.
[[nodiscard]] std::vector<Factor> grid_of(const Operand& operand, std::size_t place, Form form);
[[nodiscard]] std::span<const double> lags_looked_at_s();

// Natural logarithm.
[[nodiscard]] double log_prior_of(const Term& term, std::span<const Operand> operands);

// "k * tanh((T_board - 20.3) / width) * B_x", with the values of `width` and what else is no number
// in it. Centres have four digits, or more where the operand moves by less than a tenth of itself.
struct WrittenTerm {
  std::string formula;
  twin::Parameters shapes{};
};
[[nodiscard]] WrittenTerm written(const Term& term, std::span<const Operand> operands);

// A curve over an operand or its lag, times another one or not, as text of the grammar: "spline(
// T_coil, 12.31, 47.6, k1, ...)", "spline(lag(T_coil, tau), ...) * B_x + k * B_x", since a curve
// begins at 0.
struct Curve {
  std::size_t over = 0;
  std::optional<std::size_t> by{};
  double lag_s = 0.0;  // 0: none
  std::size_t parameters = 0;
};
[[nodiscard]] WrittenTerm written(const Curve& curve, std::span<const Operand> operands);

// The effect that a term is, of the twin's own evaluator.
[[nodiscard]] twin::DefinitionPtr definition_of(const WrittenTerm& term, core::Axis axis);

}  // namespace zerodrift::diagnosis
