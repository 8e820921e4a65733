// SPDX-License-Identifier: Apache-2.0
#include "common/evaluation/comparison_run.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <string>
#include <utility>

#include "tests/support/scratch_folder.h"
#include "tests/unit/allan/noise_sources.h"

namespace zerodrift::evaluation {
namespace {

class ComparisonRun : public ScratchFolder {};

// An hour of white noise at rest, at a rate whose period is no multiple of the stamps' tick.
std::string rounded_record(double rate_hz, double tick_s, double n) {
  allan::test::WhiteNoise noise(n, 1.0 / rate_hz, 11);
  std::string record = "time_s,rate_z_rad_s,temperature_coil_degC\n";
  for (int k = 0; k < static_cast<int>(3600.0 * rate_hz); ++k) {
    const double time_s = tick_s * std::round(k / rate_hz / tick_s);
    char row[96];
    std::snprintf(row, sizeof row, "%.3f,%.9e,%.4f\n", time_s, noise.next(),
                  20.0 + 10.0 * std::sin(time_s / 900.0));
    record += row;
  }
  return record;
}

// Before: the streams went by the most frequent step, and the interval of N excluded the true one.
TEST_F(ComparisonRun, StampsRoundedToATickLeaveTheNoiseAsItIs) {
  constexpr double kN = 1e-6;
  for (const auto& [rate_hz, tick_s] : {std::pair{30.0, 0.01}, std::pair{70.0, 0.001}}) {
    ComparisonRequest request;
    request.record.file = write("r.csv", rounded_record(rate_hz, tick_s, kN)).string();
    request.schemes = {"none"};
    const ComparisonResult result = run_comparison(request, [](const std::string&, double) {});
    ASSERT_EQ(result.axes.size(), 1U);
    const auto& raw = result.axes[0].protocols.at(0).raw;
    ASSERT_FALSE(raw.allan.empty());
    EXPECT_NEAR(raw.allan[0].tau_s * rate_hz, 1.0, 1e-3);
    // 5 sigma of the shortest taus of some 90 000 samples: 5 / sqrt(2 * 0.78 n)
    const allan::Coefficient& n = raw.coefficients[allan::NoiseTerm::kAngleRandomWalk];
    EXPECT_NEAR(n.value / kN, 1.0, 0.014);
    for (const std::string& warning : result.warnings)
      EXPECT_EQ(warning.find("evenly"), std::string::npos) << warning;
  }
}

}  // namespace
}  // namespace zerodrift::evaluation
