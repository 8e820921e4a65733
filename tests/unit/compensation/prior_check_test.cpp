// SPDX-License-Identifier: Apache-2.0
// A prior that makes the changes of the drift larger than they are is found, and no other.
#include "common/compensation/prior_check.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <functional>
#include <numbers>
#include <string>

#include "tests/unit/compensation/prior_models.h"

namespace zerodrift::compensation {
namespace {

using testing::Random;

constexpr double kSigma = 0.05;  // of a label, deg/h; labels of 20 s

struct Drift {
  double per_degc = 0.3;
  double walk = 0.0;     // deg/h in the root of an hour
  double warm_up = 0.0;  // deg/h, gone with 50 min
};

double cycles(double time_s) {
  return 20.0 * std::sin(2.0 * std::numbers::pi * time_s / 7200.0);
}

double warms_up(double time_s) {
  return 25.0 * (1.0 - std::exp(-time_s / 2000.0));
}

// Six hours whose drift is .3 deg/h/degC of the temperature; the prior has `times` as much.
std::uint64_t found_of(double times, const Drift& is, double (*temperature_degc)(double),
                       std::uint64_t seed) {
  PriorCheck check;
  Random random(seed);
  double walked = 0.0;
  for (int k = 0; k < 1080; ++k) {
    const double time_s = 20.0 * k;
    const double degc = temperature_degc(time_s);
    walked += is.walk * std::sqrt(20.0 / 3600.0) * random.gaussian();
    const double drift = is.per_degc * degc + walked + is.warm_up * std::exp(-time_s / 3000.0);
    check.add(core::Axis::kY, drift + kSigma * random.gaussian(), times * 0.3 * degc,
              kSigma * kSigma);
  }
  return check.found();
}

// Rule: the right one isn't, whatever the drift does beside it; nor one that is off by less than
// what it is right about.
TEST(PriorCheck, APriorThatHelpsIsNotFound) {
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    for (auto* temperature : {cycles, warms_up}) {
      for (const Drift& is :
           {Drift{}, Drift{.walk = 2.0}, Drift{.walk = 10.0}, Drift{.walk = 2.0, .warm_up = -15.0}})
        EXPECT_EQ(found_of(1.0, is, temperature, seed), 0U) << seed;
      for (const double times : {0.1, 1.5, 1.8})
        EXPECT_EQ(found_of(times, {.walk = 0.5}, temperature, seed), 0U) << seed << ", " << times;
    }
  }
}

TEST(PriorCheck, OneThatCostsIsFoundOnceTheTemperatureHasGoneAndComeBack) {
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    for (const double times : {3.0, 10.0, -0.5, -3.0}) {
      EXPECT_EQ(found_of(times, {.walk = 0.5}, cycles, seed), 1U) << seed << ", " << times;
      EXPECT_EQ(found_of(times, {.walk = 0.5}, warms_up, seed), 0U) << seed << ", " << times;
    }
  }
  EXPECT_EQ(found_of(1.0, {.per_degc = 0.0, .walk = 0.5}, cycles, 1), 1U) << "nothing of it is so";
}

// Rule: a bias that a new start gives is no answer of the drift, and sums stay numbers where labels
// have no noise.
TEST(PriorCheck, ANewStartAndLabelsWithoutNoiseAreNoAnswers) {
  PriorCheck check;
  double bias = 0.0;
  for (int start = 0; start < 100; ++start) {
    check.restart();
    bias = -bias + (start % 2 == 0 ? 50.0 : 0.0);
    for (int k = 0; k < 2; ++k) {
      const double prior = (start % 2 == 0 ? -1.0 : 1.0) * k;
      check.add(core::Axis::kX, bias + prior, prior, kSigma * kSigma);
    }
  }
  EXPECT_EQ(check.found(), 0U);
  for (int k = 0; k < 1000; ++k) check.add(core::Axis::kX, 1e3 * k, 1e-300 * (k % 2), 0.0);
  std::string bytes;
  core::StateArchive out(bytes);
  check.carry(out);
  core::StateArchive in{std::string_view(bytes)};
  PriorCheck same;
  same.carry(in);
  EXPECT_TRUE(in.ok());
}

}  // namespace
}  // namespace zerodrift::compensation
