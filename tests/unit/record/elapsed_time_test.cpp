// SPDX-License-Identifier: Apache-2.0
// Rule: a clock that was set in a recording makes it neither longer nor shorter.
#include "common/record/elapsed_time.h"

#include <gtest/gtest.h>

#include <cmath>

namespace zerodrift::record {
namespace {

using core::SensorTime;

constexpr double kDayS = 86'400.0;

SensorTime at(double time_s) {
  return SensorTime{static_cast<std::int64_t>(std::llround(time_s * 1e9))};
}

class Elapsed : public testing::Test {
 protected:
  double add(double time_s) { return elapsed_.add(at(time_s), stream_); }
  // 200 Hz, beginning at `from_s`.
  double add_second(double from_s) {
    double last_s = 0.0;
    for (int i = 0; i < 200; ++i) last_s = add(from_s + i / 200.0);
    return last_s;
  }

  ElapsedTime elapsed_;
  ElapsedTime::Stream stream_;
};

TEST_F(Elapsed, IsFromTheFirstStampOnWhereTheClockGoesOn) {
  EXPECT_DOUBLE_EQ(add(100.0), 0.0);
  EXPECT_DOUBLE_EQ(add(100.5), 0.5);
  EXPECT_DOUBLE_EQ(add(130.0), 30.0);
  EXPECT_DOUBLE_EQ(add(129.75), 29.75) << "came a little late";
  EXPECT_DOUBLE_EQ(add(131.0), 31.0);
  EXPECT_EQ(elapsed_.step_count(), 0U);
}

TEST_F(Elapsed, LeavesOutWhatAClockWasSetBy) {
  EXPECT_NEAR(add_second(0.0), 0.995, 1e-6);
  EXPECT_NEAR(add_second(1.0 - kDayS), 1.99, 1e-6);
  EXPECT_NEAR(add_second(2.0 + 365 * kDayS), 2.985, 1e-6);
  EXPECT_NEAR(add_second(3.0), 3.98, 1e-6);
  EXPECT_NEAR(add_second(4.0 + kDayS), 4.975, 1e-6);
  ASSERT_EQ(elapsed_.steps().size(), 4U);
  EXPECT_NEAR(elapsed_.steps()[0].after_s, 0.995, 1e-6);
  EXPECT_NEAR(elapsed_.steps()[0].by_s, -kDayS, 0.01);
  EXPECT_NEAR(elapsed_.steps()[1].by_s, 366 * kDayS, 0.01);
  EXPECT_NEAR(elapsed_.steps()[2].by_s, -365 * kDayS, 0.01);
  EXPECT_NEAR(elapsed_.steps()[3].by_s, kDayS, 0.01);
}

TEST_F(Elapsed, OfASlowStreamEachStepCounts) {
  for (const double step_s : {61.0, 300.0, 1800.0}) {
    ElapsedTime elapsed;
    ElapsedTime::Stream stream;
    for (int i = 0; i < 100; ++i)
      EXPECT_NEAR(elapsed.add(at(i * step_s), stream), i * step_s, 1e-6);
    EXPECT_EQ(elapsed.step_count(), 0U) << step_s;
  }
}

TEST_F(Elapsed, AWildStampIsNoTime) {
  add_second(0.0);
  for (const SensorTime wild : {SensorTime::max(), SensorTime::min()}) {
    add_second(1.0);
    elapsed_.add(wild, stream_);
    EXPECT_LT(add_second(2.0), 10.0);
  }
  EXPECT_EQ(elapsed_.step_count(), 5U) << "each there and back, and a second that comes again";
}

// Rule: streams that stand behind each other in a file are no clock that was set; a clock that was
// set is one step, however many streams show it.
TEST_F(Elapsed, StreamsNeedNotBeInOrderAmongEachOther) {
  ElapsedTime::Stream other;
  add_second(0.0);
  add_second(1.0);
  for (int i = 0; i < 2; ++i) EXPECT_NEAR(elapsed_.add(at(i), other), i, 1e-9);
  EXPECT_EQ(elapsed_.step_count(), 0U);
  add_second(2.0 - kDayS);
  EXPECT_NEAR(elapsed_.add(at(3.0 - kDayS), other), 3.0, 0.01);
  EXPECT_NEAR(add(6.0 - kDayS), 6.0, 0.01);
  EXPECT_NEAR(elapsed_.add(at(4.0 - kDayS), other), 4.0, 0.01) << "in order among its own";
  EXPECT_EQ(elapsed_.step_count(), 1U);
}

TEST_F(Elapsed, OnlyTheFirstStepsAreKept) {
  for (int i = 0; i < 20; ++i) add(i % 2 == 0 ? 0.0 : -kDayS);
  EXPECT_EQ(elapsed_.steps().size(), 8U);
  EXPECT_GE(elapsed_.step_count(), 10U);
}

}  // namespace
}  // namespace zerodrift::record
