// SPDX-License-Identifier: Apache-2.0
#include "common/core/units.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace zerodrift::core {
namespace {

TEST(UnitsGolden, OneTurnAnHourIs360DegPerHour) {
  // Two roundings, in 360 * (pi/180) and in the division by 3600: 4 ulp is generous.
  EXPECT_DOUBLE_EQ(radps_from_deg_h(360.0), 2.0 * std::numbers::pi / 3600.0);
}

TEST(UnitsGolden, EarthTurnsOnceASiderealDay) {
  // 15.041067 deg/h is 360 deg in 86164.1 s; WGS 84 prints 7 digits of the rate, so 1e-5 deg/h.
  EXPECT_NEAR(deg_h_from_radps(kEarthRateRadps), 360.0 * 3600.0 / 86164.0905, 1e-5);
}

TEST(UnitsLaws, DegPerHourAndBackIsTheIdentity) {
  for (const double rate_deg_h : {-3.6e6, -15.0, -1e-12, 0.0, 1e-9, 0.0217, 15.041, 3.6e6}) {
    EXPECT_DOUBLE_EQ(deg_h_from_radps(radps_from_deg_h(rate_deg_h)), rate_deg_h);
  }
}

TEST(UnitsAbuse, NotANumberStaysNotANumber) {
  EXPECT_TRUE(std::isnan(radps_from_deg_h(std::nan(""))));
  EXPECT_TRUE(std::isnan(deg_h_from_radps(std::nan(""))));
}

}  // namespace
}  // namespace zerodrift::core
