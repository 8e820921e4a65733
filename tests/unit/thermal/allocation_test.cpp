// SPDX-License-Identifier: Apache-2.0
// The per-sample paths of common/thermal take no memory after construction. Own program: it
// replaces operator new.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "common/thermal/features.h"
#include "tests/support/allocation_count.h"

namespace zerodrift::thermal {
namespace {

TEST(ThermalAllocationLaws, ReadingsAndFeaturesTakeNoMemoryAfterConstruction) {
  const std::vector<std::string> probes{"coil", "case"};
  const FeatureBuilder builder(
      {.features = {{.kind = FeatureKind::kTemperatureRate, .probe = "coil"},
                    {.kind = FeatureKind::kTemperatureRate, .probe = "case"},
                    {.kind = FeatureKind::kLaggedTemperature, .probe = "case", .lag_s = 300.0}}},
      probes);
  TemperatureTrackOptions polynomial;
  polynomial.rate_method = RateMethod::kLocalPolynomial;
  std::vector<TemperatureTrack> tracks;
  tracks.emplace_back(TemperatureTrackOptions{});
  tracks.emplace_back(polynomial);
  core::TemperatureSample sample;

  const std::size_t before = allocation_count();
  ASSERT_GT(before, 0U);
  std::size_t ready = 0;
  for (int i = 0; i < 100'000; ++i) {
    sample.time = core::from_seconds(0.005 * i + (i >= 90'000 ? 20.0 : 0.0));  // with a gap
    sample.temperature_degc = 0.001 * i;
    for (TemperatureTrack& track : tracks) track.add(sample);
    if (builder.build(sample.time, tracks, {}).status == FeatureStatus::kReady) ++ready;
  }
  const std::size_t after = allocation_count();
  EXPECT_EQ(after, before);
  EXPECT_GT(ready, 0U);
}

}  // namespace
}  // namespace zerodrift::thermal
