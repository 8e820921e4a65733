// SPDX-License-Identifier: Apache-2.0
// The list of all effects the twin can simulate, and how one of them is run by itself. Their names
// are part of the interface.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "common/twin/effect.h"
#include "common/twin/model.h"

namespace zerodrift::twin {

// In the order of effect_catalogue.cpp.
[[nodiscard]] std::span<const EffectDefinition> effect_catalogue();

// nullptr where the catalogue has no such effect. What a formula is without its text, for
// "formula".
[[nodiscard]] const EffectDefinition* find_effect(std::string_view kind);

// Of the catalogue, or a formula's own.
using DefinitionPtr = std::shared_ptr<const EffectDefinition>;

// nullptr where there is none: another kind, or a formula that isn't one.
[[nodiscard]] DefinitionPtr definition_of(const EffectSpec& spec);

// For people, and unique on an axis where the kind is: the kind, of a formula also its text.
[[nodiscard]] std::string label_of(std::string_view kind, std::string_view formula);
[[nodiscard]] inline std::string label_of(const EffectSpec& spec) {
  return label_of(spec.kind, spec.formula);
}
[[nodiscard]] inline std::string label_of(const EffectDefinition& definition) {
  return label_of(definition.kind, definition.formula);
}

[[nodiscard]] std::span<const std::string> effect_names();

// True where an effect that the model simulates needs this of a record.
[[nodiscard]] bool depends_on(const Model& model, Need need);

// What an effect follows: the first input beside temperature that it needs, else temperature where
// it reads one, else time.
[[nodiscard]] InputFamily input_family(const EffectDefinition& definition);

// The given parameters and, for those left out, the catalogue's defaults.
[[nodiscard]] Parameters complete_parameters(const EffectDefinition& definition,
                                             const Parameters& given);

// One running effect, as GyroSimulation runs it: step it once every interval_s with the inputs of a
// simulation or a record. Only stochastic effects and random faults read `noise`. An effect without
// parameters gets the defaults. Throws std::invalid_argument naming the wrong key, or an interval
// that isn't within 1e-6 and 1e6 s.
[[nodiscard]] std::unique_ptr<Effect> make_effect(const EffectSpec& spec, double interval_s,
                                                  const NoiseStream& noise);

}  // namespace zerodrift::twin
