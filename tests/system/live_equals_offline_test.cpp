// SPDX-License-Identifier: Apache-2.0
// Same inputs, same outputs: what goes over DDS, through five processes, at any pace, is what one
// process computes from the file.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <string>

#include "tests/system/files.h"
#include "tests/system/pipeline.h"

namespace zerodrift::system_test {
namespace {

constexpr int kDurationS = 600;
constexpr std::uint64_t kSamples = 120000;  // at 200 Hz

// Sequence numbers are 0, 1, 2, ...: nothing lost, nothing twice.
void expect_every_sample_once(const std::filesystem::path& out, std::uint64_t samples) {
  const Table table = read_table(out);
  ASSERT_EQ(table.rows.size(), samples);
  const std::size_t sequence = table.column("sequence");
  for (std::uint64_t k = 0; k < samples; ++k) {
    ASSERT_EQ(table.rows[k][sequence], std::to_string(k));
  }
}

// The comparison would say little of a run in which nothing was learned.
void expect_at_work(const std::string& rung, const std::filesystem::path& out) {
  const Table table = read_table(out);
  for (const char* axis : {"x", "y", "z"}) {
    EXPECT_EQ(table.rows.back()[table.column(std::string("rung_") + axis)], rung);
  }
}

// Options of one scheme for both; `rung` is what then gives the drift.
void expect_live_equals_offline(SystemUnderTest& system, const Simulation& simulation,
                                const Arguments& offline, const Arguments& live,
                                const std::string& rung) {
  const auto record = system.path("record.csv");
  simulate(system, simulation, record);
  run_offline(system, record, system.path("offline.csv"), offline);
  run_live(system, {.source = {"--source", "record", "--record", record},
                    .compensation = live,
                    .samples = kSamples,
                    .out = system.path("live.csv")});
  EXPECT_EQ(first_difference(system.path("live.csv"), system.path("offline.csv")), "");
  expect_every_sample_once(system.path("live.csv"), kSamples);
  expect_at_work(rung, system.path("live.csv"));
}

TEST(LiveRun, OfARecordEqualsOfflineCompensationToTheByte) {
  SystemUnderTest system(Domain::kRecordLive);
  expect_live_equals_offline(system, {.profile = write_ramp_profile(system, kDurationS)}, {}, {},
                             "stack");
}

// Rule: another scheme than the default one is no exception.
TEST(LiveRun, OfTheOnlineSvrAloneEqualsOfflineCompensationToTheByte) {
  SystemUnderTest system(Domain::kSvrLive);
  write(system.path("svr.yaml"), "scheme: online-svr\n");
  expect_live_equals_offline(system, {.profile = write_ramp_profile(system, kDurationS), .seed = 3},
                             {"--scheme", "online-svr"}, {"--config", system.path("svr.yaml")},
                             "online_svr");
}

// Rule: what follows from the samples' spacing follows from their first one, so that it is the
// same.
TEST(LiveRun, OfARecordWithASampleEveryTenSecondsEqualsOfflineCompensationToTheByte) {
  SystemUnderTest system(Domain::kSlowLive);
  constexpr int kRows = 300;
  std::string text = "time_s,rate_x_rad_s,rate_y_rad_s,rate_z_rad_s,temperature_coil_degC\n";
  for (int k = 0; k < kRows; ++k) {
    const double temperature_degc = 20.0 + 10.0 * std::sin(0.05 * k);
    char row[128];
    std::snprintf(row, sizeof row, "%d,%.9e,%.9e,%.9e,%.4f\n", 10 * k,
                  1e-6 * temperature_degc + 1e-7 * std::sin(1.7 * k * k),
                  2e-6 * temperature_degc + 1e-7 * std::sin(1.3 * k * k),
                  1e-7 * std::cos(1.9 * k * k), temperature_degc);
    text += row;
  }
  const auto record = system.path("record.csv");
  write(record, text);
  run_offline(system, record, system.path("offline.csv"));
  run_live(system, {.source = {"--source", "record", "--record", record},
                    .samples = kRows,
                    .out = system.path("live.csv")});
  EXPECT_EQ(first_difference(system.path("live.csv"), system.path("offline.csv")), "");
  expect_every_sample_once(system.path("live.csv"), kRows);
  expect_at_work("stack", system.path("live.csv"));
}

// Rule: a rest that ends with more labels on their way than there is room for models is learned to
// its end. A label every 5 s that takes effect 30 s later makes six at a time.
TEST(LiveRun, OfARecordWhoseRestEndsWithManyModelsOnTheirWayEqualsOfflineCompensationToTheByte) {
  SystemUnderTest system(Domain::kRestEndsLive);
  constexpr int kRows = 8000;  // 400 s at 20 Hz, the last 180 s of them in motion
  std::string text = "time_s,rate_x_rad_s,rate_y_rad_s,rate_z_rad_s,temperature_coil_degC\n";
  for (int k = 0; k < kRows; ++k) {
    const double noise = 2e-6 * std::sin(1.7 * k * k);
    const double motion = k > 4400 ? 0.1 * std::sin(0.05 * k) : 0.0;
    char row[128];
    std::snprintf(row, sizeof row, "%.2f,%.9e,%.9e,%.9e,%.4f\n", 0.05 * k, 1e-5 + noise,
                  2e-5 - noise, 5e-6 + noise + motion, 25.0 + 0.001 * k);
    text += row;
  }
  const auto record = system.path("record.csv");
  write(record, text);
  write(system.path("late.yaml"), "learning: {handover_s: 30}\n");
  const Arguments late{"--config", system.path("late.yaml")};
  run_offline(system, record, system.path("offline.csv"), late);
  run_live(system, {.source = {"--source", "record", "--record", record},
                    .compensation = late,
                    .samples = kRows,
                    .out = system.path("live.csv")});
  EXPECT_EQ(first_difference(system.path("live.csv"), system.path("offline.csv")), "");
  expect_every_sample_once(system.path("live.csv"), kRows);
  expect_at_work("stack", system.path("live.csv"));
}

TEST(LiveRun, OfASimulationEqualsOfflineCompensationOfItsRecordToTheByte) {
  SystemUnderTest system(Domain::kSimulationLive);
  const Simulation simulation{.profile = write_ramp_profile(system, kDurationS), .seed = 7};
  const auto record = system.path("record.csv");
  simulate(system, simulation, record);
  run_offline(system, record, system.path("offline.csv"));
  Arguments source{"--source", "simulation"};
  for (const auto& argument : simulation.arguments()) source.push_back(argument);
  run_live(system, {.source = source,
                    .gyro = {"--rate", "200"},
                    .samples = kSamples,
                    .out = system.path("live.csv")});
  EXPECT_EQ(first_difference(system.path("live.csv"), system.path("offline.csv")), "");
}

// Rule: runs repeat each other's numbers and times, and are all seen whole by one who stayed.
TEST(LiveRun, TheSameOneAgainAndAShorterAndALongerOneAreEachSeenWhole) {
  SystemUnderTest system(Domain::kSameRunAgain);
  dds::Participant participant("test", system.network());
  Collector<msg::CompensatedRate> answers(participant);
  system.start("compensation", {"--await-subscribers", "1"});
  Arguments source{"--source", "simulation", "--speed", "max"};
  for (const auto& argument : Simulation{.profile = write_ramp_profile(system, 100)}.arguments())
    source.push_back(argument);
  std::size_t expected = 0;
  for (const int duration_s : {5, 5, 2, 20, 5}) {
    Arguments run = source;
    run.insert(run.end(), {"--duration", std::to_string(duration_s)});
    system.start("thermal_publisher", run);
    run.insert(run.end(), {"--rate", "100", "--wait-for", "compensation"});
    EXPECT_EQ(system.start("gyro_publisher", run).wait(std::chrono::seconds(30)), 0);
    expected += static_cast<std::size_t>(duration_s) * 100;
    EXPECT_TRUE(eventually([&] { return answers.size() >= expected; }))
        << answers.size() << " of " << expected;
  }
  EXPECT_EQ(answers.size(), expected);
}

// Two gyros that have nothing in common but the service.
TEST(LiveRun, OfTwoGyrosThroughOneServiceEqualsTheOfflineRunOfEach) {
  SystemUnderTest system(Domain::kTwoGyros);
  const auto profile = write_ramp_profile(system, 200);
  constexpr std::uint64_t kEach = 20000;  // 200 s at 100 Hz
  const auto name = [&](int gyro, const char* what) {
    return system.path(what + std::to_string(gyro) + ".csv");
  };
  for (const int gyro : {1, 2}) {
    simulate(system, {.profile = profile, .seed = gyro, .rate_hz = 100}, name(gyro, "record"));
    run_offline(system, name(gyro, "record"), name(gyro, "offline"));
  }
  std::vector<ChildProcess*> recorders;
  system.start("allan_monitor", {});
  for (const int gyro : {1, 2}) {
    recorders.push_back(
        &system.start("zerodrift", {"record", "--gyro-id", std::to_string(gyro), "--out",
                                    name(gyro, "live"), "--samples", std::to_string(kEach)}));
  }
  ChildProcess& status =
      system.start("zerodrift", {"ctl", "status", "--follow", "--until-finished"});
  system.start("compensation", {"--await-subscribers", "3"});
  for (const int gyro : {1, 2}) {
    const std::string id = std::to_string(gyro);
    const std::string record = name(gyro, "record");
    system.start("thermal_publisher", {"--source", "record", "--record", record, "--gyro-id", id});
    system.start("gyro_publisher",
                 {"--source", "record", "--record", record, "--gyro-id", id, "--speed", "max",
                  "--wait-for", "compensation,allan_monitor,recorder"});
  }
  for (ChildProcess* recorder : recorders) EXPECT_EQ(recorder->wait(std::chrono::seconds(40)), 0);
  for (const int gyro : {1, 2}) {
    EXPECT_EQ(first_difference(name(gyro, "live"), name(gyro, "offline")), "") << "gyro " << gyro;
    expect_every_sample_once(name(gyro, "live"), kEach);
  }
  EXPECT_NE(first_difference(name(1, "live"), name(2, "live")), "") << "the gyros must differ";
  // What is followed are both, and both to their ends.
  EXPECT_EQ(status.wait(std::chrono::seconds(10)), 0);
  EXPECT_NE(status.out().find("published 40000  in 40000  out 40000  monitored 40000"),
            std::string::npos)
      << status.out();
}

}  // namespace
}  // namespace zerodrift::system_test
