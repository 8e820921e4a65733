// SPDX-License-Identifier: Apache-2.0
#include "common/experts/thermal_basis.h"

#include <gtest/gtest.h>

#include <cmath>

namespace zerodrift::experts {
namespace {

TEST(ThermalMemoryLaws, OfARampItIsTheSlopeTimesTheTimeConstant) {
  ThermalMemory thermal;
  for (int t = 0; t <= 40'000; t += 5) thermal.advance(t, 20.0 + 0.001 * t, 0.001);
  for (std::size_t i = 0; i < kMemoryTimesS.size(); ++i) {
    // exp(-40000 / 3240) = 4e-6 of the transient is left.
    EXPECT_NEAR(thermal.state().memory[i], 0.001 * kMemoryTimesS[i], 1e-5 * kMemoryTimesS[i]);
  }
}

TEST(ThermalMemoryLaws, OnAStraightLineItDoesNotMatterHowOftenItIsRead) {
  ThermalMemory often, seldom;
  for (int t = 0; t <= 1200; ++t) {
    often.advance(t, 0.01 * t, 0.01);
    if (t % 60 == 0) seldom.advance(t, 0.01 * t, 0.01);
  }
  for (std::size_t i = 0; i < kMemoryTimesS.size(); ++i)
    EXPECT_NEAR(often.state().memory[i], seldom.state().memory[i], 1e-9) << i;
}

TEST(ThermalMemoryLaws, BeginsWithoutMemoryAtWhateverTemperatureAndAgainAfterARestart) {
  ThermalMemory thermal;
  for (const double first : {-273.0, 100.0}) {
    const ThermalState& state = thermal.advance(1e9, first, 0.0);
    for (const double term : basis_of(state, first)) EXPECT_EQ(term, 0.0);
    thermal.advance(2e9, 0.0, 0.0);
    thermal.restart();
  }
}

TEST(ThermalBasisLaws, OnlyTermsOfTheTemperatureDependOnTheReference) {
  const ThermalState state{4.0, 2.0, {1.0, 2.0, 3.0, 4.0}};
  const Basis basis = basis_of(state, 1.0);
  EXPECT_EQ(basis, (Basis{3.0, 2.0, 3.0, 3.0, 2.0, 1.0, 2.0, 3.0, 4.0}));
}

}  // namespace
}  // namespace zerodrift::experts
