// SPDX-License-Identifier: Apache-2.0
// The serial gyro through a pseudo-terminal: the test is the gyro.
#include "common/drivers/serial_gyro.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <limits>
#include <optional>
#include <random>
#include <span>
#include <stdexcept>
#include <vector>

#include "common/core/units.h"
#include "common/drivers/driver_error.h"
#include "tests/support/pseudo_terminal.h"

namespace zerodrift::drivers {
namespace {

using core::SensorTime;
using std::chrono::milliseconds;

using FakeGyro = PseudoTerminal;

KvhFrame frame_of(unsigned sequence, core::PerAxis<float> rotation = {1e-6F, 2e-6F, 3e-6F}) {
  KvhFrame frame;
  frame.rotation = rotation;
  frame.rotation_valid = {true, true, true};
  frame.sequence = static_cast<std::uint8_t>(sequence % kKvhSequenceModulus);
  frame.temperature = 25;
  return frame;
}

SerialGyroOptions options_for(const FakeGyro& fake) {
  SerialGyroOptions options;
  options.device = fake.device();
  options.frame_rate_hz = 1000.0;
  return options;
}

// Waits for what was sent, then reads it. A pseudo-terminal hands over what one write gave it, at
// once or in parts.
std::vector<SerialGyroReading> receive(SerialGyro& gyro, SensorTime host_time) {
  std::vector<SerialGyroReading> all;
  while (gyro.wait(milliseconds{all.empty() ? 200 : 20}) == SerialStatus::kData) {
    const auto some = gyro.read(host_time);
    all.insert(all.end(), some.begin(), some.end());
  }
  return all;
}

// What one frame gave.
std::vector<SerialGyroReading> receive_one(SerialGyro& gyro, SensorTime host_time) {
  if (gyro.wait(milliseconds{200}) != SerialStatus::kData) return {};
  const auto some = gyro.read(host_time);
  return {some.begin(), some.end()};
}

TEST(SerialGyro, GivesRatesTemperatureAndValidity) {
  FakeGyro fake;
  SerialGyro gyro{options_for(fake)};
  KvhFrame frame = frame_of(5, {1e-6F, -2e-6F, std::numeric_limits<float>::quiet_NaN()});
  frame.rotation_valid = {true, false, true};
  fake.send(encode(frame));

  const auto readings = receive(gyro, milliseconds{7});
  ASSERT_EQ(readings.size(), 1U);
  const core::AngularRateSample& rate = readings[0].rate;
  EXPECT_EQ(rate.sequence, 0U);
  EXPECT_EQ(rate.time, milliseconds{7});
  EXPECT_EQ(rate.interval_s, 1e-3);
  EXPECT_EQ(rate.rate_radps[0], static_cast<double>(1e-6F) * 1000.0);
  EXPECT_EQ(rate.valid, (core::PerAxis<bool>{true, false, false}));
  EXPECT_EQ(rate.clock, core::ClockSource::kHost);
  EXPECT_EQ(readings[0].temperature.probe, "case");
  EXPECT_EQ(readings[0].temperature.temperature_degc, 25.0);
  EXPECT_TRUE(readings[0].temperature.measured);
}

TEST(SerialGyro, EachFormatOfTheGyroIsConverted) {
  struct Known {
    RotationFormat rotation;
    double one_is_radps;
    TemperatureFormat temperature;
    double twenty_five_is_degc;
  };
  const Known known[] = {
      {RotationFormat::kDeltaAngleRad, 1000.0, TemperatureFormat::kDegC, 25.0},
      {RotationFormat::kDeltaAngleDeg, 1000.0 * core::kRadPerDeg, TemperatureFormat::kHundredthDegC,
       0.25},
      {RotationFormat::kRateRadps, 1.0, TemperatureFormat::kDegF, (25.0 - 32.0) / 1.8},
      {RotationFormat::kRateDegps, core::kRadPerDeg, TemperatureFormat::kHundredthDegF,
       (0.25 - 32.0) / 1.8},
  };
  for (const Known& k : known) {
    FakeGyro fake;
    SerialGyroOptions options = options_for(fake);
    options.rotation = k.rotation;
    options.temperature = k.temperature;
    SerialGyro gyro{options};
    fake.send(encode(frame_of(0, {1.0F, 0.0F, 0.0F})));
    const auto readings = receive(gyro, SensorTime{0});
    ASSERT_EQ(readings.size(), 1U);
    EXPECT_DOUBLE_EQ(readings[0].rate.rate_radps[0], k.one_is_radps);
    EXPECT_DOUBLE_EQ(readings[0].temperature.temperature_degc, k.twenty_five_is_degc);
  }
}

TEST(SerialGyro, FramesSplitOverReadsAndAmidNoiseAllArrive) {
  constexpr std::uint64_t kSeed = 41;
  std::mt19937_64 random{kSeed};
  FakeGyro fake;
  SerialGyro gyro{options_for(fake)};
  std::vector<std::uint8_t> stream;
  for (unsigned i = 0; i < 200; ++i) {
    for (std::size_t n = random() % 5; n > 0; --n)
      stream.push_back(static_cast<std::uint8_t>(random()));
    auto bytes = encode(frame_of(i));
    if (i % 50 == 20) bytes[10] ^= 0x04;  // four frames broken on the way
    stream.insert(stream.end(), bytes.begin(), bytes.end());
  }
  std::vector<SerialGyroReading> all;
  for (std::size_t at = 0; at < stream.size();) {
    const std::size_t size = std::min<std::size_t>(1 + random() % 70, stream.size() - at);
    fake.send(std::span{stream}.subspan(at, size));
    at += size;
    if (gyro.wait(milliseconds{200}) != SerialStatus::kData) continue;
    const auto some = gyro.read(std::chrono::microseconds{26 * at});
    all.insert(all.end(), some.begin(), some.end());
  }
  const auto rest = receive(gyro, std::chrono::microseconds{26 * stream.size()});
  all.insert(all.end(), rest.begin(), rest.end());

  EXPECT_EQ(all.size(), 196U) << "seed " << kSeed;
  EXPECT_EQ(gyro.statistics().crc_errors, 4U) << "seed " << kSeed;
  EXPECT_EQ(gyro.statistics().frames_missing, 4U);
  for (std::size_t i = 1; i < all.size(); ++i) {
    const std::uint64_t step = all[i].rate.sequence - all[i - 1].rate.sequence;
    EXPECT_TRUE(step == 1 || step == 2) << i;
    EXPECT_GT(all[i].rate.time, all[i - 1].rate.time) << i;
  }
  EXPECT_EQ(all.back().rate.sequence, 199U);
}

TEST(SerialGyro, RawBytesPassTheTerminalUnchanged) {
  FakeGyro fake;
  SerialPort port{fake.device(), 921600};
  std::vector<std::uint8_t> every_byte(256);
  for (std::size_t i = 0; i < every_byte.size(); ++i) every_byte[i] = static_cast<std::uint8_t>(i);
  fake.send(every_byte);
  std::vector<std::uint8_t> received;
  while (received.size() < every_byte.size() &&
         port.wait(milliseconds{200}) == SerialStatus::kData) {
    std::array<std::uint8_t, 64> part{};
    const SerialRead read = port.read(part);
    received.insert(received.end(), part.begin(),
                    part.begin() + static_cast<std::ptrdiff_t>(read.bytes));
  }
  EXPECT_EQ(received, every_byte);
}

TEST(SerialGyro, SilenceIsATimeoutAndReadsNothing) {
  FakeGyro fake;
  SerialGyro gyro{options_for(fake)};
  EXPECT_EQ(gyro.wait(milliseconds{1}), SerialStatus::kTimeout);
  EXPECT_TRUE(gyro.read(SensorTime{0}).empty());
}

TEST(SerialGyro, UnpluggedIsAStatusAndReopeningAMissingDeviceOneLine) {
  FakeGyro fake;
  const std::string device = fake.device();
  SerialGyro gyro{options_for(fake)};
  fake.unplug();
  EXPECT_EQ(gyro.wait(milliseconds{200}), SerialStatus::kGone);
  EXPECT_TRUE(gyro.read(SensorTime{0}).empty());
  EXPECT_THROW(gyro.reopen(), DriverError);
}

TEST(SerialGyro, ReopenedItGoesOnCounting) {
  FakeGyro fake;
  SerialGyro gyro{options_for(fake)};
  fake.send(encode(frame_of(0)));
  ASSERT_EQ(receive(gyro, milliseconds{1}).size(), 1U);
  gyro.reopen();
  fake.send(encode(frame_of(3)));
  const auto readings = receive(gyro, milliseconds{10});
  ASSERT_EQ(readings.size(), 1U);
  EXPECT_EQ(readings[0].rate.sequence, 3U);
}

// Its delta angles were scaled by a rate that it doesn't send at, and given as rates.
TEST(SerialGyro, NothingIsValidOfAGyroThatSendsAtAnotherRate) {
  FakeGyro fake;
  SerialGyro gyro{options_for(fake)};
  bool was_found = false;
  for (unsigned i = 0; i < 2000 && !was_found; ++i) {
    fake.send(encode(frame_of(i)));
    const auto readings = receive_one(gyro, milliseconds{2 * i});
    was_found = gyro.other_rate_hz().has_value();
    for (const SerialGyroReading& reading : readings) EXPECT_EQ(reading.rate.valid[0], !was_found);
  }
  ASSERT_TRUE(was_found);
  EXPECT_NEAR(*gyro.other_rate_hz(), 500.0, 5.0);
}

// Numbers tell of a loss up to whole laps of them; the silence tells of the laps.
TEST(SerialGyro, CountsALossOfWholeLaps) {
  FakeGyro fake;
  SerialGyro gyro{options_for(fake)};
  for (unsigned i = 0; i < 100; ++i) {
    fake.send(encode(frame_of(i)));
    ASSERT_EQ(receive_one(gyro, milliseconds{i}).size(), 1U);
  }
  fake.send(encode(frame_of(400)));
  const auto readings = receive_one(gyro, milliseconds{400});
  ASSERT_EQ(readings.size(), 1U);
  EXPECT_EQ(readings[0].rate.sequence, 400U);
  EXPECT_EQ(readings[0].rate.time, milliseconds{400});
  EXPECT_EQ(gyro.statistics().frames_missing, 300U);
}

// The kernel gives a device that comes back while the old one is held another name.
TEST(SerialGyro, GoneItHoldsTheDeviceNoLonger) {
  FakeGyro fake;
  const std::string device = fake.device();
  SerialGyro gyro{options_for(fake)};
  fake.unplug();
  ASSERT_EQ(gyro.wait(milliseconds{200}), SerialStatus::kGone);
  EXPECT_THROW(gyro.reopen(), DriverError);
  EXPECT_EQ(gyro.wait(milliseconds{0}), SerialStatus::kGone);
  FakeGyro again;
  ASSERT_EQ(again.device(), device);
  gyro.reopen();
  again.send(encode(frame_of(7)));
  EXPECT_EQ(receive(gyro, milliseconds{5}).size(), 1U);
}

std::string error_of(const std::string& device, unsigned baud_rate) {
  try {
    SerialPort port{device, baud_rate};
  } catch (const DriverError& error) {
    return error.what();
  }
  return "no error";
}

TEST(SerialPorts, ErrorsNameTheDevice) {
  EXPECT_EQ(error_of("/nowhere/ttyUSB0", 115200),
            "/nowhere/ttyUSB0: cannot open the serial device: No such file or directory");
  EXPECT_EQ(error_of("/dev/null", 115200),
            "/dev/null: is not a serial device (tty): Inappropriate ioctl for device");
  EXPECT_TRUE(error_of("/dev/ttyS0", 1234)
                  .starts_with("/dev/ttyS0: 1234 baud is not available; accepted: 9600 "));
}

TEST(SerialGyroOptions, ValidateNamesTheWrongKey) {
  SerialGyroOptions options;
  EXPECT_TRUE(options.validate()->starts_with("device:"));
  EXPECT_THROW(SerialGyro{options}, std::invalid_argument);
  options.device = "/dev/ttyUSB0";
  EXPECT_EQ(options.validate(), std::nullopt);
  options.frame_rate_hz = std::nan("");
  EXPECT_TRUE(options.validate()->starts_with("frame_rate_hz:"));
  options.frame_rate_hz = 200.0;
  options.probe.clear();
  EXPECT_TRUE(options.validate()->starts_with("probe:"));
}

}  // namespace
}  // namespace zerodrift::drivers
