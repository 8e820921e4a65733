// SPDX-License-Identifier: Apache-2.0
// Two instances of the compensation answer the same; a lone one that is started again is heard at
// once, and goes on from its checkpoint.
#include <gtest/gtest.h>
#include <signal.h>

#include <cstdint>
#include <filesystem>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "tests/bench/synthetic_gyro.h"
#include "tests/system/files.h"
#include "tests/system/pipeline.h"
#include "tests/system/secured_system.h"
#include "tests/system/wall_clock.h"

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

TEST(Redundancy, AKilledOneCostsNoSampleAndComesBackInSync) {
  SystemUnderTest system(Domain::kStandbyKilled);
  expect_each_sample_once(fail_over(system, "kill"));
}

TEST(Redundancy, OfTheOnlineSvrAloneOneThatComesBackIsInSyncToTheBit) {
  SystemUnderTest system(Domain::kStandbySvr);
  expect_each_sample_once(fail_over(system, "kill", {"--scheme", "online-svr"}));
}

TEST(Redundancy, AStoppedOneCostsNoSampleAndItsOldOnesAreNotRepeated) {
  SystemUnderTest system(Domain::kStandbyStopped);
  expect_each_sample_once(fail_over(system, "stop"));
}

TEST(Redundancy, OneWhoseLearnerHangsStepsBackAndComesBackInSync) {
  SystemUnderTest system(Domain::kStandbyHanging);
  expect_each_sample_once(fail_over(system, "hang"));
}

TEST(Redundancy, IsThereUnderSecurityToo) {
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

ChildProcess& start_instance(SystemUnderTest& system, int number) {
  return system.start("compensation", {"--instance", std::to_string(number), "--redundant"});
}

TEST(Redundancy, CommandsToOneThatDoesNotLeadAreRefused) {
  SystemUnderTest system(Domain::kStandbyCommand);
  dds::Participant participant("test", system.network());
  Collector<msg::ServiceStatus> statuses(participant);
  start_instance(system, 0);
  start_simulation(system);
  ASSERT_TRUE(eventually([&] { return metric(statuses, "compensation:1", "active") == 1.0; }));
  start_instance(system, 1);
  ASSERT_TRUE(eventually([&] { return metric(statuses, "compensation/1:1", "health") == 0.0; }));
  for (const char* command : {"freeze", "reset"}) {
    const Finished refused = system.control({command, "--service", "compensation/1"});
    EXPECT_EQ(refused.exit_code, 1) << refused.out << refused.err;
    EXPECT_NE(refused.out.find("another instance leads"), std::string::npos) << refused.out;
  }
  EXPECT_EQ(system.control({"freeze"}).exit_code, 0);
}

// Rule: a model that the leader adopts, or takes back, goes with its state to the other, which goes
// on with it when the leader dies. Before: that one never came back in sync, and went on without.
TEST(Redundancy, AnAdoptedModelIsTheOthersToo) {
  SystemUnderTest system(Domain::kStandbyCommand);
  dds::Participant participant("test", system.network());
  const Collector<msg::Event> events(participant);
  const Collector<msg::CompensatedRate> answers(participant);
  std::filesystem::create_directory(system.path("models"));
  write(system.path("models/partial.yaml"),
        "format_version: 1\ngyro_id: partial\neffects:\n"
        "  - {kind: bias, axis: x, parameters: {bias_deg_h: -1.5715}}\n");
  const auto start = [&](const char* number) -> ChildProcess& {
    return system.start("compensation",
                        {"--instance", number, "--redundant", "--model-dir", system.path("models"),
                         "--checkpoint-dir", system.path("models")});
  };
  ChildProcess& leader = start("0");
  start_simulation(system);
  ASSERT_TRUE(eventually([&] { return answers.size() > 1000; }));
  start("1");
  const auto caught_up = [&] {
    std::size_t count = 0;
    events.for_each([&](const msg::Event& event) {
      if (std::string(event.code().c_str()) == "caught_up") ++count;
    });
    return count;
  };
  ASSERT_TRUE(eventually([&] { return caught_up() == 1; }));
  ASSERT_EQ(system.control({"checkpoint"}).exit_code, 0);
  ASSERT_EQ(system.control({"adopt", "--model", "partial.yaml"}).exit_code, 0);
  ASSERT_TRUE(eventually([&] { return caught_up() == 2; }));
  EXPECT_FALSE(told(events, "cannot_catch_up", ""));
  leader.send(SIGKILL);
  leader.wait(5s);
  EXPECT_TRUE(eventually([&] {
    const Finished of_before = system.control({"restore"});
    return of_before.out.find("was made with another prior") != std::string::npos;
  })) << "the one that is left has the model in force";
}

// Before: a subscriber got a mixture of both, and nobody said why.
TEST(Redundancy, TwoThatWereToldNothingOfEachOtherSaySo) {
  SystemUnderTest system(Domain::kStandbyCommand);
  dds::Participant participant("test", system.network());
  Collector<msg::Event> events(participant);
  Collector<msg::ServiceStatus> statuses(participant);
  system.start("compensation", {});
  ChildProcess& second = system.start("compensation", {"--instance", "3"});
  EXPECT_TRUE(eventually([&] {
    return told(events, "second_compensation", "compensation (host") &&
           told(events, "second_compensation", "compensation/3 (host");
  }));
  const auto is_degraded = [&] {
    bool is = false;
    statuses.for_each([&](const msg::ServiceStatus& status) {
      if (std::string(status.service().c_str()) == "compensation") is = status.state() == 3;
    });
    return is;
  };
  EXPECT_TRUE(eventually([&] { return is_degraded(); }));
  second.send(SIGTERM);
  EXPECT_TRUE(eventually([&] { return !is_degraded(); })) << "the other has left";
}

// Whoever is started again in the place of one that ended, in order or not, is its only one; so are
// instances that know of each other.
TEST(Redundancy, NobodyIsTakenForARivalWhoIsNone) {
  SystemUnderTest system(Domain::kStandbyCommand);
  dds::Participant participant("test", system.network());
  Collector<msg::Event> events(participant);
  Collector<msg::ServiceStatus> statuses(participant);
  // For three seconds.
  const auto speaks = [&](const std::string& service) {
    const std::size_t from = statuses.size();
    return eventually([&] {
      int spoke = 0;
      for (std::size_t i = from; i < statuses.size(); ++i) {
        const auto next = statuses.first(
            [&](const msg::ServiceStatus& status) { return service == status.service().c_str(); },
            i);
        if (!next) break;
        i = *next;
        ++spoke;
      }
      return spoke > 12;
    });
  };
  ChildProcess* alone = &system.start("compensation", {});
  for (const int signal : {SIGTERM, SIGKILL}) {
    ASSERT_TRUE(speaks("compensation"));
    alone->send(signal);
    alone = &system.start("compensation", {});
  }
  ASSERT_TRUE(speaks("compensation"));
  alone->send(SIGTERM);
  alone->wait(std::chrono::seconds(10));
  start_instance(system, 0);
  start_instance(system, 1);
  ASSERT_TRUE(speaks("compensation") && speaks("compensation/1"));
  EXPECT_FALSE(told(events, "second_compensation", ""));
}

// A replay keeps pace with both, so that the slower one loses no input and answers the same.
TEST(Redundancy, OfAReplayAtFullSpeedBothAnswerEverySampleTheSame) {
  SystemUnderTest system(Domain::kRedundantReplay);
  dds::Participant participant("test", system.network());
  const Collector<msg::ServiceStatus> statuses(participant);
  const Collector<msg::Event> events(participant);
  constexpr double kDurationS = 600.0;
  constexpr double kSamples = 200.0 * kDurationS;
  Arguments source{"--source", "simulation", "--speed", "max"};
  for (const auto& argument :
       Simulation{.profile = write_ramp_profile(system, kDurationS)}.arguments())
    source.push_back(argument);
  system.start("allan_monitor", {});
  for (const char* instance : {"0", "1"}) {
    system.start("compensation",
                 {"--instance", instance, "--redundant", "--await-subscribers", "1"});
  }
  ASSERT_TRUE(eventually([&] {
    return metric(statuses, "compensation", "samples_in") == 0.0 &&
           metric(statuses, "compensation/1", "samples_in") == 0.0;
  })) << "both are there from the first sample on";
  system.start("thermal_publisher", source);
  source.insert(source.end(), {"--rate", "200", "--wait-for", "compensation,allan_monitor"});
  ChildProcess& publisher = system.start("gyro_publisher", source);
  EXPECT_EQ(publisher.wait(120s), 0);
  EXPECT_TRUE(eventually([&] {
    return metric(statuses, "compensation", "samples_out") == kSamples &&
           metric(statuses, "compensation/1", "samples_out") == kSamples;
  })) << newest_of_each(statuses);
  // Who stands still for five seconds is done without, which is told.
  if (told(events, "consumer_left_behind")) return;
  for (const char* instance : {"compensation", "compensation/1"})
    EXPECT_EQ(metric(statuses, instance, "missing"), 0.0) << instance;
  EXPECT_GT(metric(statuses, "compensation/1:1", "compared"), kSamples / 2);
  EXPECT_EQ(metric(statuses, "compensation/1:1", "differing"), 0.0);
}

// The other instance reads the answers too, and is none of those that are waited for.
TEST(Redundancy, ARecordIsHeldForAReaderThatIsNoInstance) {
  SystemUnderTest system(Domain::kRedundantAwaits);
  dds::Participant participant("test", system.network());
  const Collector<msg::ServiceStatus> statuses(participant);
  const Collector<msg::Event> events(participant);
  Arguments source{"--source", "simulation", "--speed", "max"};
  for (const auto& argument : Simulation{.profile = write_ramp_profile(system, 60.0)}.arguments())
    source.push_back(argument);
  for (const char* instance : {"0", "1"}) {
    system.start("compensation",
                 {"--instance", instance, "--redundant", "--await-subscribers", "1"});
  }
  ASSERT_TRUE(eventually([&] {
    return metric(statuses, "compensation", "samples_in") == 0.0 &&
           metric(statuses, "compensation/1", "samples_in") == 0.0;
  })) << "both are there from the first sample on";
  system.start("thermal_publisher", source);
  source.insert(source.end(), {"--rate", "200", "--wait-for", "compensation"});
  ChildProcess& publisher = system.start("gyro_publisher", source);
  ASSERT_TRUE(eventually([&] { return told(events, "subscribers_awaited", ""); }));
  EXPECT_FALSE(told(events, "input_stale", "")) << "a record that is held is not silent";
  const Collector<msg::CompensatedRate> answers(participant);
  EXPECT_EQ(publisher.wait(60s), 0);
  ASSERT_TRUE(eventually([&] { return answers.size() >= 12000; })) << answers.size();
  EXPECT_EQ(answers.all().front().sequence_number(), 0U);
}

// What each instance writes, whoever was first.
class EachInstance {
 public:
  explicit EachInstance(dds::Participant& participant)
      : reader_(participant, [this](const msg::CompensatedRate& answer, const dds::SampleOrigin&) {
          const std::lock_guard lock(mutex_);
          answers_[answer.instance()].push_back({answer.run_id(), answer.sequence_number()});
        }) {}
  // It wrote something, and in the end answers of this publisher.
  [[nodiscard]] std::optional<std::uint64_t> run_of(std::uint32_t instance) const {
    const std::lock_guard lock(mutex_);
    const auto found = answers_.find(instance);
    if (found == answers_.end()) return std::nullopt;
    return found->second.back().run;
  }
  [[nodiscard]] std::set<std::uint64_t> runs() const {
    const std::lock_guard lock(mutex_);
    std::set<std::uint64_t> runs;
    for (const auto& [instance, answers] : answers_) {
      for (const Answer& answer : answers) runs.insert(answer.run);
    }
    return runs;
  }
  void forget() {
    const std::lock_guard lock(mutex_);
    answers_.clear();
  }

 private:
  struct Answer {
    std::uint64_t run;
    std::uint64_t sequence;
  };
  mutable std::mutex mutex_;
  std::map<std::uint32_t, std::vector<Answer>> answers_;
  dds::Reader<msg::CompensatedRate, dds::EveryCopy> reader_;
};

bool is_in_sync(const Collector<msg::ServiceStatus>& statuses, int instance) {
  const char* const name = instance == 0 ? "compensation:1" : "compensation/1:1";
  return metric(statuses, name, "health") == 0.0 && metric(statuses, name, "compared") > 0.0;
}

// Room for two publishers of one id.
struct TwoPublishers {
  explicit TwoPublishers(Domain domain) : system(domain) {}
  SystemUnderTest system;
  dds::Participant first_host{"gyro_publisher", system.network()};
  dds::Participant second_host{"gyro_publisher", system.network()};
  dds::Participant participant{"test", system.network()};
  Collector<msg::ServiceStatus> statuses{participant};
  EachInstance answers{participant};
};

// Rule: of two publishers of one id both instances follow the same one, whichever of the two one
// that begins anew receives first.
TEST(Redundancy, BothInstancesFollowTheSameOfTwoPublishers) {
  TwoPublishers both(Domain::kRedundantPublishers);
  const bench::SyntheticGyro first(both.first_host, {});
  start_instance(both.system, 0);
  ChildProcess* other = &start_instance(both.system, 1);
  ASSERT_TRUE(
      eventually([&] { return is_in_sync(both.statuses, 0) && is_in_sync(both.statuses, 1); }));
  const auto followed = both.answers.run_of(0);
  const bench::SyntheticGyro second(both.second_host, {});
  ASSERT_TRUE(
      eventually([&] { return metric(both.statuses, "compensation/1", "rejected") > 100.0; }));
  for (int round = 0; round < 3; ++round) {
    other->send(SIGKILL);
    other->wait(5s);
    both.answers.forget();
    other = &start_instance(both.system, 1);
    ASSERT_TRUE(eventually([&] { return both.answers.run_of(1) == followed; }));
    ASSERT_TRUE(eventually([&] { return is_in_sync(both.statuses, 1); }));
    EXPECT_EQ(both.answers.runs(), std::set{*followed});
  }
}

// Each may have begun with another one: the junior gives in.
TEST(Redundancy, InstancesThatBeganWithTwoPublishersAgreeOnOne) {
  TwoPublishers both(Domain::kRedundantPublishersTogether);
  const bench::SyntheticGyro first(both.first_host, {});
  const bench::SyntheticGyro second(both.second_host, {});
  start_instance(both.system, 0);
  start_instance(both.system, 1);
  ASSERT_TRUE(
      eventually([&] { return is_in_sync(both.statuses, 0) && is_in_sync(both.statuses, 1); }));
  both.answers.forget();
  ASSERT_TRUE(eventually([&] { return both.answers.run_of(0) && both.answers.run_of(1); }));
  EXPECT_EQ(both.answers.runs().size(), 1U);
}

// Rule: one that is alone is received at once after a restart, whatever the wall clock says,
// although its readers still know the one before.
TEST(Restart, OfALoneOneIsReceivedAtOnce) {
  SystemUnderTest system(Domain::kRestart);
  dds::Participant gyro_host("gyro_publisher", system.network());
  dds::Participant participant("test", system.network());
  Collector<msg::CompensatedRate> answers(participant);
  WallClock wall(system.path("shift"));
  const bench::SyntheticGyro gyro(gyro_host, {});
  const auto start = [&]() -> ChildProcess& {
    return system.start_foreign(
        "compensation", {"--domain", std::to_string(system.network().domain)}, wall.environment());
  };
  ChildProcess* service = &start();
  ASSERT_TRUE(eventually([&] { return answers.size() > 200; }));
  for (const std::chrono::nanoseconds shift :
       {std::chrono::nanoseconds(0), std::chrono::nanoseconds(-24h), std::chrono::nanoseconds(0)}) {
    service->send(SIGKILL);
    service->wait(5s);
    const std::size_t before = answers.size();
    wall.set_ahead(shift);
    service = &start();
    // Discovery takes a fraction of it; readers forget the one before after 20 s.
    EXPECT_TRUE(eventually([&] { return answers.size() > before + 200; }, 10s))
        << std::chrono::duration<double>(shift).count();
  }
  std::set<std::uint64_t> once;
  for (const auto& answer : answers.all())
    EXPECT_TRUE(once.insert(answer.sequence_number()).second) << answer.sequence_number();
}

std::filesystem::path make_checkpoint_folder(const SystemUnderTest& system) {
  const auto folder = system.path("checkpoints");
  std::filesystem::create_directory(folder);
  return folder;
}

Arguments saved_each_second(const std::filesystem::path& folder) {
  return {"--checkpoint-dir", folder.string(), "--checkpoint-period", "1"};
}

// Rule: at most one period of learning is lost, and it says so.
TEST(Resume, ALoneServiceGoesOnFromItsOwnCheckpoint) {
  SystemUnderTest system(Domain::kResume);
  dds::Participant participant("test", system.network());
  Collector<msg::Event> events(participant);
  Collector<msg::CompensatedRate> answers(participant);
  const auto folder = make_checkpoint_folder(system);
  const Arguments arguments = saved_each_second(folder);
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
  // Of a backup that is copied back the file is old or new, whatever is in it.
  std::filesystem::last_write_time(
      file, std::filesystem::file_time_type::clock::now() - std::chrono::hours(24 * 40));
  system.start("compensation", arguments);
  ASSERT_TRUE(eventually([&] { return told(events, "resumed", " s ago, model epoch"); }));
  EXPECT_TRUE(told(events, "resumed", "goes on from"));
  ASSERT_TRUE(eventually([&] { return answers.size() > from; }));
  const std::uint64_t resumed_at = answers.all()[from].model_epoch();
  EXPECT_GT(resumed_at, 0U) << "before the first sample";
  EXPECT_LE(resumed_at, killed_at);
  EXPECT_GT(resumed_at + 16, killed_at);
}

// Before: each wrote over what the other had learned, and after its next start took off the other's
// drift.
TEST(Resume, AFolderThatAnotherServiceSavesTheGyroInIsNotUsed) {
  SystemUnderTest other(Domain::kResume);
  SystemUnderTest system(Domain::kResumeBad);
  dds::Participant participant("test", system.network());
  Collector<msg::Event> events(participant);
  Collector<msg::CompensatedRate> answers(participant);
  const auto folder = make_checkpoint_folder(other);
  const Arguments arguments = saved_each_second(folder);
  other.start("compensation", arguments);
  start_simulation(other);
  const auto file = folder / "1-latest.ckpt";
  ASSERT_TRUE(eventually([&] { return std::filesystem::exists(file); }, 60s));
  system.start("compensation", arguments);
  start_simulation(system);
  EXPECT_TRUE(eventually([&] { return told(events, "checkpoint_taken", folder.string()); }));
  ASSERT_TRUE(eventually([&] { return answers.size() > 100; }));
  EXPECT_FALSE(told(events, "resumed"));
}

TEST(Resume, ACheckpointThatCannotBeUsedIsToldOfAndLearningBeginsAnew) {
  SystemUnderTest system(Domain::kResumeBad);
  dds::Participant participant("test", system.network());
  Collector<msg::Event> events(participant);
  Collector<msg::CompensatedRate> answers(participant);
  const auto folder = make_checkpoint_folder(system);
  write(folder / "1-latest.ckpt", "no checkpoint");
  system.start("compensation", {"--checkpoint-dir", folder.string()});
  start_simulation(system);
  ASSERT_TRUE(eventually([&] { return answers.size() > 100; }));
  EXPECT_TRUE(eventually([&] { return told(events, "cannot_resume", "1-latest.ckpt"); }));
}

// Before: the first save wrote over what another configuration had learned for weeks.
TEST(Resume, ACheckpointThatIsRefusedIsKeptAndServesItsOwnConfiguration) {
  SystemUnderTest system(Domain::kResumeBad);
  dds::Participant participant("test", system.network());
  Collector<msg::Event> events(participant);
  const auto folder = make_checkpoint_folder(system);
  write(system.path("svr.yaml"), "scheme: online-svr\n");
  const Arguments saving = saved_each_second(folder);
  const auto latest = folder / "1-latest.ckpt";
  const auto learn = [&](const Arguments& arguments) {
    const std::string before = std::filesystem::exists(latest) ? content(latest) : "";
    ChildProcess& service = system.start("compensation", arguments);
    ASSERT_TRUE(eventually(
        [&] { return std::filesystem::exists(latest) && content(latest) != before; }, 60s));
    service.send(SIGTERM);
    EXPECT_EQ(service.wait(5s), 0);
  };
  start_simulation(system);
  learn(saving);
  const std::string learned = content(latest);
  learn(saving + Arguments{"--config", system.path("svr.yaml")});
  EXPECT_TRUE(told(events, "cannot_resume", "; kept: zerodrift ctl restore refused"));
  EXPECT_EQ(content(folder / "1-refused.ckpt"), learned);
  learn(saving);
  EXPECT_EQ(content(folder / "1-refused.ckpt"), learned) << "the other one has another name";
  EXPECT_TRUE(std::filesystem::exists(folder / "1-refused-2.ckpt"));
  system.start("compensation", saving);
  ASSERT_TRUE(eventually([&] { return told(events, "resumed", ""); }));
  EXPECT_TRUE(eventually([&] { return system.control({"restore", "refused"}).exit_code == 0; }));
}

}  // namespace
}  // namespace zerodrift::system_test
