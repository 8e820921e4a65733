// SPDX-License-Identifier: Apache-2.0
#include "services/navigation_filter/state_message.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/core/units.h"

namespace zerodrift::services {
namespace {

using navigation::Stream;

constexpr double kRateHz = 50.0;

// A gyro that measures no rate, and its filter.
class Filter {
 public:
  Filter()
      : navigation([] {
          navigation::GyroNavigationOptions options;
          options.attitude = {0.0, 0.0, 0.4};
          options.alignment_s = 5.0;
          options.filter.latitude_rad = 48.0 * core::kRadPerDeg;
          return options;
        }()) {}

  void run(double duration_s, bool has_truth) {
    for (int n = 0; n < static_cast<int>(duration_s * kRateHz); ++n) {
      ++sequence_;
      navigation::NavigationSample sample;
      sample.sequence = sequence_;
      sample.time = core::from_seconds(static_cast<double>(sequence_) / kRateHz);
      sample.interval_s = 1.0 / kRateHz;
      sample.valid = {true, true, true};
      sample.noise_variance.fill(1e-12);
      sample.drift_variance.fill(1e-14);
      // It stands: the Earth's rate, or its first stop would be none of a truth.
      if (has_truth) navigation.push_truth(sample.time, navigation.true_earth_rate_radps());
      navigation.push(sample);
    }
    navigation.give_up_waiting();
  }
  [[nodiscard]] msg::NavigationState state(Stream stream) const {
    return to_message(navigation, stream, 1, navigation::BodyFrame::kForwardLeftUp);
  }

  navigation::GyroNavigation navigation;

 private:
  std::uint64_t sequence_ = 0;
};

// Rule: an error is one against the truth of now. Before: after a hole in the true rates the last
// error stood in every message for the filter's life, while the heading went degrees away.
TEST(NavigationStateMessage, HasNoErrorWithoutATruth) {
  Filter filter;
  filter.run(20.0, true);
  ASSERT_TRUE(filter.navigation.knows_truth());
  for (const Stream stream : {Stream::kRaw, Stream::kCompensated}) {
    EXPECT_TRUE(std::isfinite(filter.state(stream).heading_error_rad()));
    EXPECT_TRUE(std::isfinite(filter.state(stream).attitude_error_rad()));
  }
  filter.run(20.0, false);
  filter.run(20.0, true);
  ASSERT_FALSE(filter.navigation.knows_truth());
  for (const Stream stream : {Stream::kRaw, Stream::kCompensated}) {
    EXPECT_TRUE(std::isfinite(filter.state(stream).heading_rad()));
    EXPECT_TRUE(std::isnan(filter.state(stream).heading_error_rad()));
    EXPECT_TRUE(std::isnan(filter.state(stream).attitude_error_rad()));
  }
}

}  // namespace
}  // namespace zerodrift::services
