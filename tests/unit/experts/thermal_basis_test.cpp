// SPDX-License-Identifier: Apache-2.0
#include "common/experts/thermal_basis.h"

#include <gtest/gtest.h>

#include <cmath>

namespace zerodrift::experts {
namespace {

TEST(ThermalMemoryLaws, OfARampItIsTheSlopeTimesTheTimeConstant) {
  ThermalMemory thermal;
  for (int t = 0; t <= 40'000; t += 5)
    thermal.advance(core::from_seconds(t), 20.0 + 0.001 * t, 0.001);
  for (std::size_t i = 0; i < kMemoryTimesS.size(); ++i) {
    // exp(-40000 / 3240) = 4e-6 of the transient is left.
    EXPECT_NEAR(thermal.state().memory[i], 0.001 * kMemoryTimesS[i], 1e-5 * kMemoryTimesS[i]);
  }
}

TEST(ThermalMemoryLaws, OnAStraightLineItDoesNotMatterHowOftenItIsRead) {
  ThermalMemory often, seldom;
  for (int t = 0; t <= 1200; ++t) {
    often.advance(core::from_seconds(t), 0.01 * t, 0.01);
    if (t % 60 == 0) seldom.advance(core::from_seconds(t), 0.01 * t, 0.01);
  }
  for (std::size_t i = 0; i < kMemoryTimesS.size(); ++i)
    EXPECT_NEAR(often.state().memory[i], seldom.state().memory[i], 1e-9) << i;
}

TEST(ThermalMemoryLaws, BeginsWithoutMemoryAtWhateverTemperatureAndAgainAfterARestart) {
  ThermalMemory thermal;
  for (const double first : {-273.0, 100.0}) {
    const ThermalState& state = thermal.advance(core::from_seconds(1e9), first, 0.0);
    for (const double term : basis_of(state, first)) EXPECT_EQ(term, 0.0);
    thermal.advance(core::from_seconds(2e9), 0.0, 0.0);
    thermal.restart();
  }
}

// Law: of two readings a nanosecond apart the newer one counts, at any epoch; frames of one read of
// a serial line have such stamps. Before: no number for ever, as their times in s were equal.
TEST(ThermalMemoryLaws, ReadingsOfNearlyTheSameInstantAreASingleOne) {
  for (const double epoch_s : {0.0, 1.8e9}) {
    ThermalMemory single, doubled;
    for (int k = 0; k < 2000; ++k) {
      const core::SensorTime time = core::from_seconds(epoch_s) + core::from_seconds(k);
      const double temperature = std::sin(0.01 * k);
      single.advance(time, temperature, 0.0);
      if (k > 0)
        doubled.advance(time - core::SensorTime{1}, temperature + (k % 2 == 0 ? 0.5 : -0.5), 0.0);
      doubled.advance(time, temperature, 0.0);
    }
    for (std::size_t i = 0; i < kMemoryTimesS.size(); ++i)
      EXPECT_NEAR(doubled.state().memory[i], single.state().memory[i], 3e-3) << epoch_s << ' ' << i;
  }
}

TEST(ThermalBasisLaws, OnlyTermsOfTheTemperatureDependOnTheReference) {
  const ThermalState state{4.0, 2.0, {1.0, 2.0, 3.0, 4.0}};
  const Basis basis = basis_of(state, 1.0);
  EXPECT_EQ(basis, (Basis{3.0, 2.0, 3.0, 3.0, 2.0, 1.0, 2.0, 3.0, 4.0}));
}

}  // namespace
}  // namespace zerodrift::experts
