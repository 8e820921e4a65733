// SPDX-License-Identifier: Apache-2.0
#include "common/navigation/gyro_navigation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/core/units.h"

namespace zerodrift::navigation {
namespace {

using core::kRadPerDeg;
using core::radps_from_deg_h;

constexpr double kRateHz = 50.0;
constexpr double kLatitude = 48.0 * kRadPerDeg;

GyroNavigationOptions options() {
  GyroNavigationOptions o;
  o.attitude = {0.0, 0.0, 0.4};
  o.alignment_s = 20.0;
  o.filter.latitude_rad = kLatitude;
  return o;
}

// A gyro on a level vehicle that turns about down; its samples as the compensation publishes them.
class Vehicle {
 public:
  explicit Vehicle(BodyFrame body = BodyFrame::kForwardLeftUp) : frame(body) {
    exact.set(n_from_b({0.0, 0.0, 0.4}));
  }

  NavigationSample next(double turn_radps = 0.0) {
    ++k;
    const Vector3 rate = Vector3(0.0, 0.0, turn_radps) +
                         exact.n_from_b().conjugate() * earth_rate_radps_n(kLatitude);
    exact.advance(rate / kRateHz, 1.0 / kRateHz);
    NavigationSample sample;
    sample.sequence = static_cast<std::uint64_t>(k);
    sample.time = core::from_seconds(k / kRateHz);
    sample.interval_s = 1.0 / kRateHz;
    sample.valid = {true, true, true};
    sample.noise_variance.fill(noise * noise);
    sample.drift_variance.fill(claimed * claimed);
    truth = from_forward_right_down(rate, frame);
    for (std::size_t i = 0; i < 3; ++i) {
      sample.applied_drift_radps[i] = drift[i];
      sample.rate_radps[i] = truth[i] + noise * normal(random) + left[i];
    }
    return sample;
  }

  BodyFrame frame;
  core::PerAxis<double> drift{radps_from_deg_h(2.0), radps_from_deg_h(-1.0), radps_from_deg_h(1.5)};
  core::PerAxis<double> left{};  // of the drift in the compensated rate
  double noise = radps_from_deg_h(0.2);
  double claimed = radps_from_deg_h(0.02);  // sigma of the drift that was taken off
  Strapdown exact{earth_rate_radps_n(kLatitude)};
  core::PerAxis<double> truth{};
  std::mt19937_64 random{9};
  std::normal_distribution<double> normal;
  int k = 0;
};

void drive(GyroNavigation& navigation, Vehicle& vehicle, double duration_s, double turn_radps,
           std::vector<core::RateReferenceSample>* references = nullptr) {
  for (int n = 0; n < static_cast<int>(duration_s * kRateHz); ++n) {
    const NavigationSample sample = vehicle.next(turn_radps);
    navigation.push_truth(sample.time, vehicle.truth);
    navigation.push(sample);
    while (const auto reference = navigation.take_reference()) {
      if (references != nullptr) references->push_back(*reference);
    }
  }
}

TEST(GyroNavigationScenario, RawAndCompensatedAreJudgedAgainstTheTruthInEitherFrame) {
  for (const BodyFrame frame : {BodyFrame::kForwardLeftUp, BodyFrame::kForwardRightDown}) {
    GyroNavigationOptions o = options();
    o.frame = frame;
    o.updates = Updates::kNone;
    GyroNavigation navigation(o);
    Vehicle vehicle(frame);
    drive(navigation, vehicle, 30.0, 0.0);
    EXPECT_EQ(navigation.phase(), Phase::kNavigating);
    drive(navigation, vehicle, 600.0, 0.05);
    // 1.5 deg/h about down (FLU: up), from the end of the alignment on, and no more than the noise
    // in the compensated stream.
    const double hours = (630.0 - 21.5) / 3600.0;
    const double sign = frame == BodyFrame::kForwardLeftUp ? -1.0 : 1.0;
    EXPECT_NEAR(navigation.errors(Stream::kRaw).heading_now / kRadPerDeg, sign * 1.5 * hours, 0.01);
    EXPECT_LT(std::abs(navigation.errors(Stream::kCompensated).heading_now), 1e-5);
    EXPECT_NEAR(wrapped(navigation.attitude(Stream::kTruth).heading_rad -
                        attitude_of(vehicle.exact.n_from_b()).heading_rad),
                0.0, 1e-9);
  }
}

TEST(GyroNavigationScenario, RestReferencesAreEarthRateAtRestAndNothingElsewhere) {
  GyroNavigation navigation(options());
  Vehicle vehicle;
  std::vector<core::RateReferenceSample> references;
  drive(navigation, vehicle, 30.0, 0.0, &references);
  const double moved_s = 30.0;
  drive(navigation, vehicle, 20.0, 0.1, &references);
  drive(navigation, vehicle, 20.0, 0.0, &references);
  ASSERT_NEAR(static_cast<double>(references.size()), 700.0, 2.0);  // ten a second
  int valid_at_first = 0;
  int valid_later = 0;
  for (const auto& reference : references) {
    EXPECT_EQ(reference.kind, core::ReferenceKind::kRest);
    const double t = core::seconds(reference.time);
    const bool valid = reference.valid == core::PerAxis<bool>{true, true, true};
    if (!valid) {
      EXPECT_EQ(reference.valid, core::PerAxis<bool>{});
    }
    if (t > moved_s + 0.1 && t < 50.0) {
      EXPECT_FALSE(valid) << t;
    }
    valid_at_first += valid && t < moved_s ? 1 : 0;
    valid_later += valid && t > 50.0 ? 1 : 0;
    if (!valid || t > moved_s) continue;
    const auto earth = earth_rate_radps_b(kLatitude, {0.0, 0.0, 0.4});
    for (std::size_t i = 0; i < 3; ++i) {
      const double sigma = std::sqrt(reference.variance[i]);
      EXPECT_LT(sigma, radps_from_deg_h(0.3));
      EXPECT_NEAR(reference.rate_radps[i], earth[i], 4.0 * sigma);
    }
  }
  // From window, dwell and two blocks on: 3.6 s.
  EXPECT_NEAR(valid_at_first, 264, 5);
  EXPECT_NEAR(valid_later, 164, 10);
}

// Rule: a filter that starts anew with the heading of an earlier time, while the compensation knows
// the drift, gives nothing back about the horizontal and says so; where the drift isn't known yet,
// where what is left of the Earth's rate can't be its, and where heading and drift agree within
// what is known of them, it goes by what was given. Before: what it gave back was learned, 4 deg/h.
// Turned by `rate_at` of the time since the beginning.
template <typename RateAt>
void drive_by(GyroNavigation& navigation, Vehicle& vehicle, double duration_s, RateAt rate_at) {
  for (int n = 0; n < static_cast<int>(duration_s * kRateHz); ++n) {
    const NavigationSample sample = vehicle.next(rate_at(n / kRateHz));
    navigation.push_truth(sample.time, vehicle.truth);
    navigation.push(sample);
  }
}

// A vehicle that comes to rest without a jolt is below what rest is told by for seconds while it
// still turns at some deg/h.
TEST(GyroNavigationScenario, TheLastOfASmoothStopIsNotTakenForDrift) {
  for (const double fading_s : {0.5, 1.0, 2.0, 4.0, 8.0, 16.0}) {
    for (const double phase_s : {0.0, 0.3, 0.6, 0.9}) {
      SCOPED_TRACE(std::to_string(fading_s) + " s, " + std::to_string(phase_s));
      GyroNavigationOptions o = options();
      o.filter.heading_sigma_rad = 1e-5;
      GyroNavigation navigation(o);
      Vehicle vehicle;
      drive(navigation, vehicle, 60.0, 0.0);
      drive(navigation, vehicle, 120.0 + phase_s, 0.02);
      vehicle.claimed = radps_from_deg_h(1.0);  // what a drive leaves to be known
      drive_by(navigation, vehicle, 120.0,
               [&](double t) { return 0.02 * std::exp(-t / fading_s); });
      drive_by(navigation, vehicle, 60.0, [](double) { return 0.0; });
      const AttitudeFilter& filter = navigation.filter(Stream::kCompensated);
      ASSERT_TRUE(navigation.at_rest());
      EXPECT_LT(filter.drift_radps().norm(), radps_from_deg_h(0.3));
      const double heading = navigation.errors(Stream::kCompensated).heading_now;
      drive(navigation, vehicle, 600.0, 0.02);
      EXPECT_LT(std::abs(navigation.errors(Stream::kCompensated).heading_now - heading),
                0.05 * kRadPerDeg);
    }
  }
}

// A vehicle whose last rotation is steady for a few seconds, as one that swings out is about its
// turning point, looks as if it stood.
TEST(GyroNavigationScenario, WhatAFewSlowSteadySecondsTaughtIsTakenBack) {
  for (const double steady_s : {4.0, 6.0, 8.0}) {
    for (const double turn_deg_h : {5.0, -10.0, 20.0}) {
      SCOPED_TRACE(std::to_string(steady_s) + " s, " + std::to_string(turn_deg_h) + " deg/h");
      GyroNavigationOptions o = options();
      o.filter.heading_sigma_rad = 1e-5;
      GyroNavigation navigation(o);
      Vehicle vehicle;
      drive(navigation, vehicle, 60.0, 0.0);
      drive(navigation, vehicle, 120.0, 0.02);
      vehicle.claimed = radps_from_deg_h(2.0);
      drive(navigation, vehicle, steady_s, radps_from_deg_h(turn_deg_h));
      drive(navigation, vehicle, 40.0, 0.0);
      ASSERT_TRUE(navigation.at_rest());
      EXPECT_LT(navigation.filter(Stream::kCompensated).drift_radps().norm(),
                radps_from_deg_h(0.3));
      // What was turned so slowly is within what rest is told by; no more than that is wrong.
      EXPECT_LT(std::abs(navigation.errors(Stream::kCompensated).heading_now), 0.002 * kRadPerDeg);
    }
  }
}

// A table that begins to turn slowly under a gyro that stood for longer is refused for good.
TEST(GyroNavigationScenario, WhatManySecondsTaughtIsNotTakenBackForASlowRotation) {
  GyroNavigation navigation(options());
  Vehicle vehicle;
  drive(navigation, vehicle, 60.0, 0.0);
  drive(navigation, vehicle, 120.0, 0.02);
  drive(navigation, vehicle, 20.0, 0.0);
  drive(navigation, vehicle, 40.0, radps_from_deg_h(10.0));
  ASSERT_TRUE(navigation.at_rest());
  EXPECT_LT(navigation.filter(Stream::kCompensated).drift_radps().norm(), radps_from_deg_h(0.3));
  EXPECT_LT(navigation.filter(Stream::kRaw).drift_radps().norm(), radps_from_deg_h(3.3));
}

TEST(GyroNavigationScenario, AHeadingThatTheEarthsRateContradictsIsNotGivenBack) {
  struct Case {
    double error_rad;
    double claimed_deg_h;  // below 0: none
    bool has_earth_rate;
    bool is_doubted;
  };
  for (const Case& now :
       {Case{0.43, 0.02, true, true}, Case{-0.43, 0.33, true, true}, Case{3.0, 0.02, true, true},
        Case{0.43, -1.0, true, false}, Case{0.004, 0.02, true, false}, Case{0.43, 2.0, true, false},
        Case{0.43, 0.02, false, false}, Case{0.0, 0.02, true, false}}) {
    SCOPED_TRACE(std::to_string(now.error_rad) + " rad, claimed " +
                 std::to_string(now.claimed_deg_h) + (now.has_earth_rate ? "" : ", no Earth rate"));
    GyroNavigationOptions o = options();
    o.attitude.heading_rad += now.error_rad;
    GyroNavigation navigation(o);
    Vehicle vehicle;
    std::vector<core::RateReferenceSample> references;
    for (int n = 0; n < static_cast<int>(40.0 * kRateHz); ++n) {
      NavigationSample sample = vehicle.next();
      sample.drift_variance.fill(
          now.claimed_deg_h < 0.0 ? -1.0 : std::pow(radps_from_deg_h(now.claimed_deg_h), 2));
      for (std::size_t i = 0; i < 3 && !now.has_earth_rate; ++i)
        sample.rate_radps[i] -= vehicle.truth[i];
      navigation.push_truth(sample.time, vehicle.truth);
      navigation.push(sample);
      while (const auto reference = navigation.take_reference()) references.push_back(*reference);
    }
    EXPECT_EQ(navigation.heading_doubt().has_value(), now.is_doubted);
    const bool horizontal =
        std::any_of(references.begin(), references.end(),
                    [](const core::RateReferenceSample& r) { return r.valid[0] || r.valid[1]; });
    if (!now.is_doubted) continue;
    EXPECT_FALSE(horizontal);
    EXPECT_TRUE(references.back().valid[2]);
    EXPECT_FALSE(navigation.knows_truth());
    EXPECT_NEAR(std::abs(wrapped(navigation.heading_doubt()->found_rad - 0.4)), 0.0, 0.1);
    EXPECT_GT(std::sqrt(navigation.filter(Stream::kCompensated).covariance()(2, 2)),
              0.9 * std::abs(now.error_rad));
  }
}

TEST(GyroNavigationScenario,
     WithoutAHeadingItIsFoundAndHorizontalReferencesAreNotGivenWhereTooUncertain) {
  GyroNavigationOptions o = options();
  o.heading_known = false;
  o.attitude.heading_rad = 0.0;
  o.true_attitude = Attitude{0.0, 0.0, 0.4};
  o.largest_reference_sigma_radps = radps_from_deg_h(0.03);
  GyroNavigation navigation(o);
  Vehicle vehicle;
  std::vector<core::RateReferenceSample> references;
  drive(navigation, vehicle, 30.0, 0.0, &references);
  ASSERT_TRUE(navigation.compass().has_value());
  EXPECT_EQ(*navigation.compass(), CompassVerdict::kFound);
  EXPECT_NEAR(navigation.attitude(Stream::kCompensated).heading_rad, 0.4, 0.03);
  // 3 x 0.02 deg/h of claimed drift are 0.06 deg/h of Earth rate across north: too much for 0.03.
  bool vertical = false;
  for (const auto& reference : references) {
    EXPECT_FALSE(reference.valid[0] && reference.valid[1]);
    vertical = vertical || reference.valid[2];
  }
  EXPECT_TRUE(vertical);
}

TEST(GyroNavigationScenario, ASingleVerticalAxisNavigatesButKnowsNoNorth) {
  GyroNavigationOptions o = options();
  o.heading_known = false;
  GyroNavigation navigation(o);
  Vehicle vehicle;
  for (int n = 0; n < static_cast<int>(40.0 * kRateHz); ++n) {
    NavigationSample sample = vehicle.next();
    sample.valid = {false, false, true};
    sample.rate_radps[0] = sample.rate_radps[1] = std::nan("");
    navigation.push(sample);
  }
  EXPECT_EQ(*navigation.compass(), CompassVerdict::kAxisMissing);
  EXPECT_EQ(navigation.phase(), Phase::kNavigating);
  EXPECT_GT(navigation.counts(Stream::kCompensated).updates, 0U);
}

TEST(GyroNavigationScenario, ResidualsStateTheDriftWithTheEpochTheyWereSeenUnder) {
  GyroNavigationOptions o = options();
  o.residual_feedback = true;
  GyroNavigation navigation(o);
  Vehicle vehicle;
  vehicle.left = {0.0, 0.0, radps_from_deg_h(0.1)};
  std::vector<core::RateReferenceSample> all;
  drive(navigation, vehicle, 60.0, 0.0, &all);
  drive(navigation, vehicle, 20.0, 0.1, &all);
  int residuals = 0;
  for (const auto& reference : all) {
    if (reference.kind != core::ReferenceKind::kNavigationResidual) continue;
    ++residuals;
    EXPECT_LT(core::seconds(reference.time), 60.5) << "none in motion";
    if (core::seconds(reference.time) < 50.0) continue;
    // 1.5 applied and 0.1 left, within 5 of its sigmas.
    EXPECT_NEAR(reference.rate_radps[2], radps_from_deg_h(1.6),
                5.0 * std::sqrt(reference.variance[2]));
  }
  EXPECT_NEAR(residuals, 55, 4);  // one a second
}

// ------------------------------------------------------------------------------------------ abuse

// As it is until the compensation knows the drift. 2 deg/h of each sample are .28 of a mean.
TEST(GyroNavigationScenario, WhereNoNoiseIsStatedItsScatterTellsHowWellAMeanIsKnown) {
  for (const double noise_deg_h : {2.0, 20.0}) {
    GyroNavigation navigation(options());
    Vehicle vehicle;
    vehicle.noise = radps_from_deg_h(noise_deg_h);
    for (int n = 0; n < static_cast<int>(300.0 * kRateHz); ++n) {
      NavigationSample sample = vehicle.next();
      sample.noise_variance.fill(-1.0);
      sample.drift_variance.fill(-1.0);
      navigation.push(sample);
    }
    const StreamCounts& counts = navigation.counts(Stream::kRaw);
    EXPECT_GT(counts.updates, 280U);
    EXPECT_EQ(counts.rejected, 0U);
    EXPECT_NEAR(counts.nis_sum / static_cast<double>(counts.nis_degrees), 1.0, 0.2);
    const AttitudeFilter& raw = navigation.filter(Stream::kRaw);
    const double sigma = std::sqrt(raw.covariance()(5, 5));
    EXPECT_GT(sigma, vehicle.noise / std::sqrt(300.0 * kRateHz));
    EXPECT_NEAR(raw.drift_radps()[2], -vehicle.drift[2], 4.0 * sigma);
  }
}

TEST(GyroNavigationAbuse, BadSamplesAreCountedAndPoisonNothing) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  GyroNavigation navigation(options());
  Vehicle vehicle;
  drive(navigation, vehicle, 30.0, 0.0);
  NavigationSample out_of_order;
  for (int n = 0; n < 500; ++n) {
    NavigationSample sample = vehicle.next(0.02);
    navigation.push_truth(sample.time, vehicle.truth);
    switch (n % 25) {
      case 0: sample.rate_radps[1] = nan; break;
      case 3: sample.interval_s = n % 2 == 0 ? inf : 0.0; break;
      case 6: sample.applied_drift_radps[2] = inf; break;
      case 9:
        sample.drift_variance.fill(inf);
        sample.noise_variance.fill(nan);
        break;
      case 12: sample.rate_radps[0] = 1e300; break;
      case 15:
        navigation.push(sample);  // and again below
        break;
      case 18:  // behind the next one
        out_of_order = sample;
        out_of_order.late = true;
        continue;
      case 21: sample.clipped[2] = true; break;
      default: break;
    }
    navigation.push(sample);
    if (n % 25 == 19) navigation.push(out_of_order);
  }
  const NavigationCounts& counts = navigation.counts();
  EXPECT_EQ(counts.unusable, 80U);
  EXPECT_EQ(counts.duplicates, 20U);
  EXPECT_EQ(counts.late, 20U);
  EXPECT_EQ(counts.clipped, 20U);
  EXPECT_EQ(counts.gaps, 100U);  // each bad or late sample is one
  for (const Stream stream : {Stream::kRaw, Stream::kCompensated}) {
    EXPECT_TRUE(navigation.filter(stream).covariance().allFinite());
    EXPECT_TRUE(navigation.n_from_b(stream).coeffs().allFinite());
    // Turned through the gaps at a constant rate, but for the first, where the turn begins and half
    // of a step is missed; 0.2 deg/h of noise in 100 samples is nothing.
    const double missed = 0.5 * 0.02 / kRateHz;
    EXPECT_NEAR(std::abs(navigation.errors(stream).heading_now), missed, 0.001 * kRadPerDeg);
  }
}

TEST(GyroNavigationAbuse, ALongGapCostsTheHeadingItsCertaintyAndEndsTheHorizontalReferences) {
  GyroNavigation navigation(options());
  Vehicle vehicle;
  drive(navigation, vehicle, 30.0, 0.0);
  vehicle.k += static_cast<int>(5.0 * kRateHz);
  std::vector<core::RateReferenceSample> references;
  drive(navigation, vehicle, 20.0, 0.0, &references);
  EXPECT_EQ(navigation.counts().losses, 1U);
  EXPECT_GT(navigation.filter(Stream::kCompensated).covariance()(2, 2), 1.0);
  bool vertical = false;
  for (const auto& reference : references) {
    EXPECT_FALSE(reference.valid[0]);
    EXPECT_FALSE(reference.valid[1]);
    vertical = vertical || reference.valid[2];
  }
  EXPECT_TRUE(vertical) << "Earth's vertical rate needs no heading";
}

TEST(GyroNavigationAbuse, TimeSetBackAndANewEpochGoOn) {
  GyroNavigation navigation(options());
  Vehicle vehicle;
  drive(navigation, vehicle, 30.0, 0.0);
  vehicle.k = 0;
  drive(navigation, vehicle, 30.0, 0.0);
  EXPECT_EQ(navigation.counts().time_restarts, 1U);
  EXPECT_TRUE(navigation.at_rest());
  vehicle.drift[2] += radps_from_deg_h(0.3);  // another model: the compensated rate jumps back
  for (int n = 0; n < 500; ++n) {
    NavigationSample sample = vehicle.next();
    sample.model_epoch = 1;
    sample.rate_radps[2] -= radps_from_deg_h(0.3);
    navigation.push(sample);
  }
  // What is left jumped by as much, and the filter knew.
  EXPECT_EQ(navigation.counts(Stream::kCompensated).rejected, 0U);
}

// A turn by 180 degrees, in the middle of which stamps begin to be off by `by_s`; no sample is
// missing, and its number says so. `is_marked`: as the compensation marks what is behind.
struct StepInATurn {
  double error_rad = 0.0;
  double sigma_rad = 0.0;

  StepInATurn(double by_s, bool is_marked) {
    GyroNavigation navigation(options());
    Vehicle vehicle;
    drive(navigation, vehicle, 40.0, 0.0);
    constexpr double kTurnRadps = 30.0 * kRadPerDeg;
    core::SensorTime newest = navigation.time();
    const auto push = [&](double off_s, double turn_radps) {
      NavigationSample sample = vehicle.next(turn_radps);
      sample.time += core::from_seconds(off_s);
      sample.late = is_marked && sample.time <= newest;
      newest = std::max(newest, sample.time);
      navigation.push(sample);
    };
    for (int n = 0; n < static_cast<int>(3.0 * kRateHz); ++n) push(0.0, kTurnRadps);
    for (int n = 0; n < static_cast<int>(3.0 * kRateHz); ++n) push(by_s, kTurnRadps);
    for (int n = 0; n < static_cast<int>(2.0 * kRateHz); ++n) push(by_s, 0.0);
    const double truth = attitude_of(vehicle.exact.n_from_b()).heading_rad;
    const double found = navigation.attitude(Stream::kCompensated).heading_rad;
    error_rad = std::remainder(found - truth, 2.0 * std::numbers::pi);
    sigma_rad = std::sqrt(navigation.filter(Stream::kCompensated).covariance()(2, 2));
  }
};

// What a clock that is set back by less than a second does to stamps costs no heading.
TEST(GyroNavigationAbuse, AClockThatIsSetBackALittleInATurnCostsNoHeading) {
  for (const double by_s : {0.05, 0.1, 0.3, 0.7, 0.95}) {
    for (const bool is_marked : {false, true}) {
      const StepInATurn back(-by_s, is_marked);
      EXPECT_LT(std::abs(back.error_rad), 0.05 * kRadPerDeg) << by_s << is_marked;
      EXPECT_LT(back.sigma_rad, 0.5 * kRadPerDeg) << by_s << is_marked;
    }
  }
}

// Set forward, it can't be told from samples that are missing: the heading says that it may be
// wrong.
TEST(GyroNavigationAbuse, AClockThatIsSetForwardInATurnCostsTheHeadingsCertainty) {
  for (const double by_s : {0.05, 0.1, 0.2, 0.24, 0.3, 1.0}) {
    const StepInATurn forward(by_s, false);
    EXPECT_LT(std::abs(forward.error_rad), 1.5 * forward.sigma_rad) << by_s;
  }
}

TEST(GyroNavigationAbuse, ATruthThatEndsHoldsNothingUp) {
  GyroNavigation navigation(options());
  Vehicle vehicle;
  drive(navigation, vehicle, 30.0, 0.0);
  for (int n = 0; n < 20; ++n) navigation.push(vehicle.next());
  EXPECT_EQ(navigation.sequence(), 1500U) << "they wait";
  navigation.give_up_waiting();
  EXPECT_EQ(navigation.sequence(), 1520U);
  for (int n = 0; n < 20; ++n) navigation.push(vehicle.next());
  EXPECT_EQ(navigation.sequence(), 1540U);
  EXPECT_EQ(navigation.counts().truth_missing, 40U);
}

// Rule: true rates that are missing for longer than is bridged make no true attitude any more: what
// was judged by then stays, and nothing after it is judged. Before: the truth was turned through
// the gap at the rates around it, and the filters judged by that.
TEST(GyroNavigationAbuse, ATruthWithAHoleJudgesNothingBehindIt) {
  for (const bool has_rates : {true, false}) {
    GyroNavigation navigation(options());
    Vehicle vehicle;
    drive(navigation, vehicle, 40.0, 0.0);
    drive(navigation, vehicle, 10.0, 0.2);
    const auto judged = navigation.errors(Stream::kRaw).samples;
    EXPECT_TRUE(navigation.knows_truth());
    for (int n = 0; n < 400; ++n) {  // 8 s
      const NavigationSample sample = vehicle.next(-0.1);
      if (has_rates) navigation.push(sample);
    }
    navigation.give_up_waiting();
    drive(navigation, vehicle, 5.0, 0.0);
    EXPECT_FALSE(navigation.knows_truth());
    EXPECT_EQ(navigation.truth_lost_at(), core::from_seconds(58.02));
    EXPECT_EQ(navigation.errors(Stream::kRaw).samples, judged);
    EXPECT_EQ(navigation.counts().losses, has_rates ? 0U : 1U);
  }
}

// Rule: true rates that at rest are not the Earth's in the attitude that is given judge nothing,
// live as in a record; their noise alone is no objection. Before: errors against a turntable's
// angle or another frame were published as those of the filters.
TEST(GyroNavigationAbuse, ATruthThatIsNotTheEarthsAtRestJudgesNothing) {
  enum class Kind { kAgainstStars, kNoisy, kAgainstEarth, kOtherFrame, kOtherUnit };
  for (const Kind kind : {Kind::kAgainstStars, Kind::kNoisy, Kind::kAgainstEarth, Kind::kOtherFrame,
                          Kind::kOtherUnit}) {
    GyroNavigation navigation(options());
    Vehicle vehicle;
    std::mt19937 random(5);
    std::normal_distribution<double> normal;
    const Vector3 earth_n = earth_rate_radps_n(kLatitude);
    const auto drive_for = [&](double duration_s, double turn_radps) {
      for (int n = 0; n < static_cast<int>(duration_s * kRateHz); ++n) {
        const core::PerAxis<double> earth = from_forward_right_down(
            vehicle.exact.n_from_b().conjugate() * earth_n, BodyFrame::kForwardLeftUp);
        const NavigationSample sample = vehicle.next(turn_radps);
        core::PerAxis<double> truth = vehicle.truth;
        for (std::size_t i = 0; i < 3; ++i) {
          if (kind == Kind::kNoisy) truth[i] += radps_from_deg_h(100.0) * normal(random);
          if (kind == Kind::kAgainstEarth) truth[i] -= earth[i];
          if (kind == Kind::kOtherFrame && i > 0) truth[i] = -truth[i];
          if (kind == Kind::kOtherUnit) truth[i] /= kRadPerDeg;
        }
        navigation.push_truth(sample.time, truth);
        navigation.push(sample);
      }
    };
    drive_for(40.0, 0.0);
    drive_for(60.0, 0.05);
    const bool is_truth = kind == Kind::kAgainstStars || kind == Kind::kNoisy;
    EXPECT_EQ(navigation.knows_truth(), is_truth) << static_cast<int>(kind);
    EXPECT_EQ(navigation.truth_doubt().has_value(), !is_truth) << static_cast<int>(kind);
    EXPECT_EQ(navigation.errors(Stream::kRaw).samples > 0, is_truth) << static_cast<int>(kind);
  }
}

// Rule: true rates alone don't say which way the vehicle looked at first.
TEST(GyroNavigationAbuse, WithoutATrueHeadingNothingIsJudged) {
  GyroNavigationOptions o = options();
  o.heading_known = false;
  o.attitude.heading_rad = 0.0;
  GyroNavigation navigation(o);
  Vehicle vehicle;
  drive(navigation, vehicle, 60.0, 0.0);
  EXPECT_TRUE(navigation.truth_received());
  EXPECT_FALSE(navigation.truth_has_start());
  EXPECT_FALSE(navigation.knows_truth());
  EXPECT_EQ(navigation.errors(Stream::kRaw).samples, 0U);
}

TEST(GyroNavigationAbuse, WrongOptionsAreRefusedWithTheirKey) {
  GyroNavigationOptions o = options();
  o.heading_known = false;
  o.filter.latitude_rad.reset();
  EXPECT_EQ(o.validate()->substr(0, 12), "latitude_rad");
  EXPECT_THROW(GyroNavigation{o}, std::invalid_argument);
  o = options();
  o.reference_period_s = 0.0;
  EXPECT_EQ(o.validate()->substr(0, 18), "reference_period_s");
}

}  // namespace
}  // namespace zerodrift::navigation
