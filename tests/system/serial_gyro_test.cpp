// SPDX-License-Identifier: Apache-2.0
// gyro_publisher on a serial line. The test is the gyro, at the far end of a pseudo-terminal.
#include <gtest/gtest.h>
#include <signal.h>

#include <array>
#include <filesystem>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "common/core/samples.h"
#include "common/drivers/kvh_frame.h"
#include "tests/support/pseudo_terminal.h"
#include "tests/system/system_under_test.h"

namespace zerodrift::system_test {
namespace {

using drivers::KvhFrame;
using namespace std::chrono_literals;

constexpr double kFrameRateHz = 100.0;
constexpr core::PerAxis<float> kDeltaAngleRad{1e-6F, -2e-6F, 3e-6F};

class FakeGyro : public PseudoTerminal {
 public:
  void send_frame() { send(next_frame()); }
  std::array<std::uint8_t, drivers::kKvhFrameSize> next_frame() {
    KvhFrame frame;
    frame.rotation = kDeltaAngleRad;
    frame.rotation_valid = {true, true, true};
    frame.sequence = static_cast<std::uint8_t>(sequence_++ % drivers::kKvhSequenceModulus);
    frame.temperature = 25;
    return drivers::encode(frame);
  }

 private:
  unsigned sequence_ = 0;
};

TEST(SerialGyro, FramesBecomeRatesBadFramesBecomeEventsAndAnUnpluggedGyroEndsNothing) {
  SystemUnderTest system(Domain::kSerialGyro);
  dds::Participant participant("test", system.network());
  Collector<msg::AngularRate> rates(participant);
  Collector<msg::Temperature> temperatures(participant);
  Collector<msg::Event> events(participant);
  FakeGyro fake;
  const auto device = system.path("ttyGYRO");  // as udev names a device
  std::filesystem::create_symlink(fake.device(), device);
  ChildProcess& publisher = system.start(
      "gyro_publisher", {"--source", "serial", "--device", device, "--frame-rate", "100"});

  // Frames go out into the void until the publisher has opened the line and knows its reader.
  ASSERT_TRUE(eventually([&] {
    fake.send_frame();
    std::this_thread::sleep_for(10ms);
    return rates.size() > 0 && temperatures.size() > 0;
  }));
  std::this_thread::sleep_for(200ms);  // what is on its way arrives
  const std::size_t before = rates.size();

  for (int k = 0; k < 50; ++k) fake.send_frame();
  const std::array<std::uint8_t, 7> noise{0xFE, 0x81, 0x00, 0x13, 0xFF, 0x55, 0x42};
  fake.send(noise);
  for (int k = 0; k < 50; ++k) fake.send_frame();
  auto corrupted = fake.next_frame();
  corrupted[10] ^= 0x04U;
  fake.send(corrupted);
  const auto split = fake.next_frame();
  fake.send(std::span(split).first(17));
  std::this_thread::sleep_for(50ms);
  fake.send(std::span(split).subspan(17));
  for (int k = 0; k < 49; ++k) fake.send_frame();

  // All but the corrupted one, whose sequence number stays free.
  ASSERT_TRUE(eventually([&] { return rates.size() >= before + 150; }));
  std::this_thread::sleep_for(200ms);
  const auto all = rates.all();
  ASSERT_EQ(all.size(), before + 150);
  for (std::size_t k = before; k < all.size(); ++k) {
    const std::size_t in_burst = k - before;
    EXPECT_EQ(all[k].sequence_number() - all[before].sequence_number(),
              in_burst + (in_burst >= 100 ? 1 : 0));
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_EQ(all[k].rate_radps()[i], static_cast<double>(kDeltaAngleRad[i]) * kFrameRateHz);
    }
    EXPECT_EQ(all[k].validity(), 0b111U);
    EXPECT_EQ(all[k].clock_source(), static_cast<std::uint32_t>(core::ClockSource::kHost));
    EXPECT_GT(all[k].sensor_time_ns(), all[k - 1].sensor_time_ns());
  }
  EXPECT_EQ(temperatures.newest().temperature_degc(), 25.0);
  EXPECT_STREQ(temperatures.newest().probe().c_str(), "case");
  for (const char* code : {"crc_error", "bytes_skipped", "frames_missing"}) {
    EXPECT_TRUE(eventually([&] { return told(events, code, device); })) << code;
  }

  fake.unplug();
  EXPECT_TRUE(eventually([&] { return told(events, "device_gone", device); }));
  EXPECT_TRUE(publisher.running());

  // Plugged in again, under the same name: sequence and time go on.
  FakeGyro again;
  std::filesystem::remove(device);
  std::filesystem::create_symlink(again.device(), device);
  ASSERT_TRUE(eventually([&] {
    again.send_frame();
    std::this_thread::sleep_for(10ms);
    return rates.size() > all.size();
  }));
  EXPECT_GT(rates.newest().sequence_number(), all.back().sequence_number());
  EXPECT_GT(rates.newest().sensor_time_ns(), all.back().sensor_time_ns());
  publisher.send(SIGTERM);
  EXPECT_EQ(publisher.wait(2s), 0);
}

// Before: nothing was said of a gyro that is off, and of a wrong line speed that bytes were
// skipped.
TEST(SerialGyro, ALineThatBringsNoFrameIsReportedWithWhatWouldBeRight) {
  for (const bool is_silent : {true, false}) {
    SystemUnderTest system(Domain::kSerialGyro);
    dds::Participant participant("test", system.network());
    Collector<msg::Event> events(participant);
    PseudoTerminal line;
    const auto device = system.path("ttyGYRO");
    std::filesystem::create_symlink(line.device(), device);
    ChildProcess& publisher =
        system.start("gyro_publisher", {"--source", "serial", "--device", device});
    const std::array<std::uint8_t, 5> noise{0x00, 0x13, 0xFF, 0x55, 0x42};
    int looks = 0;
    EXPECT_TRUE(eventually([&] {
      if (!is_silent && ++looks % 20 == 0) line.send(noise);
      return told(events, "no_frame", is_silent ? "nothing has come" : "--baud");
    }));
    publisher.send(SIGTERM);
    EXPECT_EQ(publisher.wait(2s), 0);
  }
}

}  // namespace
}  // namespace zerodrift::system_test
