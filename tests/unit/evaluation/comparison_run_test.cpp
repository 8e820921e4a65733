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

// Two hours of white noise at 2 Hz; the temperatures in the same rows, or in rows of their own
// between them.
std::string record_at_2_hz(bool joined) {
  allan::test::WhiteNoise noise(1e-6, 0.5, 17);
  std::string record = "time_s,rate_z_rad_s,temperature_coil_degC\n";
  for (int k = 0; k < 14400; ++k) {
    const double time_s = 0.5 * k;
    const double temperature_degc = 20.0 + 10.0 * std::sin(time_s / 900.0);
    char row[96];
    const int length = std::snprintf(row, sizeof row, "%.3f,%.9e,", time_s, noise.next());
    const auto at = static_cast<std::size_t>(length);
    if (joined) {
      std::snprintf(row + at, sizeof row - at, "\n%.3f,,%.4f\n", time_s + 0.2, temperature_degc);
    } else {
      std::snprintf(row + at, sizeof row - at, "%.4f\n", temperature_degc);
    }
    record += row;
  }
  return record;
}

// Rule: a row that measures no rate is no sample where none is missing by the times. Before: twice
// the samples, of which every second one was missing: no mean over a minute, no N, B and K.
TEST_F(ComparisonRun, RowsOfTemperatureAloneAreNoSamples) {
  const auto run = [&](bool joined) {
    ComparisonRequest request;
    request.record.file = write("r.csv", record_at_2_hz(joined)).string();
    request.schemes = {"none"};
    return run_comparison(request, [](const std::string&, double) {});
  };
  const ComparisonResult plain = run(false);
  const ComparisonResult joined = run(true);
  ASSERT_EQ(plain.axes.size(), 1U);
  ASSERT_EQ(joined.axes.size(), 1U);
  const auto& expected = plain.axes[0].protocols.at(0).raw;
  const auto& raw = joined.axes[0].protocols.at(0).raw;
  ASSERT_FALSE(raw.allan.empty());
  EXPECT_NEAR(raw.allan[0].tau_s, 0.5, 1e-9);
  // A temperature that comes a moment later makes the first label or two later.
  EXPECT_NEAR(static_cast<double>(raw.allan[0].pairs), static_cast<double>(expected.allan[0].pairs),
              20.0);
  EXPECT_NEAR(static_cast<double>(raw.minute_means.blocks),
              static_cast<double>(expected.minute_means.blocks), 1.0);
  constexpr auto kN = allan::NoiseTerm::kAngleRandomWalk;
  EXPECT_NEAR(raw.coefficients[kN].value / expected.coefficients[kN].value, 1.0, 1e-3);
  EXPECT_EQ(joined.axes[0].paper_interval_s, plain.axes[0].paper_interval_s);
  EXPECT_EQ(joined.axes[0].paper_radps, plain.axes[0].paper_radps);
}

// Rule: a sample of which no axis measured is one all the same where it is missing by the times.
TEST_F(ComparisonRun, ABlankRowInAnEvenTableIsASampleThatWasNotMeasured) {
  std::string record = record_at_2_hz(false);
  std::string blank;
  int k = 0;
  for (std::size_t at = 0; at < record.size();) {
    const std::size_t end = record.find('\n', at) + 1;
    const std::string row = record.substr(at, end - at);
    const std::size_t rate = row.find(',') + 1;
    blank += k++ % 50 == 25 ? row.substr(0, rate) + row.substr(row.find(',', rate)) : row;
    at = end;
  }
  ComparisonRequest request;
  request.record.file = write("r.csv", blank).string();
  request.schemes = {"none"};
  const ComparisonResult result = run_comparison(request, [](const std::string&, double) {});
  ASSERT_EQ(result.axes.size(), 1U);
  EXPECT_GT(result.axes[0].protocols.at(0).raw.minute_means.blocks, 90U);
  EXPECT_FALSE(result.axes[0].paper_radps.empty());
  for (const std::string& warning : result.warnings)
    EXPECT_EQ(warning.find("evenly"), std::string::npos) << warning;
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
