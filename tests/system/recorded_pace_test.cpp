// SPDX-License-Identifier: Apache-2.0
// A recorder that a replay waits for, and that records nothing of what it is waited with.
#include <gtest/gtest.h>
#include <signal.h>

#include "tests/system/pipeline.h"

namespace zerodrift::system_test {
namespace {

using namespace std::chrono_literals;

// 20000 samples are some 80 times what is on its way at most: each stretch of it that a recorder
// doesn't answer costs five seconds, and a line that it is left behind.
TEST(RecordingPace, OfAReplayIsKeptWhateverOfItIsRecorded) {
  SystemUnderTest system(Domain::kRecordingPace);
  const Simulation simulation{.profile = write_ramp_profile(system, 100)};
  simulate(system, simulation, system.path("record.csv"));
  ChildProcess& compensation = system.start("compensation", {});
  int run = 0;
  for (const auto& [extension, what] : std::initializer_list<std::pair<const char*, Arguments>>{
           {".mcap", {"--topics", "temperature"}},
           {".mcap", {"--topics", "service_status,event"}},
           {".mcap", {"--topics", "compensated_rate", "--gyro-id", "2"}},
           {".mcap", {"--gyro-id", "2", "--pre-trigger", "1"}},
           {".csv", {"--gyro-id", "2"}}}) {
    SCOPED_TRACE(++run);
    const std::string name = "run" + std::to_string(run) + extension;
    ChildProcess& recorder =
        system.start("zerodrift", Arguments{"record", "--out", system.path(name)} + what);
    // Of each kind the recorder says when it has begun to count.
    const std::string begun = "recording to " + system.path(name).string() + '\n';
    EXPECT_TRUE(eventually([&] { return recorder.out().find(begun) != std::string::npos; }))
        << recorder.out() << recorder.err();
    const Arguments source{"--source", "record", "--record", system.path("record.csv")};
    ChildProcess& thermal = system.start("thermal_publisher", source);
    ChildProcess& publisher =
        system.start("gyro_publisher",
                     source + Arguments{"--speed", "max", "--wait-for", "compensation,recorder"});
    ASSERT_EQ(publisher.wait(60s), 0) << publisher.err() << compensation.err();
    EXPECT_EQ(thermal.wait(10s), 0) << thermal.err();
    EXPECT_EQ(publisher.err().find("recorder"), std::string::npos) << publisher.err();
    recorder.send(SIGTERM);
    EXPECT_EQ(recorder.wait(10s), 0) << recorder.out() << recorder.err();
  }
  compensation.send(SIGTERM);
  EXPECT_EQ(compensation.wait(5s), 0);
}

}  // namespace
}  // namespace zerodrift::system_test
