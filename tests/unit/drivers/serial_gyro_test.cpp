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
    const auto some = gyro.read(milliseconds{static_cast<long>(at)});
    all.insert(all.end(), some.begin(), some.end());
  }
  const auto rest = receive(gyro, std::chrono::seconds{100});
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

// Frames every ms arrive in bursts, each up to 8 ms late: the stamps must not show it.
TEST(ArrivalClocks, TakesTheHostsJitterOff) {
  constexpr std::uint64_t kSeed = 43;
  std::mt19937_64 random{kSeed};
  ArrivalClock clock{1000.0};
  SensorTime previous{0};
  SensorTime burst{0};
  for (int k = 1; k <= 20000; ++k) {
    const SensorTime sent = milliseconds{k};
    if (sent > burst) burst = sent + SensorTime{static_cast<std::int64_t>(random() % 8'000'000)};
    const SensorTime stamp = clock.stamp(std::max(burst, sent), 1);
    ASSERT_GT(stamp, previous) << "seed " << kSeed << " frame " << k;
    previous = stamp;
    // Settled, it lies above the true time by the creep since the last early arrival: 2e-4 ms a
    // frame. One burst in 8 arrives less than 1 ms late; 100 bursts (about 500 frames, 0.1 ms)
    // without one have a chance of 2e-6.
    if (k > 2000) {
      ASSERT_GE(stamp, sent) << "seed " << kSeed << " frame " << k;
      ASSERT_LE(stamp, sent + SensorTime{1'100'000}) << "seed " << kSeed << " frame " << k;
    }
  }
}

TEST(ArrivalClocks, FollowsACrystalThatIsSlowOrFast) {
  for (const double error : {-1e-4, 1e-4}) {
    ArrivalClock clock{1000.0};
    SensorTime stamp{0};
    SensorTime sent{0};
    for (int k = 1; k <= 100000; ++k) {
      sent = SensorTime{std::llround(k * 1e6 * (1.0 + error))};
      stamp = clock.stamp(sent, 1);
    }
    EXPECT_EQ(stamp, sent) << error;  // each arrival is on time, so each is its own stamp
  }
}

TEST(ArrivalClocks, MissingFramesKeepTheirPlaceInTime) {
  ArrivalClock clock{1000.0};
  (void)clock.stamp(milliseconds{0}, 1);
  EXPECT_EQ(clock.stamp(milliseconds{4}, 3),
            milliseconds{3} + SensorTime{600});  // 3 periods and their creep
}

// Set back by an hour, all later frames were 1 ns apart.
TEST(ArrivalClocks, FollowHostTimeThatIsSetAnew) {
  using namespace std::chrono_literals;
  for (const SensorTime step : {SensorTime{-1h}, SensorTime{1h}, SensorTime{700ms}}) {
    ArrivalClock clock{1000.0};
    SensorTime host{10h};
    for (int k = 0; k < 1000; ++k) (void)clock.stamp(host += 1ms, 1);
    host += step;
    clock.restart();
    for (int k = 0; k < 1000; ++k) {
      host += 1ms;
      ASSERT_EQ(clock.stamp(host, 1), host);
    }
  }
}

TEST(ArrivalClocks, ABacklogWithoutLossIsSpreadAndALossStartsAfresh) {
  ArrivalClock backlog{1000.0};
  (void)backlog.stamp(milliseconds{0}, 1);
  EXPECT_EQ(backlog.stamp(milliseconds{900}, 1), milliseconds{1} + SensorTime{200});
  ArrivalClock loss{1000.0};
  (void)loss.stamp(milliseconds{0}, 1);
  EXPECT_EQ(loss.stamp(milliseconds{900}, 4), milliseconds{900});
}

}  // namespace
}  // namespace zerodrift::drivers
