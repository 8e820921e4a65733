// SPDX-License-Identifier: Apache-2.0
// Input: 't' and a formula of a model file, or 'g' and the choices that make one by its grammar.
// What is taken runs over inputs of all kinds and stays bounded.
#include "common/twin/formula.h"

#include <cmath>
#include <limits>
#include <string>

#include "common/core/units.h"
#include "common/twin/effect_catalogue.h"
#include "tests/fuzz/expectations.h"
#include "tests/fuzz/formula_generator.h"

namespace zerodrift::fuzz {
namespace {

twin::EffectInputs inputs_with(std::uint64_t sample, double value) {
  twin::EffectInputs inputs;
  inputs.sample = sample;
  inputs.time_s = inputs.since_power_on_s = static_cast<double>(sample);
  inputs.thermal.temperature_degc.fill(value);
  inputs.thermal.temperature_rate_degc_per_s.fill(1e-3 * value);
  inputs.magnetic_ut.fill(-value);
  inputs.acceleration_mps2.fill(value);
  inputs.true_rate_radps.fill(value);
  inputs.vibration_g = inputs.supply_v = value;
  return inputs;
}

// Finite inputs give a rate within bounds, also after inputs that are none.
void run_over_wild_inputs(twin::Effect& effect) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  const double bound_radps = 1.0001 * core::radps_from_deg_h(1e6);
  std::uint64_t sample = 0;
  for (const double value : {20.0, 0.0, -40.0, 1e30, kNone, 1e-300, -1e30, 20.0, 1e9, 0.0}) {
    const double rate = effect.step(inputs_with(sample++, value));
    if (std::isfinite(value))
      demand(std::abs(rate) <= bound_radps, "finite inputs give a bounded rate");
  }
}

}  // namespace

void formula(Bytes input) {
  if (input.empty()) return;
  const std::string text = input.front() == 'g' ? FormulaGenerator(input.subspan(1)).formula()
                                                : std::string(as_text(input.subspan(1)));
  const auto parsed = twin::parse_formula(text);
  if (const auto* wrong = std::get_if<twin::FormulaProblem>(&parsed)) {
    demand(wrong->position <= text.size() + 1, "a refusal points into the formula");
    return demand_one_line(wrong->text());
  }
  twin::EffectSpec spec{.kind = "formula", .formula = text};
  double value = -3.0;
  for (const auto& parameter : std::get<twin::Formula>(parsed).parameters)
    spec.parameters[parameter.name] = std::abs(value += 1.0);
  demand(!spec.find_problem(), "a formula with all its values is an effect");
  run_over_wild_inputs(*twin::make_effect(spec, 1.0, twin::NoiseStream(0, "none")));
}

}  // namespace zerodrift::fuzz
