// SPDX-License-Identifier: Apache-2.0
#include "tests/system/pipeline.h"

#include <gtest/gtest.h>
#include <signal.h>

#include "tests/system/files.h"

namespace zerodrift::system_test {
namespace {

using namespace std::chrono_literals;

}  // namespace

void run_live(SystemUnderTest& system, const Live& live) {
  ChildProcess& monitor = system.start("allan_monitor", {});
  ChildProcess& recorder = system.start(
      "zerodrift", {"record", "--out", live.out, "--samples", std::to_string(live.samples)});
  ChildProcess& compensation =
      system.start("compensation", Arguments{"--await-subscribers", "2"} + live.compensation);
  ChildProcess& thermal = system.start("thermal_publisher", live.source);
  ChildProcess& gyro = system.start(
      "gyro_publisher",
      live.source + live.gyro +
          Arguments{"--speed", "max", "--wait-for", "compensation,allan_monitor,recorder"});

  ASSERT_EQ(recorder.wait(live.at_most), 0) << "the recorder did not get all samples";
  // The sources are over: their publishers end by themselves.
  EXPECT_EQ(gyro.wait(10s), 0);
  EXPECT_EQ(thermal.wait(10s), 0);
  compensation.send(SIGTERM);
  monitor.send(SIGTERM);
  EXPECT_EQ(compensation.wait(2s), 0);
  EXPECT_EQ(monitor.wait(2s), 0);
  // A record has no clock that could disagree with another's.
  EXPECT_EQ(compensation.err().find("clocks_disagree"), std::string::npos) << compensation.err();
}

void run_offline(SystemUnderTest& system, const std::filesystem::path& record,
                 const std::filesystem::path& out, const Arguments& options) {
  const Finished done =
      system.run("zerodrift", Arguments{"compensate", "--record", record, "--out", out} + options);
  ASSERT_EQ(done.exit_code, 0) << done.err;
}

Arguments Simulation::arguments() const {
  return {"--model", model, "--profile", profile, "--seed", std::to_string(seed)};
}

void simulate(SystemUnderTest& system, const Simulation& simulation,
              const std::filesystem::path& out, const Arguments& options) {
  const Finished done = system.run("zerodrift", Arguments{"simulate", "--out", out, "--rate",
                                                          std::to_string(simulation.rate_hz)} +
                                                    simulation.arguments() + options);
  ASSERT_EQ(done.exit_code, 0) << done.err;
}

std::filesystem::path write_ramp_profile(const SystemUnderTest& system, int duration_s,
                                         const std::string& more) {
  const auto file = system.path("profile.yaml");
  write(file, "name: ramp\nduration_s: " + std::to_string(duration_s) +
                  "\ninitial_temperature_degc: 0\npower_on_s: 0\nchamber:\n"
                  "  - {time_s: 3600, temperature_degc: 60}\n" +
                  more);
  return file;
}

}  // namespace zerodrift::system_test
