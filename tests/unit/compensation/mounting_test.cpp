// SPDX-License-Identifier: Apache-2.0
// Where the gyro sits in the vehicle changes nothing but the frame.
#include "common/compensation/mounting.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "common/compensation/compensator.h"
#include "tests/unit/compensation/synthetic_gyro.h"

namespace zerodrift::compensation {
namespace {

testing::Record moving_record() {
  return testing::make_record({.duration_s = 400.0,
                               .low_degc = 20.0,
                               .high_degc = 30.0,
                               .motion = testing::turn(250.0, 20.0, 0.05)});
}

// As a gyro measures it that sits otherwise: rate of the gyro = turned * rate in b.
testing::Record turned(const testing::Record& record, const Mounting& turning) {
  testing::Record other = record;
  for (auto& sample : other.rates) sample.rate_radps = turning.rate_radps_b(sample.rate_radps);
  return other;
}

double largest_difference(const std::vector<core::CompensatedSample>& one,
                          const std::vector<core::CompensatedSample>& other) {
  double largest = one.size() == other.size() ? 0.0 : std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < std::min(one.size(), other.size()); ++k) {
    for (std::size_t i = 0; i < core::kAxisCount; ++i) {
      largest = std::max(largest, std::abs(one[k].rate_radps[i] - other[k].rate_radps[i]));
      EXPECT_EQ(one[k].reason[i], other[k].reason[i]) << k;
    }
  }
  return largest;
}

std::vector<core::CompensatedSample> answers_of(const testing::Record& record,
                                                const MountingOptions& mounting) {
  CompensationOptions options = testing::options();
  options.mounting = mounting;
  Compensator compensator{options};
  return testing::run(compensator, record);
}

// Rule: the identity, in any of its three forms, changes no bit.
TEST(MountingLaws, TheIdentityIsNoMounting) {
  const testing::Record record = moving_record();
  const auto plain = answers_of(record, {});
  for (const MountingOptions& identity :
       {MountingOptions{.axes = {"x", "y", "z"}},
        MountingOptions{.matrix = {1, 0, 0, 0, 1, 0, 0, 0, 1}},
        MountingOptions{.general_matrix = {1, 0, 0, 0, 1, 0, 0, 0, 1}}})
    EXPECT_EQ(largest_difference(plain, answers_of(record, identity)), 0.0);
}

// Rule: a gyro that is turned, with the mounting that turns it back, gives the same answers: to the
// bit where axes are only exchanged and reversed, else to rounding. Rates are below 0.1 rad/s and a
// model's answers depend on a label by a factor below 1e4, so 1e-9 deg/h would be 5e-15 rad/s;
// 1e-6 deg/h bounds what rounding of 1e-17 rad/s can become.
TEST(MountingLaws, TurnedThereAndBackNothingIsChanged) {
  const testing::Record record = moving_record();
  const auto plain = answers_of(record, {});
  const Mounting exchange({.axes = {"z", "-x", "y"}});
  EXPECT_EQ(
      largest_difference(plain, answers_of(turned(record, exchange), {.axes = {"-y", "z", "x"}})),
      0.0);
  const double c = std::cos(0.4);
  const double s = std::sin(0.4);
  const MountingOptions there{.matrix = {c, s, 0, -s, c, 0, 0, 0, 1}};
  const MountingOptions back{.matrix = {c, -s, 0, s, c, 0, 0, 0, 1}};
  EXPECT_LT(largest_difference(plain, answers_of(turned(record, Mounting(there)), back)),
            1e-6 * kDegH);
}

// Rule: an axis of b needs every axis of the gyro that it is made of, and no other.
TEST(Mounting, AnAxisIsValidAndUnclippedOnlyWithAllThatItIsMadeOf) {
  core::AngularRateSample sample;
  sample.rate_radps = {1.0, std::numeric_limits<double>::quiet_NaN(), 3.0};
  sample.valid = {true, false, true};
  sample.clipped = {false, false, true};
  const auto exchanged = Mounting({.axes = {"-y", "x", "z"}}).in_b(sample);
  EXPECT_EQ(exchanged.valid, (core::PerAxis<bool>{false, true, true}));
  EXPECT_EQ(exchanged.clipped, (core::PerAxis<bool>{false, false, true}));
  EXPECT_EQ(exchanged.rate_radps[1], 1.0);
  const auto mixed = Mounting({.general_matrix = {1, 0, 0, 0, 1, 0.05, 0, 0, 1}}).in_b(sample);
  EXPECT_EQ(mixed.valid, (core::PerAxis<bool>{true, false, true}));
  EXPECT_EQ(mixed.clipped, (core::PerAxis<bool>{false, true, true}));
}

// Rule: what can't be a mounting is refused by its key.
TEST(Mounting, WhatIsNoneIsRefused) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const MountingOptions& wrong :
       {MountingOptions{.axes = {"x", "x", "z"}}, MountingOptions{.axes = {"x", "y", "w"}},
        MountingOptions{.axes = {"x", "y", "z", "x"}}, MountingOptions{.axes = {"x", "y", "--z"}},
        MountingOptions{.matrix = {1, 0, 0}},
        MountingOptions{.matrix = std::vector<double>(9, 0.0)},
        MountingOptions{.matrix = {nan, 0, 0, 0, 1, 0, 0, 0, 1}},
        MountingOptions{.general_matrix = {1, 0, 0, 0, 1, 0, 0, 0, 2}}}) {
    const auto line = Mounting::find_wrong(wrong);
    ASSERT_TRUE(line);
    EXPECT_EQ(line->substr(0, 8), "mounting");
  }
}

}  // namespace
}  // namespace zerodrift::compensation
