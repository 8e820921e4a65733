// SPDX-License-Identifier: Apache-2.0
#include "common/evaluation/comparison_run.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

#include "common/core/units.h"
#include "common/twin/model.h"
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

// An hour whose drift is that of the model, 2 deg/h a degree, with white noise.
std::string record_of_model() {
  allan::test::WhiteNoise noise(1e-6, 1.0, 5);
  std::string record = "time_s,rate_z_rad_s,temperature_coil_degC\n";
  for (int time_s = 0; time_s < 3600; ++time_s) {
    const double swing_degc = 10.0 * std::sin(time_s / 300.0);
    char row[96];
    std::snprintf(row, sizeof row, "%d,%.9e,%.6f\n", time_s,
                  core::radps_from_deg_h(2.0 * swing_degc) + noise.next(), 20.0 + swing_degc);
    record += row;
  }
  return record;
}

// Rule: with a prior the service's schemes are judged on it, as the service runs them. Before: they
// learned the whole drift, whatever --config said.
TEST_F(ComparisonRun, APriorIsTakenOffBeforeTheServicesSchemesLearn) {
  twin::EffectSpec effect;
  effect.kind = "bias_temperature";
  effect.axis = core::Axis::kZ;
  effect.parameters = {{"reference_degc", 20.0}, {"c1_deg_h_per_degc", 2.0}};
  twin::Model model;
  model.gyro_id = "test";
  model.effects = {effect};
  ComparisonRequest request;
  request.record.file = write("r.csv", record_of_model()).string();
  request.schemes = {"persistence", "online-svr", "stack"};
  request.delays_s = {600.0};
  request.only_labels = true;
  const auto late_rms = [&] {
    const ComparisonResult result = run_comparison(request, [](const std::string&, double) {});
    std::vector<double> rms;
    for (const SchemeOutcome& scheme : result.axes.at(0).protocols.at(1).schemes)
      rms.push_back(scheme.statistics.root_mean_square);
    return rms;
  };
  const std::vector<double> without = late_rms();
  request.options.prior = model;
  const std::vector<double> with = late_rms();
  EXPECT_EQ(with[0], without[0]);
  // Of a label of 5 s the noise has a deviation of N / sqrt(5 s); the rest is what was learned of
  // as much noise, and the steps of the prior's second.
  const double noise_radps = 1e-6 / std::sqrt(5.0);
  for (const std::size_t i : {1U, 2U}) {
    EXPECT_LT(with[i], 2.0 * noise_radps);
    EXPECT_GT(without[i], 5.0 * noise_radps);
  }
}

}  // namespace
}  // namespace zerodrift::evaluation
