// SPDX-License-Identifier: Apache-2.0
#include "common/regression/sample_domain.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/regression/online_svr.h"
#include "tests/unit/regression/test_records.h"

namespace zerodrift::regression::testing {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// The definition, sample by sample.
double brute_force(const OnlineSvr& svr, const std::vector<double>& x) {
  double nearest = kInfinity;
  for (std::size_t slot = 0; slot < svr.slot_count(); ++slot) {
    if (svr.set_of(slot) == SampleSet::kVacant) continue;
    double square = 0.0;
    for (std::size_t d = 0; d < x.size(); ++d)
      square += (svr.feature(slot, d) - x[d]) * (svr.feature(slot, d) - x[d]);
    nearest = std::min(nearest, square);
  }
  return nearest;
}

// The nearest sample lies so far away, and no nearer: within four units in the last place.
bool is_nearest(const SampleDomain& domain, const std::vector<double>& x, double squared) {
  constexpr double kRounding = 4.0 * std::numeric_limits<double>::epsilon();
  return domain.has_within(x, squared * (1.0 + kRounding)) &&
         (squared == 0.0 || !domain.has_within(x, squared * (1.0 - kRounding)));
}

// Rule: the distance is that to the nearest sample, support vector or not, for any number of
// samples: none of a block, its last, and more than one block. Sums of at most three squares may
// be rounded in another order or fused: 4 units in the last place.
TEST(SampleDomainLaws, EqualsBruteForceForEveryNumberOfSamples) {
  for (const std::size_t dimension : {std::size_t{1}, std::size_t{3}}) {
    for (const WindowPolicy window : {WindowPolicy::kFifo, WindowPolicy::kTwoTier}) {
      OnlineSvrOptions options = options_of(dimension, 150, 1.0);
      options.window = window;
      OnlineSvr svr(options);
      SampleDomain domain(dimension, options.capacity);
      RecordGenerator record(RecordKind::kSmooth, dimension, 11);
      for (int i = 0; i < 300; ++i) {
        const Sample sample = record.next();
        svr.add(sample.x, sample.y);
        domain.assign(svr);
        for (Sample& probe : record.take(4)) {
          for (double& feature : probe.x) feature *= 2.0;  // outside as well
          ASSERT_TRUE(is_nearest(domain, probe.x, brute_force(svr, probe.x)))
              << "dimension " << dimension << " step " << i;
        }
        ASSERT_TRUE(domain.has_within(sample.x, 0.0)) << "the newest sample is in it";
      }
    }
  }
}

// Rule: nothing is near to a learner that has met nothing.
TEST(SampleDomainLaws, IsInfinitelyFarWhileEmptyAndAfterAClear) {
  OnlineSvr svr(options_of(2, 20, 1.0));
  SampleDomain domain(2, 20);
  const std::vector<double> origin{0.0, 0.0};
  EXPECT_FALSE(domain.has_within(origin, kInfinity));
  domain.assign(svr);
  EXPECT_FALSE(domain.has_within(origin, kInfinity));
  svr.add(origin, 1.0);
  domain.assign(svr);
  EXPECT_TRUE(domain.has_within(origin, 0.0));
  svr.clear();
  domain.assign(svr);
  EXPECT_FALSE(domain.has_within(origin, kInfinity));
}

// Rule: zeros in padded lanes and what stood there before are no samples. All samples lie at
// distance 5 or more of the origin; the domain held the origin in its last place before.
TEST(SampleDomainLaws, PaddedLanesAndFormerSamplesNeverCount) {
  const std::vector<double> origin{0.0, 0.0};
  for (std::size_t count = 1; count <= 70; ++count) {
    SampleDomain domain(2, 70);
    OnlineSvr before(options_of(2, 70, 1.0));
    for (std::size_t i = 0; i < 70; ++i) before.add(origin, 0.0);
    domain.assign(before);
    ASSERT_TRUE(domain.has_within(origin, 0.0));
    OnlineSvr svr(options_of(2, 70, 1.0));
    for (std::size_t i = 0; i < count; ++i)
      svr.add(std::vector<double>{3.0, 4.0 + static_cast<double>(i)}, 0.0);
    domain.assign(svr);
    ASSERT_TRUE(is_nearest(domain, origin, 25.0)) << count << " samples";
  }
}

// Rule: what left the window is unknown again. First in, first out, capacity 10: after ten samples
// at 10 the ten at 0 are gone.
TEST(SampleDomainLaws, ForgetsWhatLeftTheWindow) {
  OnlineSvr svr(options_of(1, 10, 1.0));
  SampleDomain domain(1, 10);
  const std::vector<double> here{0.0};
  const auto learn_at = [&](double feature) {
    for (int i = 0; i < 10; ++i) svr.add(std::vector<double>{feature}, 0.01 * i);
    domain.assign(svr);
  };
  learn_at(0.0);
  EXPECT_TRUE(domain.has_within(here, 0.0));
  learn_at(10.0);
  EXPECT_TRUE(is_nearest(domain, here, 100.0));
}

// Rule: it is a copy: what the learner meets afterwards doesn't show.
TEST(SampleDomainLaws, KeepsItsSamplesWhileTheLearnerMovesOn) {
  OnlineSvr svr(options_of(1, 10, 1.0));
  SampleDomain domain(1, 10);
  svr.add(std::vector<double>{1.0}, 0.0);
  domain.assign(svr);
  svr.add(std::vector<double>{0.0}, 0.0);
  EXPECT_TRUE(is_nearest(domain, {0.0}, 1.0));
}

// Rule: a feature that is not a number is near to nothing, whatever its sign bit.
TEST(SampleDomainAbuse, ANotANumberIsNeverNear) {
  OnlineSvr svr(options_of(2, 10, 1.0));
  svr.add(std::vector<double>{0.0, 0.0}, 0.0);
  SampleDomain domain(2, 10);
  domain.assign(svr);
  for (const double sign : {1.0, -1.0}) {
    const double not_a_number = std::copysign(std::numeric_limits<double>::quiet_NaN(), sign);
    EXPECT_FALSE(domain.has_within(std::vector<double>{not_a_number, 0.0}, 1e300));
  }
}

}  // namespace
}  // namespace zerodrift::regression::testing
