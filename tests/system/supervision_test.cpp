// SPDX-License-Identifier: Apache-2.0
// What a supervisor relies on: a health check, exit codes where going on makes no sense, and
// set-ups in which no sample would pass refused in one line. Samples are counted, never "matched".
#include "common/service/supervision.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <filesystem>
#include <string>
#include <thread>

#include "tests/system/files.h"
#include "tests/system/pipeline.h"

namespace zerodrift::system_test {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;

constexpr int kUsage = 2;
constexpr int kNo = 1;

std::string text_of(const ChildProcess& process) {
  return process.out() + process.err();
}

// A program in a mount namespace of its own, whose /dev/shm is another; `size` as of tmpfs.
ChildProcess& start_apart(SystemUnderTest& system, const std::string& size,
                          const std::string& program, const Arguments& arguments) {
  return system.start_foreign(
      "/usr/bin/unshare",
      Arguments{"-m", "--propagation", "private", "sh", "-c",
                "mount -t tmpfs -o size=" + size + " tmpfs /dev/shm && exec \"$0\" \"$@\"",
                (fs::path(ZERODRIFT_BIN_DIR) / program).string()} +
          arguments + Arguments{"--domain", std::to_string(system.network().domain)});
}

class Supervised : public ::testing::Test {
 protected:
  // A gyro at 100 Hz in real time, that waits for nobody.
  ChildProcess& start_gyro(SystemUnderTest& system, const Arguments& more = {}) {
    return system.start("gyro_publisher",
                        Arguments{"--source", "simulation", "--rate", "100", "--free-running"} +
                            Simulation{.profile = write_ramp_profile(system, 3600)}.arguments() +
                            more);
  }
  static Finished health(SystemUnderTest& system, const fs::path& file) {
    return system.run("zerodrift", {"health", "--file", file.string()});
  }
};

TEST_F(Supervised, AHealthCheckTellsTheLivingFromTheHanging) {
  SystemUnderTest system(Domain::kSupervisionHealth);
  const fs::path file = system.path("health");
  EXPECT_EQ(health(system, file).exit_code, kNo);  // it has not begun
  ChildProcess& service = system.start("compensation", {"--health-file", file.string()});
  ASSERT_TRUE(eventually([&] { return health(system, file).exit_code == 0; }));
  EXPECT_NE(health(system, file).out.find("compensation"), std::string::npos);
  service.send(SIGSTOP);
  EXPECT_TRUE(eventually([&] { return health(system, file).exit_code == kNo; }));
  EXPECT_NE(health(system, file).err.find("it hangs or is gone"), std::string::npos);
  service.send(SIGCONT);
  EXPECT_TRUE(eventually([&] { return health(system, file).exit_code == 0; }));
  service.send(SIGTERM);
  EXPECT_EQ(service.wait(2s), 0);
  EXPECT_EQ(health(system, file).exit_code, kNo);
}

TEST_F(Supervised, StaleInputIsToldAndEndsWhoWasToldToEnd) {
  SystemUnderTest system(Domain::kSupervisionStale);
  dds::Participant participant("test", system.network());
  Collector<msg::Event> events(participant);
  Collector<msg::CompensatedRate> answers(participant);
  ChildProcess& stays = system.start("compensation", {"--stale-after", "1"});
  ChildProcess& ends = system.start("allan_monitor", {"--exit-when-stale", "--stale-after", "1"});
  ChildProcess& gyro = start_gyro(system);
  ASSERT_TRUE(eventually([&] { return answers.size() > 100; }));
  gyro.send(SIGSTOP);
  EXPECT_EQ(ends.wait(10s), kNo);
  EXPECT_NE(text_of(ends).find("input_stale: no compensated_rate for"), std::string::npos)
      << text_of(ends);
  EXPECT_TRUE(eventually([&] { return told(events, "input_stale", "no angular_rate for"); }));
  EXPECT_TRUE(stays.running());
  gyro.send(SIGCONT);
}

// Who ends in order leaves nobody stale behind.
TEST_F(Supervised, AnOrderlyEndIsNoFault) {
  SystemUnderTest system(Domain::kSupervisionStale);
  dds::Participant participant("test", system.network());
  Collector<msg::CompensatedRate> answers(participant);
  ChildProcess& service = system.start("compensation", {"--exit-when-stale", "--stale-after", "1"});
  ChildProcess& gyro = start_gyro(system);
  ASSERT_TRUE(eventually([&] { return answers.size() > 100; }));
  gyro.send(SIGTERM);
  EXPECT_EQ(gyro.wait(2s), 0);
  std::this_thread::sleep_for(3s);
  EXPECT_TRUE(service.running()) << text_of(service);
}

TEST_F(Supervised, WhoMeetsNobodyWithinItsTimeSaysWhatToLookAt) {
  SystemUnderTest system(Domain::kSupervisionNobody);
  ChildProcess& alone = system.start("compensation", {"--peer-within", "1"});
  EXPECT_EQ(alone.wait(10s), kNo);
  const std::string text = text_of(alone);
  for (const char* part : {"no_peer: nobody at the other end of angular_rate within 1 s",
                           "0 other participants", "--domain", "--interface"})
    EXPECT_NE(text.find(part), std::string::npos) << text;
  ChildProcess& gyro = start_gyro(system, {"--peer-within", "1"});
  EXPECT_EQ(gyro.wait(10s), kNo) << text_of(gyro);
}

// The chain by two discovery servers, of which either may go: what is new finds its way by the
// other.
TEST_F(Supervised, TheChainMeetsThroughDiscoveryServersOfWhichOneMayDie) {
  SystemUnderTest system(Domain::kDiscoveryServers);
  const std::uint32_t first_port = 7400 + 250 * system.network().domain + 240;
  dds::NetworkOptions network = system.network();
  Arguments servers;
  for (const std::uint32_t port : {first_port, first_port + 1}) {
    network.discovery_servers.push_back("127.0.0.1:" + std::to_string(port));
    servers = servers + Arguments{"--discovery-server", network.discovery_servers.back()};
  }
  ChildProcess& first = system.start("discovery_server", Arguments{"--id", "0"} + servers);
  system.start("discovery_server", Arguments{"--id", "1"} + servers);
  dds::Participant participant("test", network);
  Collector<msg::CompensatedRate> answers(participant);
  system.start("compensation", servers);
  ChildProcess& gyro = start_gyro(system, servers);
  ASSERT_TRUE(eventually([&] { return answers.size() > 100; }));
  // The order that leaves a subscriber deaf where there is one server: publisher, server,
  // publisher.
  gyro.send(SIGKILL);
  gyro.wait(2s);
  first.send(SIGKILL);
  first.wait(2s);
  const std::size_t before = answers.size();
  start_gyro(system, servers);
  EXPECT_TRUE(eventually([&] { return answers.size() > before + 100; })) << answers.size();
}

TEST_F(Supervised, ByDefaultNoSharedMemoryIsTouched) {
  SystemUnderTest system(Domain::kSupervisionHealth);
  dds::Participant participant("test", system.network());
  Collector<msg::ServiceStatus> statuses(participant);
  start_apart(system, "64k", "compensation", {});
  EXPECT_TRUE(eventually([&] { return statuses.size() > 0; }));
}

class OverSharedMemory : public Supervised {
 protected:
  static bool may_mount(SystemUnderTest& system) {
    return system.run("/usr/bin/unshare", {"-m", "true"}).exit_code == 0;
  }
  const Arguments shm_{"--transport", "shm"};
};

TEST_F(OverSharedMemory, EverySampleIsAnswered) {
  SystemUnderTest system(Domain::kSharedMemory);
  const Arguments source =
      shm_ + Arguments{"--source", "simulation", "--speed", "max", "--duration", "60"} +
      Simulation{.profile = write_ramp_profile(system, 60)}.arguments();
  system.start("allan_monitor", shm_);
  system.start("compensation", Arguments{"--await-subscribers", "1"} + shm_);
  system.start("thermal_publisher", source);
  system.start("gyro_publisher", source + Arguments{"--wait-for", "compensation,allan_monitor"});
  const Finished status = system.control({"status", "--follow", "--until-finished"});
  EXPECT_EQ(status.exit_code, 0) << status.out << status.err;
}

// Both are on one network and find each other: without a word no sample would pass.
TEST_F(OverSharedMemory, AnotherFolderIsToldOnBothSidesInOneLine) {
  SystemUnderTest system(Domain::kSharedMemoryApart);
  if (!may_mount(system)) GTEST_SKIP() << "needs a mount namespace: run as root";
  ChildProcess& here = system.start("compensation", shm_);
  ChildProcess& apart = start_apart(system, "64m", "allan_monitor", shm_);
  for (ChildProcess* process : {&here, &apart}) {
    EXPECT_EQ(process->wait(10s), kUsage);
    const std::string text = text_of(*process);
    for (const char* part :
         {"shared_memory_not_shared", "its /dev/shm is another", "ipc: host", "--transport udp"})
      EXPECT_NE(text.find(part), std::string::npos) << text;
  }
}

TEST_F(OverSharedMemory, TooLittleRoomIsRefusedBeforeItKills) {
  SystemUnderTest system(Domain::kSharedMemoryApart);
  if (!may_mount(system)) GTEST_SKIP() << "needs a mount namespace: run as root";
  ChildProcess& small = start_apart(system, "1m", "compensation", shm_);
  EXPECT_EQ(small.wait(10s), kUsage);
  EXPECT_NE(text_of(small).find("/dev/shm has 1 of 1 MiB free, at least 4 are needed"),
            std::string::npos)
      << text_of(small);
}

TEST_F(OverSharedMemory, WhatAKilledProcessLeftIsRemovedByTheNext) {
  SystemUnderTest system(Domain::kSharedMemory);  // fails where anything is left in the end
  dds::Participant participant("test", system.network());
  Collector<msg::ServiceStatus> statuses(participant);
  for (int i = 0; i < 3; ++i) {
    const std::size_t before = statuses.size();
    ChildProcess& killed = system.start("compensation", shm_);
    ASSERT_TRUE(eventually([&] { return statuses.size() > before; }));
    killed.send(SIGKILL);
    killed.wait(2s);
  }
  const std::size_t before = statuses.size();
  ChildProcess& next = system.start("compensation", shm_);
  ASSERT_TRUE(eventually([&] { return statuses.size() > before; }));
  next.send(SIGTERM);
  EXPECT_EQ(next.wait(2s), 0);
}

}  // namespace
}  // namespace zerodrift::system_test
