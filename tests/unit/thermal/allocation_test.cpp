// SPDX-License-Identifier: Apache-2.0
// The per-sample paths of common/thermal take no memory after construction. Own program: it
// replaces operator new.
#include <gtest/gtest.h>

#include <cstdlib>
#include <new>
#include <string>
#include <vector>

#include "common/thermal/features.h"

namespace {
std::size_t allocations = 0;
}  // namespace

// Not inlined: GCC would take malloc and delete, seen in one place, for a mismatched pair.
[[gnu::noinline]] void* operator new(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept {
  std::free(memory);
}
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}

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

  const std::size_t before = allocations;
  ASSERT_GT(before, 0U);
  std::size_t ready = 0;
  for (int i = 0; i < 100'000; ++i) {
    sample.time = core::from_seconds(0.005 * i + (i >= 90'000 ? 20.0 : 0.0));  // with a gap
    sample.temperature_degc = 0.001 * i;
    for (TemperatureTrack& track : tracks) track.add(sample);
    if (builder.build(sample.time, tracks, {}).status == FeatureStatus::kReady) ++ready;
  }
  const std::size_t after = allocations;
  EXPECT_EQ(after, before);
  EXPECT_GT(ready, 0U);
}

}  // namespace
}  // namespace zerodrift::thermal
