// SPDX-License-Identifier: Apache-2.0
#include "common/thermal/features.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

#include "common/core/units.h"

namespace zerodrift::thermal {
namespace {

using core::from_seconds;

const std::vector<std::string> kProbes{"coil", "case"};

TemperatureTrackOptions track_options() {
  TemperatureTrackOptions options;
  options.sliding_mean = {.window_samples = 60, .sample_rate_hz = 1.0, .max_gap_s = 10.0};
  return options;
}

void feed(TemperatureTrack& track, double time_s, double temperature_degc) {
  core::TemperatureSample sample;
  sample.time = from_seconds(time_s);
  sample.temperature_degc = temperature_degc;
  ASSERT_EQ(track.add(sample), ReadingVerdict::kAccepted);
}

// Two probes on ramps: coil = 0.02 t, case = 3 + 0.03 t, one reading a second up to end_s.
std::vector<TemperatureTrack> ramps(int end_s) {
  std::vector<TemperatureTrack> tracks(2, TemperatureTrack(track_options()));
  for (int t = 0; t <= end_s; ++t) {
    feed(tracks[0], t, 0.02 * t);
    feed(tracks[1], t, 3.0 + 0.03 * t);
  }
  return tracks;
}

FeatureBuilderOptions every_kind() {
  return {.features = {
              {.kind = FeatureKind::kTemperature, .probe = "coil"},
              {.kind = FeatureKind::kTemperatureRate, .probe = "coil"},
              {.kind = FeatureKind::kTemperatureTimesRate, .probe = "case"},
              {.kind = FeatureKind::kLaggedTemperature, .probe = "coil", .lag_s = 300.0},
              {.kind = FeatureKind::kProbeDifference, .probe = "coil", .second_probe = "case"},
              {.kind = FeatureKind::kPulseMean},
              {.kind = FeatureKind::kPulseRate},
          }};
}

const PulseTerms kPulse{.mean_radps = core::radps_from_deg_h(0.5),
                        .slope_radps2 = core::radps_from_deg_h(0.25) / 60.0};

TEST(FeaturesGolden, EveryKindIsItsValueOverItsDocumentedScale) {
  const auto tracks = ramps(400);
  const FeatureBuilder builder(every_kind(), kProbes);
  const FeatureVector vector = builder.build(from_seconds(400.0), tracks, kPulse);
  ASSERT_EQ(vector.status, FeatureStatus::kReady);
  ASSERT_EQ(vector.size, 7U);
  // coil 8 °C, case 15 °C, rates 1.2 and 1.8 °C/min, coil 300 s ago 2 °C. Rates carry the roundings
  // of temperatures over 60 s (1e-16 °C/s), all others a few ulp.
  const std::array<double, 7> expected{0.8, 1.2, 15.0 * 1.8 / 10.0, 0.2, -7.0, 0.5, 0.25};
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_NEAR(vector.values[i], expected[i], 1e-12) << i;
  }
  EXPECT_EQ(vector.span().size(), 7U);
  EXPECT_EQ(builder.longest_lag_s(), 300.0);
}

TEST(FeaturesLaws, OffsetAndScaleAreTakenFromTheSpecification) {
  const auto tracks = ramps(400);
  const FeatureBuilder builder(
      {.features =
           {{.kind = FeatureKind::kTemperature, .probe = "case", .offset = 5.0, .scale = 4.0}}},
      kProbes);
  EXPECT_DOUBLE_EQ(builder.build(from_seconds(400.0), tracks, {}).values[0], 2.5);
}

TEST(FeaturesLaws, ValuesBeyondTheSizeAreZeroAndTheSameInputGivesTheSameBits) {
  const auto tracks = ramps(400);
  const FeatureBuilder builder(every_kind(), kProbes);
  const FeatureVector a = builder.build(from_seconds(400.3), tracks, kPulse);
  const FeatureVector b = builder.build(from_seconds(400.3), tracks, kPulse);
  EXPECT_EQ(a.values, b.values);
  for (std::size_t i = a.size; i < kMaxFeatures; ++i) EXPECT_EQ(a.values[i], 0.0);
}

TEST(FeaturesScenario, EachMissingInputHasItsOwnStatusAndNamesItsFeature) {
  const FeatureBuilder builder(every_kind(), kProbes);
  const auto expect_blocked = [&](const std::vector<TemperatureTrack>& tracks, double now_s,
                                  const PulseTerms& pulse, FeatureStatus status, std::size_t by) {
    const FeatureVector vector = builder.build(from_seconds(now_s), tracks, pulse);
    EXPECT_EQ(vector.status, status) << name(vector.status);
    EXPECT_EQ(vector.blocked_by, by);
    EXPECT_EQ(vector.size, 0U);
    for (const double value : vector.values) EXPECT_EQ(value, 0.0);
  };
  const std::vector<TemperatureTrack> silent(2, TemperatureTrack(track_options()));
  expect_blocked(silent, 0.0, kPulse, FeatureStatus::kNoTemperature, 0);
  expect_blocked(ramps(59), 59.0, kPulse, FeatureStatus::kRateNotReady, 1);
  expect_blocked(ramps(299), 299.0, kPulse, FeatureStatus::kLagNotReady, 3);
  expect_blocked(ramps(400), 400.0, {}, FeatureStatus::kPulseNotReady, 5);
  expect_blocked(ramps(400), 400.0, {.mean_radps = 1e-6, .slope_radps2 = {}},
                 FeatureStatus::kPulseNotReady, 6);
  expect_blocked(ramps(400), 411.0, kPulse, FeatureStatus::kTemperatureStale, 0);
  expect_blocked(ramps(400), 389.0, kPulse, FeatureStatus::kTemperatureStale, 0);
}

TEST(FeaturesScenario, OnlyTheProbesInUseMustBeAlive) {
  std::vector<TemperatureTrack> tracks(2, TemperatureTrack(track_options()));
  feed(tracks[0], 0.0, 20.0);
  const FeatureBuilder coil_only(
      {.features = {{.kind = FeatureKind::kTemperature, .probe = "coil"}}}, kProbes);
  EXPECT_EQ(coil_only.build(from_seconds(1.0), tracks, {}).status, FeatureStatus::kReady);
  const FeatureBuilder difference({.features = {{.kind = FeatureKind::kProbeDifference,
                                                 .probe = "coil",
                                                 .second_probe = "case"}}},
                                  kProbes);
  EXPECT_EQ(difference.build(from_seconds(1.0), tracks, {}).status, FeatureStatus::kNoTemperature);
}

TEST(FeaturesAbuse, MissingTracksHostileTimesAndNotFinitePulseTermsGiveAStatus) {
  const auto tracks = ramps(400);
  const FeatureBuilder builder(every_kind(), kProbes);
  const auto status = [&](core::SensorTime now, std::span<const TemperatureTrack> t,
                          const PulseTerms& pulse) { return builder.build(now, t, pulse).status; };
  const auto now = from_seconds(400.0);
  EXPECT_EQ(status(now, {}, kPulse), FeatureStatus::kNoTemperature);
  EXPECT_EQ(status(now, std::span(tracks).first(1), kPulse), FeatureStatus::kNoTemperature);
  EXPECT_EQ(status(core::kNever, tracks, kPulse), FeatureStatus::kTemperatureStale);
  EXPECT_EQ(status(core::SensorTime::max(), tracks, kPulse), FeatureStatus::kTemperatureStale);
  EXPECT_EQ(status(now, tracks, {std::nan(""), 0.0}), FeatureStatus::kPulseNotReady);
  EXPECT_EQ(status(now, tracks, {0.0, std::numeric_limits<double>::infinity()}),
            FeatureStatus::kPulseNotReady);
}

TEST(FeaturesAbuse, WrongSpecificationsAreRefusedWithTheirIndexAndKey) {
  const auto key_of = [](const FeatureBuilderOptions& options) -> std::string {
    try {
      const FeatureBuilder builder(options, kProbes);
    } catch (const std::invalid_argument& error) {
      const std::string line = error.what();
      return line.substr(0, line.find(' '));
    }
    return "accepted";
  };
  const FeatureSpec good{.kind = FeatureKind::kTemperature, .probe = "coil"};
  const auto second = [&](const FeatureSpec& spec) { return key_of({.features = {good, spec}}); };
  EXPECT_EQ(key_of({}), "features");
  EXPECT_EQ(key_of({.features = std::vector<FeatureSpec>(13, good)}), "features");
  EXPECT_EQ(key_of({.features = std::vector<FeatureSpec>(12, good)}), "accepted");
  EXPECT_EQ(key_of({.features = {good}, .max_temperature_age_s = 0.0}), "max_temperature_age_s");
  EXPECT_EQ(second({.kind = FeatureKind::kTemperature, .probe = "Coil"}), "features[1].probe");
  EXPECT_EQ(second({.kind = FeatureKind::kProbeDifference, .probe = "coil"}),
            "features[1].second_probe");
  EXPECT_EQ(second({.kind = FeatureKind::kLaggedTemperature, .probe = "coil"}),
            "features[1].lag_s");
  EXPECT_EQ(second({.kind = FeatureKind::kPulseMean, .scale = 0.0}), "features[1].scale");
  EXPECT_EQ(second({.kind = FeatureKind::kPulseMean, .offset = std::nan("")}),
            "features[1].offset");
}

TEST(FeaturesLaws, NamesAndScalesAreDistinctAndPositive) {
  const std::array kinds{FeatureKind::kTemperature,
                         FeatureKind::kTemperatureRate,
                         FeatureKind::kTemperatureTimesRate,
                         FeatureKind::kLaggedTemperature,
                         FeatureKind::kProbeDifference,
                         FeatureKind::kPulseMean,
                         FeatureKind::kPulseRate};
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    EXPECT_GT(default_scale(kinds[i]), 0.0);
    for (std::size_t j = 0; j < i; ++j) EXPECT_NE(name(kinds[i]), name(kinds[j]));
  }
}

}  // namespace
}  // namespace zerodrift::thermal
