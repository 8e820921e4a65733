// SPDX-License-Identifier: Apache-2.0
#include "common/compensation/temperature_inputs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/core/integer_time.h"

namespace zerodrift::compensation {
namespace {

using core::Reason;
using core::SensorTime;
using thermal::FeatureStatus;

constexpr SensorTime kSecond{1'000'000'000};

CompensationOptions two_probes() {
  CompensationOptions options;
  options.more_probes = {"case"};
  options.probe_stuck_s = 60.0;
  options.temperature_stale_s = 30.0;
  options.temperature_delay_s = 0.05;
  return options;
}

struct Inputs {
  CompensationOptions options = two_probes();
  TemperatureInputs temperatures{options, 0.0};

  void push(const char* probe, SensorTime time, double degc, bool measured = true) {
    core::TemperatureSample sample;
    sample.probe = probe;
    sample.time = time;
    sample.temperature_degc = degc;
    sample.measured = measured;
    temperatures.push(sample);
  }
};

// Law: a rate sample at t knows the temperatures stamped up to t - delay, and no later one.
TEST(TemperatureInputsLaws, ARateKnowsWhatIsAsOldAsTheDelay) {
  Inputs in;
  in.push("coil", kSecond, 20.0);
  in.push("case", kSecond, 30.0);
  const SensorTime known_from = kSecond + core::from_seconds(in.options.temperature_delay_s);
  EXPECT_FALSE(in.temperatures.take_for(known_from - SensorTime{1}));
  EXPECT_TRUE(std::isnan(in.temperatures.first_degc()));
  EXPECT_TRUE(in.temperatures.take_for(known_from));
  EXPECT_EQ(in.temperatures.first_degc(), 20.0);
  EXPECT_FALSE(in.temperatures.take_for(known_from)) << "each reading once";
}

// Law: complete is what every probe that speaks has spoken beyond.
TEST(TemperatureInputsLaws, CompleteMeansThatEveryProbeHasSpokenOrIsNotWaitedFor) {
  Inputs in;
  const SensorTime rate = kSecond + core::from_seconds(in.options.temperature_delay_s);
  in.push("coil", 2 * kSecond, 20.0);
  EXPECT_FALSE(in.temperatures.complete_for(rate));
  in.temperatures.limit("coil,other");
  EXPECT_TRUE(in.temperatures.complete_for(rate)) << "nobody publishes the case's";
  EXPECT_FALSE(in.temperatures.complete_for(rate + 2 * kSecond));
}

TEST(TemperatureInputsLaws, EveryReadingOfItsProbesIsCountedAndWhatIsNoneIsRefused) {
  Inputs in;
  in.push("nobody", kSecond, 20.0);
  EXPECT_EQ(in.temperatures.received(), 0U);
  in.push("coil", kSecond, std::numeric_limits<double>::quiet_NaN());
  in.push("coil", 2 * kSecond, 1e9);
  in.push("coil", core::kLatestUsableTime + kSecond, 20.0);
  EXPECT_EQ(in.temperatures.received(), 3U);
  EXPECT_EQ(in.temperatures.refused(), 3U);
  in.push("coil", 3 * kSecond, 0.0, false);  // it says that it measures nothing: no fault of it
  EXPECT_EQ(in.temperatures.refused(), 3U);
}

// Before: one line for all of them, which named neither the probe nor what would have been right.
TEST(TemperatureInputsLaws, OfARefusedReadingProbeValueAndBoundAreSaid) {
  Inputs in;
  const auto text = [&in](std::size_t probe) {
    return refused_text(in.temperatures.probes()[probe], in.temperatures.refused_by_probe()[probe],
                        in.options.track);
  };
  const auto push = [&in](SensorTime time, double degc) {
    in.push("coil", time, degc);
    in.temperatures.take_for(time + kSecond);
  };
  push(kSecond, std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(text(0), "a temperature of probe coil is nan, expected -100 to 250 degC; not used");
  push(2 * kSecond, -127.0);
  EXPECT_EQ(text(0), "a temperature of probe coil is -127, expected -100 to 250 degC; not used");
  push(3 * kSecond, 298.15);
  EXPECT_EQ(
      text(0),
      "a temperature of probe coil is 298.15, expected -100 to 250 degC (25 degC, if it is in "
      "kelvin); not used");
  push(4 * kSecond, 20.5);
  push(4 * kSecond, 20.5);
  EXPECT_EQ(text(0),
            "a temperature of probe coil is stamped 4.000000 s, not later than the one before; not "
            "used");
  push(5 * kSecond, 85.0);
  EXPECT_EQ(text(0),
            "a temperature of probe coil leaps from 20.5 to 85 degC, farther than a thermometer "
            "gets; not used unless the next one confirms it");
  in.push("coil", core::kLatestUsableTime + kSecond, 20.0);
  EXPECT_NE(text(0).find(" s, which no clock shows; not used"), std::string::npos) << text(0);
  EXPECT_EQ(in.temperatures.refused_by_probe()[0].count, 6U);
  EXPECT_EQ(in.temperatures.refused(), 6U);
  EXPECT_EQ(in.temperatures.refused_by_probe()[1].count, 0U);
}

// A probe that stands still while another moves is stuck; where all stand still nobody is.
TEST(TemperatureInputsLaws, AProbeIsStuckOnlyWhileAnotherMoves) {
  for (const double moves_degc_per_s : {0.0, 0.1}) {
    Inputs in;
    SensorTime now{0};
    for (int s = 1; s <= 120; ++s) {
      now = s * kSecond;
      in.push("coil", now, 20.0);
      in.push("case", now, 30.0 + moves_degc_per_s * s);
      in.temperatures.take_for(now + kSecond);
    }
    EXPECT_EQ(in.temperatures.reason(FeatureStatus::kReady, now),
              moves_degc_per_s > 0.0 ? Reason::kProbeStuck : Reason::kNone)
        << moves_degc_per_s;
    EXPECT_EQ(in.temperatures.reason(FeatureStatus::kTemperatureStale, now),
              Reason::kTemperatureStale);
  }
}

// Law: with the default settings, a probe that stands still while another warms by 5 degC in
// probe_stuck_s is stuck from that span on and not before, however often the probes are read.
TEST(TemperatureInputsLaws, WithTheDefaultSettingsAProbeIsStuckAfterItsSpanHoweverOftenItIsRead) {
  for (const double every_s : {0.1, 1.0, 2.0}) {
    Inputs in;
    in.options = {};
    in.options.more_probes = {"case"};
    in.temperatures = TemperatureInputs{in.options, 0.0};
    const double still_from_s = 300.0;
    double stuck_from_s = 0.0;
    for (int k = 1; k * every_s <= 2.0 * in.options.probe_stuck_s + still_from_s; ++k) {
      const double t_s = k * every_s;
      const SensorTime now = core::from_seconds(t_s);
      in.push("coil", now, 20.0 + 1e-4 * std::min(t_s, still_from_s));
      in.push("case", now, 30.0 + t_s / 180.0);
      in.temperatures.take_for(now + kSecond);
      const Reason reason = in.temperatures.reason(FeatureStatus::kReady, now);
      if (reason == Reason::kProbeStuck && stuck_from_s == 0.0) stuck_from_s = t_s;
      ASSERT_EQ(reason, stuck_from_s > 0.0 ? Reason::kProbeStuck : Reason::kNone) << t_s;
    }
    EXPECT_NEAR(stuck_from_s, still_from_s + in.options.probe_stuck_s, every_s)
        << "of a reading every " << every_s << " s";
  }
}

TEST(TemperatureInputsLaws, AReadingThatIsStaleIsNoneForThePrior) {
  Inputs in;
  in.push("coil", kSecond, 20.0);
  in.temperatures.take_for(2 * kSecond);
  EXPECT_EQ(in.temperatures.readings(31 * kSecond).front().temperature_degc, 20.0);
  EXPECT_TRUE(
      std::isnan(in.temperatures.readings(31 * kSecond + SensorTime{1}).front().temperature_degc));
}

TEST(TemperatureInputsLaws, WhereTimeBeginsAnewNothingIsKnownOfTheTimeBefore) {
  Inputs in;
  in.push("coil", 1000 * kSecond, 20.0);
  in.temperatures.take_for(1001 * kSecond);
  in.temperatures.restart();
  in.temperatures.forget_time();
  EXPECT_TRUE(std::isnan(in.temperatures.first_degc()));
  in.push("coil", kSecond, 21.0);
  EXPECT_TRUE(in.temperatures.take_for(2 * kSecond));
  EXPECT_EQ(in.temperatures.first_degc(), 21.0);
}

}  // namespace
}  // namespace zerodrift::compensation
