// SPDX-License-Identifier: Apache-2.0
// The clock as adversary: the wall clock of a host is stepped while a real gyro and a thermometer,
// two processes without clocks of their own, are stamped by it.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <string>
#include <thread>

#include "common/drivers/kvh_frame.h"
#include "common/service/sensor_clock.h"
#include "tests/system/files.h"
#include "tests/system/system_under_test.h"
#include "tests/system/wall_clock.h"

namespace zerodrift::system_test {
namespace {

using namespace std::chrono_literals;

// A gyro of 100 frames a second, at the far end of a pseudo-terminal, as long as the object lives.
class SerialLine {
 public:
  SerialLine() : line_(::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC)) {
    if (line_ < 0 || ::grantpt(line_) != 0 || ::unlockpt(line_) != 0) std::abort();
    sender_ = std::jthread([this](const std::stop_token& stop) { send_until(stop); });
  }
  ~SerialLine() {
    sender_.request_stop();
    sender_.join();
    ::close(line_);
  }
  SerialLine(const SerialLine&) = delete;
  SerialLine& operator=(const SerialLine&) = delete;
  [[nodiscard]] std::string device() const { return ::ptsname(line_); }

 private:
  void send_until(const std::stop_token& stop) const {
    drivers::KvhFrame frame;
    frame.rotation_valid = {true, true, true};
    frame.temperature = 25;
    auto due = std::chrono::steady_clock::now();
    for (unsigned sequence = 0; !stop.stop_requested(); ++sequence) {
      frame.sequence = static_cast<std::uint8_t>(sequence % drivers::kKvhSequenceModulus);
      const auto bytes = drivers::encode(frame);
      if (::write(line_, bytes.data(), bytes.size()) < 0) return;
      std::this_thread::sleep_until(due += 10ms);
    }
  }
  int line_;
  std::jthread sender_;
};

TEST(WallClock, ThatIsSteppedIsFollowedByGyroAndThermometerAndTold) {
  SystemUnderTest system(Domain::kClockStep);
  write(system.path("sys/class/hwmon/hwmon0/temp1_label"), "coil\n");
  write(system.path("sys/class/hwmon/hwmon0/temp1_input"), "21500\n");
  dds::Participant participant("test", system.network());
  const Collector<msg::Event> events(participant);
  const Collector<msg::AngularRate> rates(participant);
  const Collector<msg::Temperature> temperatures(participant);
  const Collector<msg::CompensatedRate> answers(participant);
  const Collector<msg::ServiceStatus> statuses(participant);
  WallClock wall(system.path("shift"));
  const SerialLine gyro;
  const std::string domain = std::to_string(system.network().domain);
  system.start("compensation", {});
  system.start_foreign(
      "gyro_publisher",
      {"--source", "serial", "--device", gyro.device(), "--frame-rate", "100", "--domain", domain},
      wall.environment());
  system.start_foreign("thermal_publisher",
                       {"--source", "sysfs", "--sysfs-root", system.path("sys").string(), "--rate",
                        "10", "--domain", domain},
                       wall.environment());
  const auto ahead_s = [](std::int64_t time_ns) {
    return static_cast<double>(time_ns - service::await_clocks().unix_ns) * 1e-9;
  };
  const auto is_coil = [](const msg::Temperature& t) { return t.probe() == "coil"; };
  ASSERT_TRUE(eventually([&] { return answers.size() > 0 && temperatures.any(is_coil); }));
  for (const std::chrono::nanoseconds shift :
       {std::chrono::nanoseconds(-1h), std::chrono::nanoseconds(0), std::chrono::nanoseconds(1s),
        std::chrono::nanoseconds(1h)}) {
    const std::size_t told_before = events.size();
    const std::size_t answered_before = answers.size();
    wall.set_ahead(shift);
    const double wanted_s = std::chrono::duration<double>(shift).count();
    for (const char* service : {"gyro_publisher", "thermal_publisher"}) {
      EXPECT_TRUE(eventually([&] {
        return events.any(
            [&](const msg::Event& e) {
              return std::string(e.code().c_str()) == "clock_stepped" &&
                     std::string(e.service().c_str()) == service;
            },
            told_before);
      })) << service
          << " " << wanted_s;
    }
    // 0.3 s: frames and readings that are on their way on a busy machine, below the smallest step.
    EXPECT_TRUE(eventually([&] {
      return std::abs(ahead_s(rates.newest().sensor_time_ns()) - wanted_s) < 0.3;
    })) << wanted_s;
    // The stream began anew: samples go on, in order, a hundred a second.
    EXPECT_TRUE(eventually([&] { return answers.size() >= answered_before + 200; }));
    const auto all = answers.all();
    const auto& last = all.back();
    const auto& before = all[all.size() - 100];
    EXPECT_EQ(last.order(), 0) << "answered as late";
    EXPECT_NEAR(static_cast<double>(last.sensor_time_ns() - before.sensor_time_ns()) * 1e-9, 0.99,
                0.5);
  }
}

}  // namespace
}  // namespace zerodrift::system_test
