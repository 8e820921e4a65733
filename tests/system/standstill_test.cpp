// SPDX-License-Identifier: Apache-2.0
// Processes that stand still, as on a machine that is busy with something else: longer than every
// time after which somebody is told of it. No bit of a record's results depends on it, until others
// forget the process.
#include <gtest/gtest.h>
#include <signal.h>

#include <functional>
#include <string>

#include "tests/system/files.h"
#include "tests/system/pipeline.h"

namespace zerodrift::system_test {
namespace {

using namespace std::chrono_literals;

constexpr int kDurationS = 240;
constexpr std::uint64_t kSamples = 48000;  // at 200 Hz

// Stops a process until `is_noticed`, and looks that nothing was decided meanwhile.
void stand_still(ChildProcess& process, const std::function<bool()>& is_noticed) {
  process.send(SIGSTOP);
  EXPECT_TRUE(eventually(is_noticed)) << process.name();
  process.send(SIGCONT);
}

struct System {
  explicit System(Domain domain) : system(domain) {
    const Simulation simulation{.profile = write_ramp_profile(system, kDurationS)};
    simulate(system, simulation, record, {"--reference"});
    run_offline(system, record, offline);
  }

  ChildProcess& start_recorder(const std::filesystem::path& out) {
    return system.start("zerodrift",
                        {"record", "--out", out, "--samples", std::to_string(kSamples)});
  }

  SystemUnderTest system;
  std::filesystem::path record = system.path("record.csv");
  std::filesystem::path offline = system.path("offline.csv");
  Arguments source{"--source", "record", "--record", record};
};

TEST(Standstill, OfAnyProcessChangesNoBitOfARecordsResults) {
  System run(Domain::kStandstill);
  SystemUnderTest& system = run.system;
  dds::Participant participant("test", system.network());
  const Collector<msg::Event> events(participant);
  const Collector<msg::ServiceStatus> statuses(participant);
  ChildProcess& monitor = system.start("allan_monitor", {});
  ChildProcess& recorder = run.start_recorder(system.path("live.csv"));
  ChildProcess& compensation = system.start("compensation", {"--await-subscribers", "2"});
  ChildProcess& thermal = system.start("thermal_publisher", run.source);
  ChildProcess& gyro =
      system.start("gyro_publisher", run.source + Arguments{"--speed", "max", "--wait-for",
                                                            "compensation,allan_monitor,recorder"});
  const auto answered = [&](double samples) {
    return eventually([&] { return metric(statuses, "compensation", "samples_out") >= samples; });
  };
  const auto is_told_silent = [&](const std::string& consumer) {
    return [&events, consumer] {
      return told(events, "liveliness_lost", "topic replay_progress: " + consumer);
    };
  };
  ASSERT_TRUE(answered(2000.0));
  stand_still(thermal, [&] {
    return told(events, "stream_silent") &&
           newest_of_each(statuses).find("compensation:1: rates wait for temperatures") !=
               std::string::npos;
  });
  ASSERT_TRUE(answered(12000.0));
  stand_still(recorder, is_told_silent("recorder"));
  ASSERT_TRUE(answered(22000.0));
  stand_still(compensation, is_told_silent("compensation"));
  ASSERT_TRUE(answered(32000.0));
  stand_still(monitor, is_told_silent("allan_monitor"));

  EXPECT_EQ(recorder.wait(60s), 0);
  EXPECT_EQ(gyro.wait(10s), 0);
  EXPECT_EQ(thermal.wait(10s), 0);
  EXPECT_EQ(first_difference(system.path("live.csv"), run.offline), "");
  EXPECT_FALSE(told(events, "stream_ended"));
  EXPECT_FALSE(told(events, "missing_sample"));
}

// Of a process that was forgotten some were never heard again, without a word.
TEST(Standstill, LongerThanOthersRememberAProcessEndsItInALine) {
  SystemUnderTest system(Domain::kForgotten);
  dds::Participant participant("test", system.network());
  const Collector<msg::Event> events(participant);
  const Collector<msg::ServiceStatus> statuses(participant);
  ChildProcess& compensation = system.start("compensation", {});
  const Simulation simulation{.profile = write_ramp_profile(system, 600)};
  system.start("gyro_publisher",
               simulation.arguments() + Arguments{"--source", "simulation", "--free-running"});
  ASSERT_TRUE(eventually([&] { return metric(statuses, "compensation", "samples_in") >= 100.0; }));
  compensation.send(SIGSTOP);
  ASSERT_TRUE(eventually([&] { return told(events, "peer_lost", "compensation"); }, 40s));
  compensation.send(SIGCONT);
  EXPECT_EQ(compensation.wait(10s), 1);
  EXPECT_NE(compensation.err().find("stood_still: the process stood still for "),
            std::string::npos);
}

// A killed one has receipts to give until it is forgotten, and cannot be told from one that stands
// still. Before: nothing said why the replay paused.
TEST(Standstill, AReplayThatWaitsForAKilledInstanceSaysSo) {
  SystemUnderTest system(Domain::kKilledInstance);
  dds::Participant participant("test", system.network());
  const Collector<msg::ServiceStatus> statuses(participant);
  const Collector<msg::Event> events(participant);
  const Arguments source =
      Arguments{"--source", "simulation", "--speed", "max", "--wait-for", "compensation"} +
      Simulation{.profile = write_ramp_profile(system, 2000)}.arguments();
  system.start("compensation", {"--redundant", "--instance", "0"});
  ChildProcess& killed = system.start("compensation", {"--redundant", "--instance", "1"});
  const auto samples_out = [&](const char* of) { return metric(statuses, of, "samples_out"); };
  ASSERT_TRUE(eventually(
      [&] { return samples_out("compensation") == 0.0 && samples_out("compensation/1") == 0.0; }));
  system.start("thermal_publisher", source);
  ChildProcess& gyro = system.start("gyro_publisher", source + Arguments{"--rate", "50"});
  ASSERT_TRUE(eventually([&] { return samples_out("compensation/1") > 2000.0; }));
  killed.send(SIGKILL);
  EXPECT_TRUE(eventually([&] {
    return told(events, "waiting_for_receipt", "topic temperature: waiting until every reader has");
  }));
  EXPECT_EQ(gyro.wait(90s), 0);
}

// The publishers of a second run are not heard in the same order as those of the first, and follow
// it at once.
TEST(SecondRun, ThroughTheSameProcessesGivesTheSameBits) {
  System run(Domain::kSecondRun);
  SystemUnderTest& system = run.system;
  // What the first run taught would be there in the second: nothing is learned, and the drift that
  // is taken off follows the temperature.
  write(system.path("factory.yaml"),
        "learning: {label_interval_s: 100000}\n"
        "factory_polynomial: {x_deg_h: [1, 0.1], y_deg_h: [2, 0.2], z_deg_h: [3, 0.3]}\n");
  system.start("compensation",
               {"--await-subscribers", "1", "--config", system.path("factory.yaml")});
  for (const char* out : {"first.csv", "second.csv"}) {
    ChildProcess& recorder = run.start_recorder(system.path(out));
    ChildProcess& thermal = system.start("thermal_publisher", run.source);
    ChildProcess& gyro = system.start(
        "gyro_publisher",
        run.source + Arguments{"--speed", "max", "--wait-for", "compensation,recorder"});
    ASSERT_EQ(recorder.wait(60s), 0);
    ASSERT_EQ(gyro.wait(10s), 0);
    ASSERT_EQ(thermal.wait(10s), 0);
  }
  EXPECT_EQ(first_difference(system.path("first.csv"), system.path("second.csv")), "");
  const Table table = read_table(system.path("second.csv"));
  EXPECT_EQ(table.rows.back()[table.column("rung_x")], "factory_polynomial");
}

}  // namespace
}  // namespace zerodrift::system_test
