// SPDX-License-Identifier: Apache-2.0
// Domain types to messages and back: every value bit for bit, what is not finite made invalid.
#include "common/dds/conversions.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <string>

namespace zerodrift::dds {
namespace {

using core::AngularRateSample;
using core::CompensatedSample;
using core::PerAxis;
using core::RateReferenceSample;
using core::SensorTime;
using core::TemperatureSample;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();
// Largest and smallest magnitudes, both zeros, and a value with all digits.
constexpr double kAwkward[] = {0.1 + 0.2,
                               -0.0,
                               0.0,
                               std::numeric_limits<double>::denorm_min(),
                               -std::numeric_limits<double>::max(),
                               1e-300};
constexpr std::uint64_t kLargeSequence = 0x8000000000000005ULL;

void expect_same_bits(double found, double expected) {
  EXPECT_EQ(std::bit_cast<std::uint64_t>(found), std::bit_cast<std::uint64_t>(expected))
      << found << " is not " << expected;
}

template <typename Values>
void expect_same_bits_each(const Values& found, const Values& expected) {
  for (std::size_t i = 0; i < expected.size(); ++i) expect_same_bits(found[i], expected[i]);
}

// All eight combinations of three flags.
PerAxis<bool> flags(unsigned bits) {
  return {(bits & 1U) != 0, (bits & 2U) != 0, (bits & 4U) != 0};
}

AngularRateSample rate_sample() {
  return {.sequence = kLargeSequence,
          .time = SensorTime{-1234567890123456789},
          .interval_s = 0.005,
          .rate_radps = {0.1 + 0.2, -1e-300, 7.0},
          .valid = {true, true, true},
          .clipped = {false, false, true},
          .clock = core::ClockSource::kReplay};
}

TEST(AngularRateConversion, ReturnsEveryFieldBitForBit) {
  for (const double value : kAwkward) {
    AngularRateSample sample = rate_sample();
    sample.rate_radps = {value, -value, value};
    const AngularRateSample back = from_message(to_message(sample, 7, 99));
    EXPECT_EQ(back.sequence, sample.sequence);
    EXPECT_EQ(back.time, sample.time);
    EXPECT_EQ(back.clock, sample.clock);
    expect_same_bits(back.interval_s, sample.interval_s);
    expect_same_bits_each(back.rate_radps, sample.rate_radps);
    sample.valid.fill(core::is_rate(value));
    EXPECT_EQ(back.valid, sample.valid);
    EXPECT_EQ(back.clipped, sample.clipped);
  }
}

TEST(AngularRateConversion, CarriesEveryCombinationOfFlagsInItsOwnBits) {
  for (unsigned valid = 0; valid < 8; ++valid) {
    for (unsigned clipped = 0; clipped < 8; ++clipped) {
      AngularRateSample sample = rate_sample();
      sample.valid = flags(valid);
      sample.clipped = flags(clipped);
      const msg::AngularRate message = to_message(sample, 7, 0);
      EXPECT_EQ(message.validity(), valid | clipped << 8U);
      EXPECT_EQ(from_message(message).valid, sample.valid);
      EXPECT_EQ(from_message(message).clipped, sample.clipped);
    }
  }
}

TEST(AngularRateConversion, GivesGyroStampAndDeltaAngle) {
  const AngularRateSample sample = rate_sample();
  const msg::AngularRate message = to_message(sample, 7, 123456789);
  EXPECT_EQ(message.gyro_id(), 7U);
  EXPECT_EQ(message.publish_time_ns(), 123456789);
  expect_same_bits(message.interval_s(), sample.interval_s);
  for (std::size_t i = 0; i < core::kAxisCount; ++i) {
    expect_same_bits(message.delta_angle_rad()[i], sample.rate_radps[i] * sample.interval_s);
  }
}

TEST(AngularRateConversion, MakesOnlyTheAxisThatCanBeNoRateInvalid) {
  for (const double bad : {kNaN, kInfinity, -kInfinity, 1e308, -1e300, 9.97e36, 1.1e6}) {
    for (std::size_t axis = 0; axis < core::kAxisCount; ++axis) {
      AngularRateSample sample = rate_sample();
      sample.rate_radps[axis] = bad;
      const AngularRateSample back = from_message(to_message(sample, 7, 0));
      for (std::size_t i = 0; i < core::kAxisCount; ++i) EXPECT_EQ(back.valid[i], i != axis);
      expect_same_bits_each(back.rate_radps, sample.rate_radps);
    }
  }
}

TEST(AngularRateConversion, GivesNoIntervalWhereTheMessageHasNoUsableOne) {
  for (const double bad : {kNaN, kInfinity, -kInfinity, -0.005, 0.0}) {
    msg::AngularRate message = to_message(rate_sample(), 7, 0);
    message.interval_s(bad);
    expect_same_bits(from_message(message).interval_s, 0.0);
  }
}

TEST(AngularRateConversion, TakesAnUnknownClockNumberForAnUnknownClock) {
  for (const std::uint32_t number : {5U, 255U, 0xffffffffU}) {
    msg::AngularRate message = to_message(rate_sample(), 7, 0);
    message.clock_source(number);
    EXPECT_EQ(from_message(message).clock, core::ClockSource::kUnknown);
  }
}

TEST(TemperatureConversion, ReturnsEveryFieldBitForBit) {
  for (const double value : kAwkward) {
    for (const bool measured : {true, false}) {
      const TemperatureSample sample{.probe = "coil_outer",
                                     .sequence = kLargeSequence,
                                     .time = SensorTime{-5},
                                     .temperature_degc = value,
                                     .measured = measured,
                                     .clock = core::ClockSource::kSimulation};
      const msg::Temperature message = to_message(sample, 9);
      EXPECT_EQ(message.gyro_id(), 9U);
      const TemperatureSample back = from_message(message);
      EXPECT_EQ(back.probe, sample.probe);
      EXPECT_EQ(back.sequence, sample.sequence);
      EXPECT_EQ(back.time, sample.time);
      expect_same_bits(back.temperature_degc, sample.temperature_degc);
      EXPECT_EQ(back.measured, sample.measured);
      EXPECT_EQ(back.clock, sample.clock);
    }
  }
}

TEST(TemperatureConversion, CarriesAReadingThatIsNotFiniteAsItCame) {
  TemperatureSample sample;
  sample.temperature_degc = kNaN;
  expect_same_bits(from_message(to_message(sample, 1)).temperature_degc, kNaN);
}

TEST(TemperatureConversion, CarriesTheLongestProbeNameWhole) {
  TemperatureSample sample;
  sample.probe = std::string(32, 'p');
  EXPECT_EQ(from_message(to_message(sample, 1)).probe, sample.probe);
  sample.probe.clear();
  EXPECT_EQ(from_message(to_message(sample, 1)).probe, "");
}

core::EnvironmentSample environment_sample() {
  core::EnvironmentSample sample{.sequence = kLargeSequence,
                                 .time = SensorTime{-5},
                                 .channels = 0b1'1111'1111U,
                                 .clock = core::ClockSource::kSimulation};
  for (std::size_t i = 0; i < core::kEnvironmentChannels; ++i)
    core::channel(sample.values, i) = kAwkward[i % std::size(kAwkward)];
  return sample;
}

TEST(EnvironmentConversion, ReturnsEveryFieldBitForBit) {
  const core::EnvironmentSample sample = environment_sample();
  const msg::Environment message = to_message(sample, 9);
  EXPECT_EQ(message.gyro_id(), 9U);
  EXPECT_EQ(message.measured(), sample.channels);
  const core::EnvironmentSample back = from_message(message);
  EXPECT_EQ(back.sequence, sample.sequence);
  EXPECT_EQ(back.time, sample.time);
  EXPECT_EQ(back.channels, sample.channels);
  EXPECT_EQ(back.clock, sample.clock);
  for (std::size_t i = 0; i < core::kEnvironmentChannels; ++i)
    expect_same_bits(core::channel(back.values, i), core::channel(sample.values, i));
}

TEST(EnvironmentConversion, HasNoValueWhereNothingFiniteWasMeasuredOfAChannelThatThereIs) {
  for (std::size_t i = 0; i < core::kEnvironmentChannels; ++i) {
    const auto expect_without = [i](const msg::Environment& message) {
      const core::EnvironmentSample back = from_message(message);
      for (std::size_t k = 0; k < core::kEnvironmentChannels; ++k)
        EXPECT_EQ(std::isnan(core::channel(back.values, k)), k == i) << k << " of " << i;
      return back;
    };
    for (const double bad : {kNaN, kInfinity, -kInfinity}) {
      core::EnvironmentSample sample = environment_sample();
      core::channel(sample.values, i) = bad;
      msg::Environment message = to_message(sample, 1);
      EXPECT_TRUE(core::has_channel(expect_without(message).channels, i));
      message.measured(~0U);  // it lies
      expect_without(message);
    }
    msg::Environment message = to_message(environment_sample(), 1);
    message.channels(~(1U << i));  // also of bits that mean nothing
    EXPECT_EQ(expect_without(message).channels, 0b1'1111'1111U & ~(1U << i));
    message = to_message(environment_sample(), 1);
    message.measured(~(1U << i));
    EXPECT_TRUE(core::has_channel(expect_without(message).channels, i));
  }
}

RateReferenceSample reference_sample() {
  return {.time = SensorTime{987654321},
          .rate_radps = {0.1 + 0.2, -0.0, 1e-300},
          .variance = {1e-12, 0.0, std::numeric_limits<double>::denorm_min()},
          .valid = {true, true, true},
          .kind = core::ReferenceKind::kNavigationResidual,
          .model_epoch = kLargeSequence};
}

TEST(RateReferenceConversion, ReturnsEveryFieldBitForBit) {
  for (unsigned valid = 0; valid < 8; ++valid) {
    RateReferenceSample sample = reference_sample();
    sample.valid = flags(valid);
    const msg::RateReference message = to_message(sample, 3);
    EXPECT_EQ(message.gyro_id(), 3U);
    EXPECT_EQ(message.validity(), valid);
    const RateReferenceSample back = from_message(message);
    EXPECT_EQ(back.time, sample.time);
    EXPECT_EQ(back.kind, sample.kind);
    EXPECT_EQ(back.model_epoch, sample.model_epoch);
    expect_same_bits_each(back.rate_radps, sample.rate_radps);
    expect_same_bits_each(back.variance, sample.variance);
    EXPECT_EQ(back.valid, sample.valid);
  }
}

TEST(RateReferenceConversion, MakesAnAxisInvalidWhoseRateOrVarianceIsUnusable) {
  for (const double bad : {kNaN, kInfinity, -kInfinity, 1e308, -1e300, 1.1e6}) {
    RateReferenceSample sample = reference_sample();
    sample.rate_radps[1] = bad;
    EXPECT_EQ(from_message(to_message(sample, 1)).valid, (PerAxis<bool>{true, false, true}));
  }
  for (const double bad : {kNaN, kInfinity, -1e-12}) {
    RateReferenceSample sample = reference_sample();
    sample.variance[2] = bad;
    EXPECT_EQ(from_message(to_message(sample, 1)).valid, (PerAxis<bool>{true, true, false}));
  }
}

TEST(RateReferenceConversion, TakesAnUnknownKindForNone) {
  msg::RateReference message = to_message(reference_sample(), 1);
  message.kind(5);
  EXPECT_EQ(from_message(message).kind, core::ReferenceKind::kNone);
}

CompensatedSample compensated_sample() {
  CompensatedSample sample;
  sample.raw = rate_sample();
  sample.raw.rate_radps = {1.0, -2.0, 3.0};
  sample.late = true;
  sample.applied_drift_radps = {0.1, -1e-9, 0.0};
  for (std::size_t i = 0; i < core::kAxisCount; ++i) {
    sample.rate_radps[i] = sample.raw.rate_radps[i] - sample.applied_drift_radps[i];
  }
  sample.drift_variance = {1e-14, 2e-14, 0.1 + 0.2};
  sample.sensor_variance = {1e-10, 2e-10, 3e-10};
  sample.mode = {core::Mode::kLearning, core::Mode::kFallback, core::Mode::kOutOfDomain};
  sample.reason = {core::Reason::kNone, core::Reason::kProbeStuck, core::Reason::kOutsideLearned};
  sample.rung = {core::Rung::kOnlineSvr, core::Rung::kStationaryBias,
                 core::Rung::kFactoryPolynomial};
  sample.model_epoch = kLargeSequence;
  sample.publish_time_ns = 11;
  sample.ingress_time_ns = -12;
  return sample;
}

msg::CompensatedRate message_of(const CompensatedSample& sample) {
  msg::CompensatedRate message;
  to_message(sample, 21, 4, message);
  return message;
}

TEST(CompensatedRateConversion, ReturnsEveryFieldBitForBit) {
  const CompensatedSample sample = compensated_sample();
  const CompensatedSample back = from_message(message_of(sample));
  EXPECT_EQ(back.raw.sequence, sample.raw.sequence);
  EXPECT_EQ(back.raw.time, sample.raw.time);
  EXPECT_EQ(back.raw.clock, sample.raw.clock);
  EXPECT_EQ(back.raw.valid, sample.raw.valid);
  EXPECT_EQ(back.raw.clipped, sample.raw.clipped);
  expect_same_bits(back.raw.interval_s, sample.raw.interval_s);
  expect_same_bits_each(back.rate_radps, sample.rate_radps);
  expect_same_bits_each(back.applied_drift_radps, sample.applied_drift_radps);
  expect_same_bits_each(back.drift_variance, sample.drift_variance);
  EXPECT_EQ(back.mode, sample.mode);
  EXPECT_EQ(back.reason, sample.reason);
  EXPECT_EQ(back.rung, sample.rung);
  EXPECT_EQ(back.model_epoch, sample.model_epoch);
  EXPECT_EQ(back.late, sample.late);
  EXPECT_EQ(back.publish_time_ns, sample.publish_time_ns);
  EXPECT_EQ(back.ingress_time_ns, sample.ingress_time_ns);
}

TEST(CompensatedRateConversion, GivesIdentityFrameAndDeltaAngle) {
  const CompensatedSample sample = compensated_sample();
  const msg::CompensatedRate message = message_of(sample);
  EXPECT_EQ(message.gyro_id(), 21U);
  EXPECT_EQ(message.instance(), 4U);
  EXPECT_EQ(message.frame(), 1U);
  EXPECT_EQ(message.order(), 1U);
  EXPECT_EQ(message.validity(), 0x407U);
  for (std::size_t i = 0; i < core::kAxisCount; ++i) {
    expect_same_bits(message.delta_angle_rad()[i], sample.rate_radps[i] * sample.raw.interval_s);
  }
}

TEST(CompensatedRateConversion, LetsAConsumerUndoTheCorrectionToTheLastDigit) {
  // Two roundings lie between raw and rate + drift: half an ulp of rate and half an ulp of raw,
  // each at most epsilon / 2 of its value.
  const CompensatedSample sample = compensated_sample();
  const CompensatedSample back = from_message(message_of(sample));
  for (std::size_t i = 0; i < core::kAxisCount; ++i) {
    const double bound = std::numeric_limits<double>::epsilon() / 2 *
                         (std::abs(sample.rate_radps[i]) + std::abs(sample.raw.rate_radps[i]));
    EXPECT_NEAR(back.raw.rate_radps[i], sample.raw.rate_radps[i], bound);
  }
}

TEST(CompensatedRateConversion, GivesTheCovarianceAsNoisePlusDriftVarianceOnTheDiagonal) {
  const CompensatedSample sample = compensated_sample();
  const msg::CompensatedRate message = message_of(sample);
  const auto& covariance = message.rate_covariance_radps2();
  for (std::size_t i = 0; i < 9; ++i) {
    const bool diagonal = i % 4 == 0;
    expect_same_bits(covariance[i],
                     diagonal ? sample.sensor_variance[i / 4] + sample.drift_variance[i / 4] : 0.0);
  }
}

TEST(CompensatedRateConversion, MarksTheCovarianceUnknownWhereAVarianceIs) {
  for (std::size_t axis = 0; axis < core::kAxisCount; ++axis) {
    CompensatedSample sample = compensated_sample();
    sample.drift_variance[axis] = -1.0;
    const msg::CompensatedRate drift_unknown = message_of(sample);
    EXPECT_EQ(drift_unknown.rate_covariance_radps2()[0], -1.0);
    EXPECT_EQ(drift_unknown.rate_covariance_radps2()[4 * axis], -1.0);
    sample = compensated_sample();
    sample.sensor_variance[axis] = -1.0;
    EXPECT_EQ(message_of(sample).rate_covariance_radps2()[0], -1.0);
  }
}

// Law: -1 comes first only where the variance of a valid axis is unknown, whichever axes are valid.
TEST(CompensatedRateConversion, KeepsTheCovarianceOfValidAxesBesideInvalidOnes) {
  for (unsigned valid = 0; valid < 8; ++valid) {
    CompensatedSample sample = compensated_sample();
    sample.raw.valid = flags(valid);
    for (std::size_t i = 0; i < core::kAxisCount; ++i) {
      if (!sample.raw.valid[i]) sample.drift_variance[i] = sample.sensor_variance[i] = -1.0;
    }
    const msg::CompensatedRate message = message_of(sample);
    for (std::size_t i = 0; i < core::kAxisCount; ++i) {
      EXPECT_EQ(message.rate_covariance_radps2()[4 * i],
                sample.raw.valid[i] ? sample.sensor_variance[i] + sample.drift_variance[i] : 0.0)
          << "valid axes " << valid << ", axis " << i;
    }
  }
}

TEST(CompensatedRateConversion, PassesWhatIsNotFiniteAndMarksItInvalid) {
  CompensatedSample sample = compensated_sample();
  sample.raw.rate_radps[0] = kNaN;
  sample.rate_radps[0] = kNaN;
  const CompensatedSample back = from_message(message_of(sample));
  EXPECT_FALSE(back.raw.valid[0]);
  EXPECT_TRUE(back.raw.valid[1]);
  expect_same_bits(back.rate_radps[0], kNaN);
}

TEST(CompensatedRateConversion, LeavesNothingOfTheSampleBefore) {
  msg::CompensatedRate reused = message_of(compensated_sample());
  const CompensatedSample empty;
  to_message(empty, 21, 4, reused);
  EXPECT_EQ(reused, message_of(empty));
}

}  // namespace
}  // namespace zerodrift::dds
