// SPDX-License-Identifier: Apache-2.0
// The list of all effects the twin can simulate. Their names are part of the interface.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "common/twin/effect.h"
#include "common/twin/model.h"

namespace zerodrift::twin {

// In the order of effect_catalogue.cpp.
[[nodiscard]] std::span<const EffectDefinition> effect_catalogue();

// nullptr where the catalogue has no such effect.
[[nodiscard]] const EffectDefinition* find_effect(std::string_view kind);

[[nodiscard]] std::span<const std::string> effect_names();

}  // namespace zerodrift::twin
