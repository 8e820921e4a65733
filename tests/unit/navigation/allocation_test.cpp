// SPDX-License-Identifier: Apache-2.0
// Navigating takes no memory after construction, nor does the compensation's ear for what a filter
// gives back. Own program: allocation_count.cpp replaces operator new.
#include <gtest/gtest.h>

#include <cmath>

#include "common/core/units.h"
#include "common/navigation/navigation_input.h"
#include "tests/support/allocation_count.h"
#include "tests/unit/compensation/synthetic_gyro.h"

namespace zerodrift::navigation {
namespace {

TEST(NavigationAllocationLaws, NoSampleTakesMemoryOnEitherSide) {
  compensation::testing::GyroSpec spec;
  spec.duration_s = 600.0;
  spec.low_degc = 20.0;
  spec.high_degc = 30.0;
  spec.motion = compensation::testing::turn(300.0, 30.0, 0.05);
  const auto record = compensation::testing::make_record(spec);
  compensation::CompensationOptions options = compensation::testing::options();
  options.model.selection.reset();  // choosing a kernel anew takes memory, in the learner alone
  options.model.capacity = 20;
  options.earth_rate.mode = compensation::EarthRateMode::kUnknown;
  options.reference.navigation_residual = compensation::ReferencePolicy::kAccept;
  compensation::Compensator compensator(options);
  GyroNavigationOptions filter;
  filter.filter.latitude_rad = 0.0;
  filter.filter.heading_sigma_rad = filter.filter.tilt_sigma_rad = 1e-3;
  filter.attitude.heading_rad = 1.5707963;
  filter.residual_feedback = true;
  filter.alignment_s = 30.0;
  GyroNavigation navigation(filter);
  std::size_t taken = 0;
  std::size_t t = 0;
  for (const auto& sample : record.rates) {
    for (; t < record.temperatures.size() && record.temperatures[t].time <= sample.time; ++t)
      compensator.push(record.temperatures[t]);
    compensator.push(sample);
    for (;;) {
      const auto readiness = compensator.readiness();
      if (readiness == compensation::Readiness::kAwaitsModel && compensator.learner().run_one())
        continue;
      if (readiness != compensation::Readiness::kReady) break;
      const std::size_t before = allocation_count();
      const auto answer = compensator.answer_next();
      navigation.push_truth(answer.raw.time, {0.0, 0.0, 0.0});
      navigation.push(navigation::to_navigation(answer));
      while (const auto reference = navigation.take_reference()) compensator.push(*reference);
      taken += allocation_count() - before;
    }
  }
  EXPECT_EQ(taken, 0U);
  EXPECT_GT(navigation.counts().references, 1000U);
  EXPECT_GT(navigation.counts().residuals, 100U);
  EXPECT_GT(navigation.counts(Stream::kRaw).updates, 100U);
}

}  // namespace
}  // namespace zerodrift::navigation
