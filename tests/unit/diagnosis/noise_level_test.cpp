// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/noise_level.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "common/diagnosis/diagnosis.h"
#include "tests/unit/diagnosis/simulated_series.h"

namespace zerodrift::diagnosis {
namespace {

constexpr core::Axis kX = core::Axis::kX;

twin::EffectSpec growing(double growth_per_degc) {
  return {.kind = "noise_temperature",
          .axis = kX,
          .parameters = {{"coefficient_deg_per_sqrt_h", 3e-3},
                         {"growth_per_degc", growth_per_degc},
                         {"reference_degc", 25.0}},
          .inputs = {"board"}};
}

// Before: spikes at P 1.00, or a wrong angle random walk.
TEST(NoiseLevelScenario, NoiseThatGrowsWithTemperatureIsNamedAndProved) {
  for (const double growth_per_degc : {0.05, -0.04}) {
    SCOPED_TRACE(growth_per_degc);
    const twin::Model given = test::lab_model();
    const twin::Model truth = test::with(given, growing(growth_per_degc));
    const MeasuredSeries record = test::simulated(truth, test::chamber_profile(), 31);
    const Diagnosis diagnosis = diagnose(given, record, {}, {});
    const AxisDiagnosis& axis = *diagnosis.axes[0];
    ASSERT_EQ(axis.effects.size(), 1U) << axis.sentence;
    EXPECT_EQ(axis.effects[0].name, "noise_temperature");
    EXPECT_GT(axis.effects[0].probability, 0.92);
    EXPECT_EQ(axis.acceptance, Acceptance::kAccepted) << axis.sentence;
    // The sign is right and its size within a third: a constant part takes up some of the shape.
    EXPECT_NEAR(axis.effects[0].parameters.at("growth_per_degc") / growth_per_degc, 1.0, 0.35);
    // Repaired, it lacks nothing.
    const AxisDiagnosis again =
        *diagnose(diagnosis.repaired, test::simulated(truth, test::chamber_profile(), 32), {}, {})
             .axes[0];
    EXPECT_TRUE(again.effects.empty()) << again.sentence;
  }
}

TEST(NoiseLevelScenario, AConstantLevelHasNoName) {
  const twin::Model model = test::lab_model();
  for (const std::uint64_t seed : {41U, 42U, 43U, 44U}) {
    const MeasuredSeries record = test::simulated(model, test::chamber_profile(), seed);
    const Playback playback(record);
    const DiagnosisOptions options;
    const auto left =
        difference(measured_drift(record, kX), playback.drift(model, kX), record.valid[0]);
    const auto found = growing_noise(left, {model, record, playback, kX, record.valid[0], options},
                                     SearchOptions{});
    EXPECT_FALSE(found.has_value());
  }
}

TEST(NoiseLevelScenario, NoiseThatFollowsAnotherInputIsNotCreditedToTemperature) {
  const twin::Model model = test::lab_model();
  MeasuredSeries record = test::simulated(model, test::chamber_profile(), 45);
  const Playback playback(record);
  const DiagnosisOptions options;
  auto left = difference(measured_drift(record, kX), playback.drift(model, kX), record.valid[0]);
  for (std::size_t i = 0; i < left.size(); ++i)
    left[i] *= 1.0 + 2.0 * static_cast<double>(i) / static_cast<double>(left.size());
  EXPECT_FALSE(
      growing_noise(left, {model, record, playback, kX, record.valid[0], options}, SearchOptions{})
          .has_value());
}

}  // namespace
}  // namespace zerodrift::diagnosis
