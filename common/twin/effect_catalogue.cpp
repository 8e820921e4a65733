// SPDX-License-Identifier: Apache-2.0
#include "common/twin/effect_catalogue.h"

#include <algorithm>
#include <stdexcept>
#include <utility>
#include <vector>

#include "common/twin/formula.h"

// One line an effect: effects/<name>.cpp defines EffectDefinition effects::<name>(), which is its
// kind.
#define ZERODRIFT_FOR_EACH_EFFECT(X) \
  X(bias)                            \
  X(bias_temperature)                \
  X(shupe)                           \
  X(coil_lag)                        \
  X(gradient)                        \
  X(gradient_rate)                   \
  X(shupe_temperature)               \
  X(sensor_lag)                      \
  X(hysteresis)                      \
  X(warm_up)                         \
  X(scale_factor)                    \
  X(scale_factor_temperature)        \
  X(scale_factor_nonlinearity)       \
  X(scale_factor_asymmetry)          \
  X(misalignment)                    \
  X(dead_band)                       \
  X(quantization)                    \
  X(angle_random_walk)               \
  X(noise_temperature)               \
  X(bias_instability)                \
  X(rate_random_walk)                \
  X(rate_ramp)                       \
  X(markov)                          \
  X(telegraph)                       \
  X(bias_step)                       \
  X(line)                            \
  X(duty_cycle)                      \
  X(vibration_rectification)         \
  X(acceleration_sensitivity)        \
  X(magnetic)                        \
  X(source_intensity)                \
  X(temperature_step)                \
  X(etalon_fringe)                   \
  X(modulator_reset)                 \
  X(spikes)                          \
  X(saturation)                      \
  X(dropped_samples)                 \
  X(rounding)                        \
  X(clock_offset)

namespace zerodrift::twin {
namespace effects {

#define ZERODRIFT_DECLARE(name) EffectDefinition name();
ZERODRIFT_FOR_EACH_EFFECT(ZERODRIFT_DECLARE)
#undef ZERODRIFT_DECLARE

}  // namespace effects

namespace {

EffectDefinition of_kind(std::string kind, EffectDefinition definition) {
  definition.kind = std::move(kind);
  return definition;
}

}  // namespace

std::span<const EffectDefinition> effect_catalogue() {
#define ZERODRIFT_DEFINITION(name) of_kind(#name, effects::name()),
  static const std::vector<EffectDefinition> kCatalogue{
      ZERODRIFT_FOR_EACH_EFFECT(ZERODRIFT_DEFINITION)};
#undef ZERODRIFT_DEFINITION
  return kCatalogue;
}

const EffectDefinition* find_effect(std::string_view kind) {
  if (kind == kFormulaKind) return &formula_in_general();
  const auto all = effect_catalogue();
  const auto found = std::find_if(all.begin(), all.end(),
                                  [kind](const EffectDefinition& d) { return d.kind == kind; });
  return found == all.end() ? nullptr : &*found;
}

DefinitionPtr definition_of(const EffectSpec& spec) {
  if (spec.kind != kFormulaKind) return {DefinitionPtr(), find_effect(spec.kind)};
  const auto parsed = parse_formula(spec.formula);
  const auto* formula = std::get_if<Formula>(&parsed);
  if (formula == nullptr) return nullptr;
  return std::make_shared<EffectDefinition>(formula_effect(*formula, spec.formula, spec.axis));
}

std::string label_of(std::string_view kind, std::string_view formula) {
  const std::string label(kind);
  return formula.empty() ? label : label + " " + std::string(formula);
}

std::span<const std::string> effect_names() {
  static const std::vector<std::string> kNames = [] {
    std::vector<std::string> names;
    for (const EffectDefinition& definition : effect_catalogue()) names.push_back(definition.kind);
    return names;
  }();
  return kNames;
}

bool depends_on(const Model& model, Need need) {
  return std::any_of(model.effects.begin(), model.effects.end(), [need](const EffectSpec& spec) {
    const DefinitionPtr definition = definition_of(spec);
    if (definition == nullptr || spec.parameters.empty()) return false;
    const auto& needs = definition->needs;
    return std::find(needs.begin(), needs.end(), need) != needs.end();
  });
}

InputFamily input_family(const EffectDefinition& definition) {
  for (const Need need : definition.needs) {
    switch (need) {
      case Need::kReferenceRate:
      case Need::kSlowReferenceRate:
      case Need::kCrossAxisRate: return InputFamily::kRate;
      case Need::kMagnetic: return InputFamily::kMagnetic;
      case Need::kAcceleration: return InputFamily::kAcceleration;
      case Need::kVibration: return InputFamily::kVibration;
      case Need::kSourceCurrent: return InputFamily::kSourceCurrent;
      case Need::kSupply: return InputFamily::kSupply;
      default: break;
    }
  }
  return definition.inputs.empty() ? InputFamily::kTime : InputFamily::kTemperature;
}

Parameters complete_parameters(const EffectDefinition& definition, const Parameters& given) {
  Parameters complete;
  for (const ParameterDefinition& parameter : definition.parameters) {
    const auto found = given.find(parameter.name);
    complete[parameter.name] = found == given.end() ? parameter.default_value : found->second;
  }
  return complete;
}

std::unique_ptr<Effect> make_effect(const EffectSpec& spec, double interval_s,
                                    const NoiseStream& noise) {
  if (const auto problem = spec.find_problem()) throw std::invalid_argument(problem->text());
  if (!(interval_s >= 1e-6 && interval_s <= 1e6)) {
    throw std::invalid_argument("interval_s: must be within 1e-6 and 1e6 s, found " +
                                std::to_string(interval_s));
  }
  const DefinitionPtr found = definition_of(spec);
  const EffectDefinition& definition = *found;
  EffectContext context{complete_parameters(definition, spec.parameters), definition.inputs,
                        spec.axis, interval_s, noise};
  for (std::size_t i = 0; i < spec.inputs.size(); ++i) {
    context.inputs[i] = temperature_point(spec.inputs[i]).value();
  }
  return definition.make(context);
}

}  // namespace zerodrift::twin
