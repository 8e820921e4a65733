// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "common/twin/effect_catalogue.h"
#include "common/twin/simulation.h"
#include "tests/support/allocation_count.h"
#include "tests/unit/twin/examples.h"

namespace zerodrift::twin {
namespace {

TEST(SimulationLaws, SamplesDoNotAllocate) {
  std::vector<EffectSpec> effects;
  for (const EffectDefinition& definition : effect_catalogue()) {
    const ParameterDefinition& first = definition.parameters.front();
    effects.push_back(examples::effect(definition.kind, {{first.name, first.default_value}}));
  }
  const Profile profile = examples::heating_and_cooling();
  GyroSimulation gyro(examples::model_of(effects), profile, 1, 200.0);
  ThermometerSimulation thermometer(examples::model_of(effects), profile, 1, "coil");
  const std::size_t before = allocation_count();
  EXPECT_GT(before, 0U);
  for (int i = 0; i < 10'000; ++i) {
    (void)gyro.next();
    (void)thermometer.next();
  }
  EXPECT_EQ(allocation_count(), before);
}

}  // namespace
}  // namespace zerodrift::twin
