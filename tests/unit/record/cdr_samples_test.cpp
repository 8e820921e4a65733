// SPDX-License-Identifier: Apache-2.0
#include "common/record/cdr_samples.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "tests/unit/record/recording.h"

namespace zerodrift::record {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// Bits, since NaN equals nothing.
core::PerAxis<std::uint64_t> bits(const core::PerAxis<double>& values) {
  return {std::bit_cast<std::uint64_t>(values[0]), std::bit_cast<std::uint64_t>(values[1]),
          std::bit_cast<std::uint64_t>(values[2])};
}

core::AngularRateSample odd_rate() {
  core::AngularRateSample sample = rate_at(-3.25, std::numeric_limits<std::uint64_t>::max() - 1);
  sample.rate_radps = {kNan, -0.0, 1e-300};
  sample.valid = {true, true, false};
  sample.clipped = {false, true, true};
  sample.clock = core::ClockSource::kHost;
  return sample;
}

TEST(CdrSamplesLaws, SayOfAnAngularRateWhatTheGeneratedTypesSay) {
  for (const auto& sample : {rate_at(1.5, 7), odd_rate()}) {
    auto message = dds::to_message(sample, 4, 99);
    const auto expected = dds::from_message(message);
    const auto found = decode_angular_rate(dds::encode(message));
    ASSERT_TRUE(found);
    EXPECT_EQ(found->gyro_id, 4U);
    EXPECT_EQ(found->sample.sequence, expected.sequence);
    EXPECT_EQ(found->sample.time, expected.time);
    EXPECT_EQ(found->sample.interval_s, expected.interval_s);
    EXPECT_EQ(bits(found->sample.rate_radps), bits(expected.rate_radps));
    EXPECT_EQ(found->sample.valid, expected.valid);
    EXPECT_EQ(found->sample.clipped, expected.clipped);
    EXPECT_EQ(found->sample.clock, expected.clock);
  }
}

TEST(CdrSamplesLaws, SayOfATemperatureWhatTheGeneratedTypesSay) {
  // Names of every length up to the bound: what follows is aligned anew each time.
  for (std::size_t length = 0; length <= 32; ++length) {
    const std::string probe(length, 'p');
    auto sample = reading_at(2.5, probe.c_str(), -40.0);
    sample.sequence = 11;
    sample.measured = length % 2 == 0;
    auto message = dds::to_message(sample, 5);
    const auto found = decode_temperature(dds::encode(message));
    ASSERT_TRUE(found) << length;
    EXPECT_EQ(found->gyro_id, 5U);
    EXPECT_EQ(found->sample.probe, probe);
    EXPECT_EQ(found->sample.sequence, 11U);
    EXPECT_EQ(found->sample.time, sample.time);
    EXPECT_EQ(found->sample.temperature_degc, -40.0);
    EXPECT_EQ(found->sample.measured, sample.measured);
    EXPECT_EQ(found->sample.clock, sample.clock);
  }
}

TEST(CdrSamplesLaws, SayOfAReferenceWhatTheGeneratedTypesSay) {
  core::RateReferenceSample sample;
  sample.kind = core::ReferenceKind::kNavigationResidual;
  sample.time = core::from_seconds(9.0);
  sample.model_epoch = 77;
  sample.rate_radps = {1.0, kNan, 3.0};
  sample.variance = {0.5, 0.5, -1.0};
  sample.valid = {true, true, true};
  auto message = dds::to_message(sample, 6);
  const auto expected = dds::from_message(message);
  const auto found = decode_rate_reference(dds::encode(message));
  ASSERT_TRUE(found);
  EXPECT_EQ(found->gyro_id, 6U);
  EXPECT_EQ(found->sample.kind, expected.kind);
  EXPECT_EQ(found->sample.time, expected.time);
  EXPECT_EQ(found->sample.model_epoch, expected.model_epoch);
  EXPECT_EQ(bits(found->sample.rate_radps), bits(expected.rate_radps));
  EXPECT_EQ(bits(found->sample.variance), bits(expected.variance));
  EXPECT_EQ(found->sample.valid, (core::PerAxis<bool>{true, false, false}));
}

// A writer of another byte order: encapsulation 0, and every value turned round.
TEST(CdrSamplesLaws, SayOfTheEnvironmentWhatTheGeneratedTypesSay) {
  for (const std::uint32_t measured : {0U, 0b1'0101'0101U, 0b1'1111'1111U, ~0U}) {
    core::EnvironmentSample sample{
        .sequence = 12, .time = core::SensorTime{-3}, .channels = 0x1ffU};
    for (std::size_t i = 0; i < core::kEnvironmentChannels; ++i)
      core::channel(sample.values, i) = i == 4 ? kNan : 0.1 * static_cast<double>(i) - 0.2;
    auto message = dds::to_message(sample, 6);
    message.measured(measured);
    message.clock_source(99);
    const auto expected = dds::from_message(message);
    const auto found = decode_environment(dds::encode(message));
    ASSERT_TRUE(found);
    EXPECT_EQ(found->gyro_id, 6U);
    EXPECT_EQ(found->sample.sequence, expected.sequence);
    EXPECT_EQ(found->sample.time, expected.time);
    EXPECT_EQ(found->sample.channels, expected.channels);
    EXPECT_EQ(found->sample.clock, expected.clock);
    for (std::size_t i = 0; i < core::kEnvironmentChannels; ++i) {
      EXPECT_EQ(std::bit_cast<std::uint64_t>(core::channel(found->sample.values, i)),
                std::bit_cast<std::uint64_t>(core::channel(expected.values, i)));
    }
  }
}

TEST(CdrSamplesGolden, ABigEndianReadingIsRead) {
  std::string payload{"\0\0\0\0", 4};
  payload += std::string("\0\0\0\7", 4);               // gyro 7
  payload += std::string("\0\0\0\5coil\0\0\0\0", 12);  // "coil", then alignment
  payload += std::string("\0\0\0\0\0\0\1\2", 8);       // sequence 258
  payload += std::string("\0\0\0\0\0\0\0\1", 8);       // 1 ns
  payload += std::string("\x40\x39\0\0\0\0\0\0", 8);   // 25 degC
  payload += std::string("\0\0\0\1\0\0\0\3", 8);       // measured, replay
  const auto found = decode_temperature(payload);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->gyro_id, 7U);
  EXPECT_EQ(found->sample.probe, "coil");
  EXPECT_EQ(found->sample.sequence, 258U);
  EXPECT_EQ(found->sample.time.count(), 1);
  EXPECT_EQ(found->sample.temperature_degc, 25.0);
  EXPECT_TRUE(found->sample.measured);
}

TEST(CdrSamplesAbuse, TooFewBytesOrAnotherEncodingAreNoMessage) {
  auto rate = dds::to_message(rate_at(1.0, 1), 1, 0);
  auto temperature = dds::to_message(reading_at(1.0, "coil", 1.0), 1);
  auto reference = dds::to_message(core::RateReferenceSample{}, 1);
  auto environment = dds::to_message(environment_at(1.0, 5.0), 1);
  const std::string payloads[] = {dds::encode(rate), dds::encode(temperature),
                                  dds::encode(reference), dds::encode(environment)};
  for (std::size_t size = 0; size < payloads[0].size(); ++size)
    EXPECT_FALSE(decode_angular_rate(payloads[0].substr(0, size))) << size;
  for (std::size_t size = 0; size < payloads[1].size(); ++size)
    EXPECT_FALSE(decode_temperature(payloads[1].substr(0, size))) << size;
  for (std::size_t size = 0; size < payloads[2].size(); ++size)
    EXPECT_FALSE(decode_rate_reference(payloads[2].substr(0, size))) << size;
  for (std::size_t size = 0; size < payloads[3].size(); ++size)
    EXPECT_FALSE(decode_environment(payloads[3].substr(0, size))) << size;
  std::string parameter_list = payloads[0];
  parameter_list[1] = 3;
  EXPECT_FALSE(decode_angular_rate(parameter_list));
  std::string long_name = payloads[1];
  long_name[8] = '\xff';  // a probe of 255 letters
  EXPECT_FALSE(decode_temperature(long_name));
}

}  // namespace
}  // namespace zerodrift::record
