// SPDX-License-Identifier: Apache-2.0
// The methods that the benchmark compares with: they see what is plain to see, and they name what
// isn't there as soon as the noise isn't white. That is why they are only compared with.
#include "tests/blind/baselines.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <stdexcept>

#include "common/core/units.h"

namespace zerodrift::blind {
namespace {

constexpr std::size_t kSamples = 14'400;  // 4 h at 1 Hz
constexpr double kWhiteDegH = 0.12;       // standard deviation of a sample

twin::Model model_of_white_noise() {
  twin::Model model;
  model.effects = {{.kind = "bias", .axis = core::Axis::kX, .parameters = {{"bias_deg_h", 1.0}}},
                   {.kind = "angle_random_walk",
                    .axis = core::Axis::kX,
                    .parameters = {{"coefficient_deg_per_sqrt_h", kWhiteDegH / 60.0}}}};
  return model;
}

struct Hidden {
  double shupe_deg_h_min_per_degc = 0.0;
  double walk_deg_h = 0.0;  // standard deviation of a random walk's step in a second
  unsigned seed = 1;
};

// The coil goes up and down by 20 °C within an hour and a half.
diagnosis::MeasuredSeries record_with(const Hidden& hidden) {
  constexpr double kOmega = 2.0 * std::numbers::pi / 5400.0;
  std::mt19937 generator(hidden.seed);
  std::normal_distribution<double> normal;
  diagnosis::SeriesBuilder builder({.probes = {"coil"}});
  double walk = 0.0;
  for (std::size_t i = 0; i < kSamples; ++i) {
    const double t = static_cast<double>(i);
    const double temperature[] = {20.0 + 20.0 * std::sin(kOmega * t)};
    const double degc_per_min = 60.0 * 20.0 * kOmega * std::cos(kOmega * t);
    walk += hidden.walk_deg_h * normal(generator);
    const double rate_deg_h = 1.0 + hidden.shupe_deg_h_min_per_degc * degc_per_min + walk +
                              kWhiteDegH * normal(generator);
    const double none = std::nan("");
    builder.add({.time_s = t,
                 .rate_radps = {core::radps_from_deg_h(rate_deg_h), none, none},
                 .reference_radps = {},
                 .temperature_degc = temperature,
                 .magnetic_ut = {none, none, none},
                 .acceleration_mps2 = {none, none, none},
                 .vibration_g = none,
                 .source_current_ma = none,
                 .supply_v = none});
  }
  return builder.finish();
}

diagnosis::AxisDiagnosis diagnosed(Method method, const Hidden& hidden) {
  Hidden unseen = hidden;
  unseen.seed += 100;
  const auto diagnosis = diagnose_by({.method = method}, model_of_white_noise(),
                                     record_with(hidden), {record_with(unseen)});
  return diagnosis.axes[core::index(core::Axis::kX)].value();
}

bool names(const diagnosis::AxisDiagnosis& axis, const std::string& effect) {
  return std::any_of(axis.effects.begin(), axis.effects.end(),
                     [&](const auto& named) { return named.name == effect; });
}

class Baselines : public ::testing::TestWithParam<Method> {};
INSTANTIATE_TEST_SUITE_P(Both, Baselines, ::testing::Values(Method::kStepwiseBic, Method::kStlsq),
                         [](const auto& test) {
                           return test.param == Method::kStlsq ? "Stlsq" : "StepwiseBic";
                         });

// 1 deg/h per °C/min is 0.99 deg/h rms, eight times the white noise of a sample. The same waveform
// as a gradient or a lag can't be told from it on one probe at every phase: any of Shupe's kin
// counts, and the gap closes.
TEST_P(Baselines, FindAnObviousEffectInWhiteNoise) {
  const auto axis = diagnosed(GetParam(), {.shupe_deg_h_min_per_degc = 1.0});
  EXPECT_EQ(axis.verdict, diagnosis::Verdict::kEffectNamed);
  EXPECT_TRUE(names(axis, "shupe") || names(axis, "coil_lag")) << axis.sentence;
  EXPECT_EQ(axis.held_out_kind, diagnosis::HeldOut::kRecords);
  EXPECT_LT(axis.held_out.after_rms_radps, 0.1 * axis.held_out.before_rms_radps);
}

TEST(StepwiseBic, NamesNothingInWhiteNoise) {
  const auto axis = diagnosed(Method::kStepwiseBic, {});
  EXPECT_EQ(axis.verdict, diagnosis::Verdict::kConsistent) << axis.sentence;
  EXPECT_TRUE(axis.effects.empty());
}

// The known weakness: a random walk alone, and both find effects of temperature in it.
TEST_P(Baselines, NameFalseEffectsInColouredNoise) {
  const auto axis = diagnosed(GetParam(), {.walk_deg_h = 0.002});
  EXPECT_EQ(axis.verdict, diagnosis::Verdict::kEffectNamed);
  EXPECT_FALSE(axis.effects.empty());
}

TEST(BaselineOptions, NameTheWrongKey) {
  EXPECT_FALSE(BaselineOptions{}.validate().has_value());
  EXPECT_NE(BaselineOptions{.threshold = 0.0}.validate().value_or("").find("threshold"),
            std::string::npos);
  EXPECT_THROW(static_cast<void>(
                   diagnose_by({.most_effects = 0}, model_of_white_noise(), record_with({}), {})),
               std::invalid_argument);
}

}  // namespace
}  // namespace zerodrift::blind
