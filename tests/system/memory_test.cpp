// SPDX-License-Identifier: Apache-2.0
// Memory stays flat through a long run at full speed.
#include <gtest/gtest.h>

#include <cstdio>
#include <map>
#include <string>
#include <thread>

#include "tests/system/files.h"
#include "tests/system/pipeline.h"

namespace zerodrift::system_test {
namespace {

using namespace std::chrono_literals;

constexpr int kDurationS = 1500;
constexpr double kSamples = 300000;  // at 200 Hz
constexpr double kBytesPerMegabyte = 1048576.0;

// Rule: what is resident at a fifth of the run is resident at its end. By then everything bounded
// is full: 60 labels were learned in a window of 50, the rolling Allan windows of 60 s and the
// history of every writer (10 s of rates, 51 s of a probe) have been gone through. One megabyte is
// allowed for the allocator and the middleware's pools; a leak of 8 bytes a sample would be 1.9 MB.
TEST(Memory, OfEveryProcessIsFlatFromAFifthOfTheRunOn) {
  SystemUnderTest system(Domain::kMemory);
  write(system.path("compensation.yaml"), "svr: {capacity: 50}\n");
  const Simulation simulation{.profile = write_ramp_profile(system, kDurationS)};
  simulate(system, simulation, system.path("record.csv"));
  const Arguments source{"--source", "record", "--record", system.path("record.csv")};
  Arguments gyro_source = source;
  gyro_source.insert(gyro_source.end(),
                     {"--speed", "max", "--wait-for", "compensation,allan_monitor"});

  dds::Participant participant("test", system.network());
  Collector<msg::ServiceStatus> statuses(participant);
  std::map<std::string, ChildProcess*> processes;
  processes["allan_monitor"] =
      &system.start("allan_monitor", {"--window", "60", "--longest-tau", "100"});
  processes["compensation"] = &system.start(
      "compensation", {"--await-subscribers", "1", "--config", system.path("compensation.yaml")});
  processes["thermal_publisher"] = &system.start("thermal_publisher", source);
  processes["gyro_publisher"] = &system.start("gyro_publisher", gyro_source);

  std::map<std::string, std::uint64_t> at_a_fifth;
  std::map<std::string, std::uint64_t> at_the_end;
  const auto give_up = std::chrono::steady_clock::now() + 90s;
  double answered = 0.0;
  while (!(answered >= kSamples) && std::chrono::steady_clock::now() < give_up) {
    answered = metric(statuses, "compensation", "samples_out");
    for (const auto& [name, process] : processes) {
      const auto bytes = process->resident_bytes();
      if (!bytes) continue;  // publishers end with their source
      if (answered >= 0.2 * kSamples) at_a_fifth.emplace(name, *bytes);
      if (answered >= 0.8 * kSamples) at_the_end[name] = *bytes;
    }
    std::this_thread::sleep_for(20ms);
  }
  ASSERT_EQ(answered, kSamples);
  for (const auto& [name, process] : processes) {
    ASSERT_TRUE(at_the_end.contains(name)) << name;
    const double before = static_cast<double>(at_a_fifth.at(name)) / kBytesPerMegabyte;
    const double after = static_cast<double>(at_the_end.at(name)) / kBytesPerMegabyte;
    std::printf("%-18s %6.2f MB at a fifth, %6.2f MB at the end\n", name.c_str(), before, after);
    EXPECT_LT(after, before + 1.0) << name;
  }
}

}  // namespace
}  // namespace zerodrift::system_test
