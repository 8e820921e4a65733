// SPDX-License-Identifier: Apache-2.0
#include "common/experts/thermal_basis.h"

#include <gtest/gtest.h>

#include <cmath>

namespace zerodrift::experts {
namespace {

TEST(ThermalBasisLaws, MemoryOfARampIsItsSlopeTimesTheTimeConstant) {
  ThermalBasis thermal;
  Basis basis{};
  for (int t = 0; t <= 40'000; t += 5) basis = thermal.advance(t, 20.0 + 0.001 * t, 0.001);
  for (std::size_t i = 0; i < kMemoryTimesS.size(); ++i) {
    // exp(-40000 / 3240) = 4e-6 of the transient is left.
    EXPECT_NEAR(basis[kFirstMemory + i], 0.001 * kMemoryTimesS[i], 1e-5 * kMemoryTimesS[i]);
  }
}

TEST(ThermalBasisLaws, OnAStraightLineItDoesNotMatterHowOftenItIsRead) {
  ThermalBasis often, seldom;
  Basis by_often{}, by_seldom{};
  for (int t = 0; t <= 1200; ++t) {
    by_often = often.advance(t, 0.01 * t, 0.01);
    if (t % 60 == 0) by_seldom = seldom.advance(t, 0.01 * t, 0.01);
  }
  for (std::size_t j = 0; j < kBasisTerms; ++j) EXPECT_NEAR(by_often[j], by_seldom[j], 1e-9) << j;
}

TEST(ThermalBasisLaws, BeginsWithoutMemoryAtWhateverTemperature) {
  ThermalBasis thermal;
  const Basis& basis = thermal.advance(1e9, -273.0, 0.0);
  for (const double term : basis) EXPECT_EQ(term, 0.0);
}

}  // namespace
}  // namespace zerodrift::experts
