// SPDX-License-Identifier: Apache-2.0
#include "common/twin/effect_catalogue.h"

#include <algorithm>
#include <vector>

// One line an effect: effects/<name>.cpp defines EffectDefinition effects::<name>().
#define ZERODRIFT_FOR_EACH_EFFECT(X) \
  X(bias)                            \
  X(bias_temperature)                \
  X(shupe)                           \
  X(coil_lag)                        \
  X(gradient)                        \
  X(shupe_temperature)               \
  X(warm_up)                         \
  X(scale_factor)                    \
  X(quantization)                    \
  X(angle_random_walk)               \
  X(bias_instability)                \
  X(rate_random_walk)                \
  X(rate_ramp)                       \
  X(markov)                          \
  X(line)

namespace zerodrift::twin {
namespace effects {

#define ZERODRIFT_DECLARE(name) EffectDefinition name();
ZERODRIFT_FOR_EACH_EFFECT(ZERODRIFT_DECLARE)
#undef ZERODRIFT_DECLARE

}  // namespace effects

std::span<const EffectDefinition> effect_catalogue() {
#define ZERODRIFT_DEFINITION(name) effects::name(),
  static const std::vector<EffectDefinition> kCatalogue{
      ZERODRIFT_FOR_EACH_EFFECT(ZERODRIFT_DEFINITION)};
#undef ZERODRIFT_DEFINITION
  return kCatalogue;
}

const EffectDefinition* find_effect(std::string_view kind) {
  const auto all = effect_catalogue();
  const auto found = std::find_if(all.begin(), all.end(),
                                  [kind](const EffectDefinition& d) { return d.kind == kind; });
  return found == all.end() ? nullptr : &*found;
}

std::span<const std::string> effect_names() {
  static const std::vector<std::string> kNames = [] {
    std::vector<std::string> names;
    for (const EffectDefinition& definition : effect_catalogue()) names.push_back(definition.kind);
    return names;
  }();
  return kNames;
}

}  // namespace zerodrift::twin
