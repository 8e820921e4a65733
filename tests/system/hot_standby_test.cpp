// SPDX-License-Identifier: Apache-2.0
// Two instances of the compensation stand by for each other; a lone one goes on from its
// checkpoint.
#include <gtest/gtest.h>
#include <signal.h>

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/system/files.h"
#include "tests/system/pipeline.h"
#include "tests/system/secured_system.h"

namespace zerodrift::system_test {
namespace {

using namespace std::chrono_literals;

// `zerodrift_bench fail-over` makes the faults and judges what a subscriber sees; how long it had
// to wait is the bench's to say, not the test's.
nlohmann::json fail_over(SystemUnderTest& system, const std::string& fault,
                         const Arguments& more = {}) {
  const auto json = system.path("fail_over.json");
  Arguments arguments{"fail-over",   "--rounds", "2",
                      "--faults",    fault,      "--json",
                      json.string(), "--domain", std::to_string(system.network().domain)};
  arguments.insert(arguments.end(), more.begin(), more.end());
  const Finished done = system.run("zerodrift_bench", arguments, 100s);
  EXPECT_TRUE(done.exit_code == 0 || done.exit_code == 1) << done.out << done.err;
  if (!std::filesystem::exists(json)) return {};
  return nlohmann::json::parse(content(json)).at("faults").at(fault);
}

void expect_each_sample_once(const nlohmann::json& seen) {
  ASSERT_FALSE(seen.is_null());
  EXPECT_EQ(seen.at("rounds"), 2);
  EXPECT_EQ(seen.at("lost"), 0);
  EXPECT_EQ(seen.at("repeated"), 0);
  EXPECT_EQ(seen.at("out_of_order"), 0);
  EXPECT_EQ(seen.at("differing"), 0) << "the one that came back is not in sync to the bit";
}

TEST(HotStandby, AKilledOneIsRelievedAndComesBackInSync) {
  SystemUnderTest system(Domain::kStandbyKilled);
  expect_each_sample_once(fail_over(system, "kill"));
}

TEST(HotStandby, AStoppedOneIsRelievedAndItsOldSamplesAreHeardByNobody) {
  SystemUnderTest system(Domain::kStandbyStopped);
  expect_each_sample_once(fail_over(system, "stop"));
}

TEST(HotStandby, OneWhoseLearnerHangsStepsBack) {
  SystemUnderTest system(Domain::kStandbyHanging);
  expect_each_sample_once(fail_over(system, "hang"));
}

TEST(HotStandby, StandsByUnderSecurityToo) {
  SystemUnderTest system(Domain::kStandbySecured);
  ASSERT_EQ(make_certificates(system, {system.path("security").string()}).exit_code, 0);
  expect_each_sample_once(
      fail_over(system, "kill", {"--security", system.path("security").string()}));
}

// A simulation at 20 times real time.
void start_simulation(SystemUnderTest& system) {
  Arguments source{"--source", "simulation", "--speed", "20"};
  for (const auto& argument : Simulation{.profile = write_ramp_profile(system, 100000)}.arguments())
    source.push_back(argument);
  system.start("thermal_publisher", source);
  source.insert(source.end(), {"--rate", "50"});
  system.start("gyro_publisher", source);
}

TEST(HotStandby, CommandsToAStandbyAreRefused) {
  SystemUnderTest system(Domain::kStandbyCommand);
  dds::Participant participant("test", system.network());
  Collector<msg::ServiceStatus> statuses(participant);
  system.start("compensation", {"--instance", "0", "--ownership-strength", "2"});
  start_simulation(system);
  ASSERT_TRUE(eventually([&] { return metric(statuses, "compensation:1", "active") == 1.0; }));
  system.start("compensation", {"--instance", "1", "--ownership-strength", "1"});
  ASSERT_TRUE(eventually([&] { return metric(statuses, "compensation/1:1", "health") == 0.0; }));
  for (const char* command : {"freeze", "reset"}) {
    const Finished refused = system.control({command, "--service", "compensation/1"});
    EXPECT_EQ(refused.exit_code, 1) << refused.out << refused.err;
    EXPECT_NE(refused.out.find("this instance is a standby"), std::string::npos) << refused.out;
  }
  EXPECT_EQ(system.control({"freeze"}).exit_code, 0);
}

// Rule: at most one period of learning is lost, and it says so.
TEST(Resume, ALoneServiceGoesOnFromItsOwnCheckpoint) {
  SystemUnderTest system(Domain::kResume);
  dds::Participant participant("test", system.network());
  Collector<msg::Event> events(participant);
  Collector<msg::CompensatedRate> answers(participant);
  const auto folder = system.path("checkpoints");
  std::filesystem::create_directory(folder);
  const Arguments arguments{"--checkpoint-dir", folder.string(), "--checkpoint-period", "1"};
  ChildProcess& first = system.start("compensation", arguments);
  start_simulation(system);
  const auto file = folder / "1-latest.ckpt";
  ASSERT_TRUE(eventually(
      [&] {
        return std::filesystem::exists(file) &&
               answers.any([](const auto& answer) { return answer.model_epoch() > 20; });
      },
      60s));
  first.send(SIGKILL);
  first.wait(5s);
  // One period and the time to write, at 20 times real time and a label in 5 s of it.
  const std::uint64_t killed_at = answers.newest().model_epoch();
  const std::size_t from = answers.size();
  system.start("compensation", arguments);
  ASSERT_TRUE(eventually([&] { return told(events, "resumed", "goes on from"); }));
  ASSERT_TRUE(eventually([&] { return answers.size() > from; }));
  const std::uint64_t resumed_at = answers.all()[from].model_epoch();
  EXPECT_GT(resumed_at, 0U) << "before the first sample";
  EXPECT_LE(resumed_at, killed_at);
  EXPECT_GT(resumed_at + 16, killed_at);
}

TEST(Resume, ACheckpointThatCannotBeUsedIsToldOfAndLearningBeginsAnew) {
  SystemUnderTest system(Domain::kResumeBad);
  dds::Participant participant("test", system.network());
  Collector<msg::Event> events(participant);
  Collector<msg::CompensatedRate> answers(participant);
  const auto folder = system.path("checkpoints");
  std::filesystem::create_directory(folder);
  write(folder / "1-latest.ckpt", "no checkpoint");
  system.start("compensation", {"--checkpoint-dir", folder.string()});
  start_simulation(system);
  ASSERT_TRUE(eventually([&] { return answers.size() > 100; }));
  EXPECT_TRUE(eventually([&] { return told(events, "cannot_resume", "1-latest.ckpt"); }));
}

}  // namespace
}  // namespace zerodrift::system_test
