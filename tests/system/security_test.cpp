// SPDX-License-Identifier: Apache-2.0
// --security: what has no certificate, another authority's, or no permission gets nothing in and
// nothing out, and is told as an event.
#include <gtest/gtest.h>
#include <sched.h>

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <filesystem>
#include <mutex>
#include <string>

#include "tests/system/files.h"
#include "tests/system/pipeline.h"
#include "tests/system/raw_datagrams.h"
#include "tests/system/secured_system.h"

namespace zerodrift::system_test {
namespace {

using namespace std::chrono_literals;

// Sequence numbers and requests of intruders, which no genuine sample has.
constexpr std::uint64_t kForged = 1000000;

std::filesystem::path certificates(SystemUnderTest& system, const std::string& name = "security") {
  const Finished made = make_certificates(system, {system.path(name)});
  EXPECT_EQ(made.exit_code, 0) << made.err;
  return system.path(name);
}

// Everything that somebody who is not to be there could try.
class Intruder {
 public:
  Intruder(const std::string& name, const dds::NetworkOptions& network)
      : participant_(name, network),
        rates_(participant_),
        commands_(participant_),
        answers_(participant_),
        statuses_(participant_) {}

  void try_everything() {
    msg::AngularRate rate;
    rate.gyro_id(SecuredSystem::kGyroId);
    rate.sequence_number(kForged + ++tries_);
    rates_.write(rate);
    msg::Command command;
    command.service("compensation");
    command.name("freeze");
    command.request_id(kForged + tries_);
    commands_.write(command);
  }
  [[nodiscard]] int matched() const {
    return rates_.matched() + commands_.matched() + answers_.matched() + statuses_.matched();
  }
  [[nodiscard]] std::size_t heard() const { return answers_.size() + statuses_.size(); }

 private:
  dds::Participant participant_;
  dds::Writer<msg::AngularRate> rates_;
  dds::Writer<msg::Command> commands_;
  Collector<msg::CompensatedRate> answers_;
  Collector<msg::ServiceStatus> statuses_;
  std::uint64_t tries_ = 0;
};

// Rule: 0 samples either way, while the genuine stream goes on unharmed.
void expect_nothing_passes(SecuredSystem& run, Intruder& intruder, std::chrono::milliseconds span) {
  const auto end = std::chrono::steady_clock::now() + span;
  while (std::chrono::steady_clock::now() < end) {
    run.send();
    intruder.try_everything();
    std::this_thread::sleep_for(10ms);
  }
  EXPECT_EQ(intruder.matched(), 0);
  EXPECT_EQ(intruder.heard(), 0U);
  EXPECT_EQ(run.replies.size(), 0U) << "an intruder's command was answered";
  run.expect_one_answer_each();
}

TEST(Security, TheWholeChainWorksAndNothingOfItIsReadableOnTheWire) {
  SystemUnderTest system(Domain::kSecuredChain);
  LoopbackCapture capture(system.network().domain);
  // The name of a metric, in every status of the service.
  const std::string kReadable = "samples_out";
  {
    dds::Participant participant("test", system.network());
    Collector<msg::ServiceStatus> statuses(participant);
    ChildProcess& plain = system.start("compensation", {});
    ASSERT_TRUE(eventually([&] { return statuses.size() > 2; }));
    plain.send(SIGTERM);
    EXPECT_EQ(plain.wait(2s), 0);
  }
  const bool seen_in_the_clear = capture.contains(kReadable);
  const std::size_t before = capture.all().size();

  const auto folder = certificates(system);
  const Arguments security{"--security", folder};
  Arguments source = Arguments{"--source", "simulation", "--speed", "20"} + security +
                     Simulation{.profile = write_ramp_profile(system, 100000)}.arguments();
  dds::Participant participant("console", with_security(system, folder));
  Collector<msg::CompensatedRate> answers(participant);
  Collector<msg::AllanReport> reports(participant);
  Collector<msg::Event> events(participant);
  Collector<msg::ServiceStatus> statuses(participant);
  std::vector<ChildProcess*> services{
      // This test, the monitor and the recorder receive answers from the first one on.
      &system.start("compensation", security + Arguments{"--await-subscribers", "3"}),
      &system.start("allan_monitor", security), &system.start("thermal_publisher", source),
      &system.start("gyro_publisher", source + Arguments{"--rate", "50", "--wait-for",
                                                         "compensation,allan_monitor,recorder"})};
  const auto recording = system.path("secured.mcap");
  ChildProcess& recorder = system.start(
      "zerodrift", Arguments{"record", "--out", recording, "--samples", "1000"} + security);
  ASSERT_TRUE(eventually([&] { return answers.size() > 2000; })) << answers.size() << " answers\n"
                                                                 << newest_of_each(statuses);
  ASSERT_TRUE(eventually([&] { return reports.size() > 0; }));
  ASSERT_TRUE(eventually([&] { return metric(statuses, "compensation", kReadable) > 0; }));

  const Finished freeze = system.control(Arguments{"freeze"} + security);
  EXPECT_EQ(freeze.exit_code, 0) << freeze.err;
  EXPECT_TRUE(eventually([&] { return told(events, "command_freeze", "freeze"); }));
  const Finished status = system.control(Arguments{"status"} + security);
  EXPECT_EQ(status.exit_code, 0) << status.err;
  EXPECT_EQ(recorder.wait(5s), 0) << recorder.err();
  Collector<msg::CompensatedRate> in_its_place(participant);  // gyro 2's answers await three, too
  const Arguments here = Arguments{"--domain", std::to_string(system.network().domain)} + security;
  const Finished replayed =
      system.run("zerodrift",
                 Arguments{"replay", recording, "--speed", "max", "--as-gyro-id", "2"} + here, 60s);
  EXPECT_EQ(replayed.exit_code, 0) << replayed.err;
  const Finished outside = system.control({"status", "--wait", "2"});
  EXPECT_EQ(outside.exit_code, 1) << "without a certificate: " << outside.out;
  for (ChildProcess* service : services) service->send(SIGTERM);
  for (ChildProcess* service : services) EXPECT_EQ(service->wait(2s), 0) << service->name();

  if (!capture.works()) GTEST_SKIP() << "this user may not capture: secrecy was not looked at";
  EXPECT_TRUE(seen_in_the_clear) << "the search proves nothing";
  const auto all = capture.all();
  ASSERT_GT(all.size(), before + 2000);
  for (std::size_t k = before; k < all.size(); ++k) {
    const Bytes& bytes = all[k].bytes;
    ASSERT_EQ(std::search(bytes.begin(), bytes.end(), kReadable.begin(), kReadable.end()),
              bytes.end());
  }
}

// Before: an unsecured publisher among secured services was "running" and healthy, and `ctl`
// without its folder said that there is no compensation service.
void expect_told_that_others_have_certificates(SystemUnderTest& system) {
  dds::Participant participant("test", system.network());
  Collector<msg::Event> events(participant);
  system.start("thermal_publisher", {"--source", "ros2:/imu/temperature"});
  EXPECT_TRUE(eventually([&] {
    return told(events, "certificate_missing",
                " takes part with certificates only, and this process has none: expected "
                "--security with its folder of keys and certificates");
  }));
  const auto is_unhealthy = [&](const std::string& program, const Arguments& source) {
    const std::string file = system.path(program + ".health").string();
    system.start(program, source + Arguments{"--health-file", file});
    return eventually([&] {
      const Finished asked = system.run("zerodrift", {"health", "--file", file});
      return asked.exit_code == 1 &&
             asked.err.find("others take part with certificates only (--security)") !=
                 std::string::npos;
    });
  };
  EXPECT_TRUE(is_unhealthy(
      "gyro_publisher", Arguments{"--source", "simulation", "--free-running"} +
                            Simulation{.profile = write_ramp_profile(system, 3600)}.arguments()));
  EXPECT_TRUE(is_unhealthy("allan_monitor", {}));
  for (const std::string command : {"status", "freeze"}) {
    SCOPED_TRACE(command);
    Finished asked;
    EXPECT_TRUE(eventually([&] {
      asked = system.control({command, "--wait", "1s"});
      return asked.err.find("ctl " + command + ": participant '") != std::string::npos;
    })) << asked.err;
    EXPECT_EQ(asked.exit_code, 1);
    EXPECT_NE(asked.err.find("and this process has none: expected --security"), std::string::npos)
        << asked.err;
  }
}

TEST(Security, AParticipantWithoutACertificateGetsNothingInAndNothingOutAndSaysWhy) {
  SystemUnderTest system(Domain::kSecurityPlain);
  SecuredSystem run(system, certificates(system));
  run.connect();
  Intruder intruder("passer-by", system.network());
  expect_nothing_passes(run, intruder, 3s);
  run.expect_event("participant_refused", "'passer-by'");
  expect_told_that_others_have_certificates(system);
  EXPECT_FALSE(told(run.events, "certificate_missing")) << "who has one lacks none";
  run.expect_alive_then_stop();
}

TEST(Security, ACertificateOfAnotherAuthorityOfTheSameNameCountsForNothing) {
  SystemUnderTest system(Domain::kSecurityForeign);
  SecuredSystem run(system, certificates(system));
  run.connect();
  // One that would be allowed to write rates, and one for commands, as each can only try its own.
  const auto foreign = with_security(system, certificates(system, "foreign"));
  dds::Participant gyro("gyro_publisher", foreign);
  dds::Writer<msg::AngularRate> rates(gyro);
  dds::Participant console("console", foreign);
  dds::Writer<msg::Command> commands(console);
  Collector<msg::CompensatedRate> answers(console);
  for (std::uint64_t k = 1; k <= 600; ++k) {  // 6 s: longer than a participant may take
    run.send();
    msg::AngularRate rate;
    rate.gyro_id(SecuredSystem::kGyroId);
    rate.sequence_number(kForged + k);
    rates.write(rate);
    msg::Command command;
    command.service("compensation");
    command.name("freeze");
    command.request_id(kForged + k);
    commands.write(command);
    std::this_thread::sleep_for(10ms);
  }
  EXPECT_EQ(rates.matched(), 0);
  EXPECT_EQ(commands.matched(), 0);
  EXPECT_EQ(answers.size(), 0U);
  EXPECT_EQ(run.replies.size(), 0U);
  run.expect_one_answer_each();
  run.expect_event("participant_refused");
  run.expect_alive_then_stop();
}

// Before: what a late comer was sent, and what was repaired for one that had stood still, filled
// datagrams, and Fast DDS 2.9.1 ended the writer's process by an assertion.
TEST(Security, NeitherWhoComesLateNorWhoStoodStillEndsAWriter) {
  SystemUnderTest system(Domain::kSecurityFullDatagrams);
  const auto network = with_security(system, certificates(system));
  {
    dds::Participant thermometer("thermal_publisher", network);
    dds::Writer<msg::Environment> writer(thermometer);
    constexpr std::uint64_t kKept = 2000;
    for (std::uint64_t k = 0; k < kKept; ++k) {
      msg::Environment message;
      message.gyro_id(1);
      message.sequence_number(k);
      ASSERT_TRUE(writer.write(message));
    }
    dds::Participant late("recorder", network);
    const Collector<msg::Environment> received(late);
    EXPECT_TRUE(eventually([&] { return received.size() == kKept; })) << received.size();
  }
  dds::Participant gyro("gyro_publisher", network);
  dds::Participant service("compensation", network);
  std::mutex stands_still;
  std::atomic<std::uint64_t> newest{0};
  dds::Writer<msg::AngularRate> writer(gyro);
  dds::Reader<msg::AngularRate> reader(
      service, [&](const msg::AngularRate& message, const dds::SampleOrigin&) {
        const std::lock_guard lock(stands_still);
        newest = message.sequence_number();
      });
  ASSERT_TRUE(eventually([&] { return writer.matched() > 0; }));
  std::uint64_t sequence = 0;
  const auto send = [&] {
    msg::AngularRate message;
    message.gyro_id(1);
    message.sequence_number(++sequence);
    EXPECT_TRUE(writer.write(message));
  };
  ASSERT_TRUE(eventually([&] {
    send();
    return newest > 0;
  }));
  {
    const std::lock_guard lock(stands_still);
    while (sequence < 8000) send();  // more than its socket takes
  }
  EXPECT_TRUE(writer.wait_until_received(60s));
  EXPECT_TRUE(eventually([&] { return newest == sequence; })) << newest;
}

// How many of this process's threads have that scheduling policy.
std::ptrdiff_t threads_of(int policy) {
  return std::count_if(std::filesystem::directory_iterator("/proc/self/task"),
                       std::filesystem::directory_iterator(),
                       [&](const std::filesystem::directory_entry& thread) {
                         return sched_getscheduler(std::stoi(thread.path().filename())) == policy;
                       });
}

// Before: the thread that sends a secured writer's samples took the core of whoever held the
// writer's lock, and tried for that lock until its time slice was over (p99 of a hop 4.4 ms instead
// of .3 on a machine at rest).
TEST(Security, WhoSendsSamplesPreemptsNobody) {
  SystemUnderTest system(Domain::kSecuritySender);
  const auto network = with_security(system, certificates(system));
  dds::Participant gyro("gyro_publisher", network);
  EXPECT_EQ(threads_of(SCHED_BATCH), 0);
  const dds::Writer<msg::AngularRate> rates(gyro);
  const dds::Writer<msg::Event> events(gyro);
  EXPECT_EQ(threads_of(SCHED_BATCH), 1);
  EXPECT_EQ(sched_getscheduler(0), SCHED_OTHER);
}

// Before: the first answers, which were written while keys were exchanged, reached nobody, unless
// the service was told how many subscribers there are.
TEST(Security, OfAReplayTheFirstAnswerReachesWhoeverIsThere) {
  SystemUnderTest system(Domain::kSecurityReplay);
  const Arguments security{"--security", certificates(system)};
  const auto record = system.path("record.csv");
  simulate(system, {.profile = write_ramp_profile(system, 10)}, record);
  dds::Participant participant("console", with_security(system, system.path("security")));
  const Collector<msg::CompensatedRate> answers(participant);
  const auto csv = system.path("answers.csv");
  ChildProcess& recorder =
      system.start("zerodrift", Arguments{"record", "--out", csv, "--samples", "2000"} + security);
  ChildProcess& service = system.start("compensation", security);
  const Finished replayed = system.run("zerodrift",
                                       Arguments{"replay", record, "--speed", "max", "--domain",
                                                 std::to_string(system.network().domain)} +
                                           security,
                                       60s);
  EXPECT_EQ(replayed.exit_code, 0) << replayed.err;
  EXPECT_TRUE(eventually([&] { return answers.size() == 2000; }, 20s)) << answers.size();
  EXPECT_EQ(recorder.wait(20s), 0) << recorder.err();
  service.send(SIGTERM);
  EXPECT_EQ(service.wait(2s), 0);
}

std::string refusal_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const dds::DdsError& error) {
    return error.what();
  }
  return "no error";
}

TEST(Security, AServiceCannotWriteOrReadWhatItsPermissionsDoNotName) {
  SystemUnderTest system(Domain::kSecurityReadOnly);
  const auto folder = certificates(system);
  dds::Participant monitor("allan_monitor", with_security(system, folder));
  for (const auto& [topic, action] : std::vector<std::pair<std::string, std::function<void()>>>{
           {"compensated_rate", [&] { dds::Writer<msg::CompensatedRate> writer(monitor); }},
           {"angular_rate", [&] { dds::Writer<msg::AngularRate> writer(monitor); }},
           {"command", [&] { dds::Writer<msg::Command> writer(monitor); }},
           {"checkpoint", [&] { Collector<msg::CheckpointPart> reader(monitor); }}}) {
    const std::string refusal = refusal_of(action);
    EXPECT_NE(refusal.find("topic '" + topic + "'"), std::string::npos) << refusal;
    EXPECT_NE(refusal.find("not found in allow rule"), std::string::npos) << refusal;
  }
}

// The permissions are checked by who listens too: a service that grants itself more, under an
// authority of its own, is refused although its certificate is genuine.
TEST(Security, AServiceThatGrantsItselfMoreIsRefused) {
  SystemUnderTest system(Domain::kSecurityLiar);
  const auto folder = certificates(system);
  const auto foreign = certificates(system, "foreign");
  SecuredSystem run(system, folder);
  run.connect();

  const auto liar = system.path("liar");
  std::filesystem::copy(foreign, liar, std::filesystem::copy_options::recursive);
  std::filesystem::copy_file(folder / "identity_ca.pem", liar / "identity_ca.pem",
                             std::filesystem::copy_options::overwrite_existing);
  for (const char* file : {"certificate.pem", "key.pem"}) {
    std::filesystem::copy_file(folder / "allan_monitor" / file, liar / "allan_monitor" / file,
                               std::filesystem::copy_options::overwrite_existing);
  }
  const std::string sign =
      "cd " + liar.string() +
      " && openssl smime -verify -noverify -text -in allan_monitor/permissions.p7s 2>/dev/null"
      " | sed 's/allan_report/angular_rate/' > own.xml"
      " && openssl smime -sign -text -in own.xml -out allan_monitor/permissions.p7s"
      " -signer permissions_ca.pem -inkey ca/permissions_ca.key";
  ASSERT_EQ(std::system(sign.c_str()), 0);

  dds::Participant monitor("allan_monitor", with_security(system, liar));
  dds::Writer<msg::AngularRate> rates(monitor);  // its own library lets it
  for (std::uint64_t k = 1; k <= 300; ++k) {
    run.send();
    msg::AngularRate rate;
    rate.gyro_id(SecuredSystem::kGyroId);
    rate.sequence_number(kForged + k);
    rates.write(rate);
    std::this_thread::sleep_for(10ms);
  }
  EXPECT_EQ(rates.matched(), 0);
  run.expect_one_answer_each();
  run.expect_event("security_warning");
  run.expect_alive_then_stop();
}

void expect_one_line(const Finished& end, const std::string& part) {
  EXPECT_EQ(end.exit_code, 2) << end.out << end.err;
  EXPECT_EQ(std::count(end.err.begin(), end.err.end(), '\n'), 1) << end.err;
  EXPECT_NE(end.err.find(part), std::string::npos) << "'" << part << "' is not in: " << end.err;
}

TEST(Security, EachBadFolderEndsWithCodeTwoAndOneLineThatNamesWhatIsWrong) {
  SystemUnderTest system(Domain::kSecurityAbuse);
  const auto good = certificates(system);
  const std::string domain = std::to_string(system.network().domain);
  int number = 0;
  const auto refused = [&](const std::function<void(const std::filesystem::path&)>& harm,
                           const std::string& part) {
    SCOPED_TRACE(part);
    const auto folder = system.path("bad" + std::to_string(++number));
    std::filesystem::copy(good, folder, std::filesystem::copy_options::recursive);
    harm(folder);
    expect_one_line(system.run("compensation", {"--domain", domain, "--security", folder}, 10s),
                    part);
  };
  const auto replace = [&](const std::string& file, const std::string& by) {
    return [&good, file, by](const std::filesystem::path& folder) {
      std::filesystem::copy_file(good / by, folder / file,
                                 std::filesystem::copy_options::overwrite_existing);
    };
  };
  const auto remove = [](const std::string& file) {
    return
        [file](const std::filesystem::path& folder) { std::filesystem::remove_all(folder / file); };
  };
  for (const char* file :
       {"identity_ca.pem", "permissions_ca.pem", "governance.p7s", "compensation/key.pem",
        "compensation/certificate.pem", "compensation/permissions.p7s"}) {
    refused(remove(file), std::string(file) + " is missing");
  }
  refused(remove("compensation"), "holds nothing for 'compensation'");
  refused(replace("compensation/certificate.pem", "console/certificate.pem"),
          "is the certificate of 'console'");
  refused(replace("compensation/key.pem", "console/key.pem"), "does not belong to");
  refused(replace("compensation/permissions.p7s", "console/permissions.p7s"),
          "holds the permissions of 'CN=console,O=zerodrift'");
  refused(replace("identity_ca.pem", "permissions_ca.pem"), "is not signed by");
  refused(replace("permissions_ca.pem", "identity_ca.pem"), "governance.p7s is not signed by");
  refused(
      [](const auto& folder) {
        std::filesystem::permissions(folder / "compensation/key.pem",
                                     std::filesystem::perms::group_read,
                                     std::filesystem::perm_options::add);
      },
      "(mode 640); expected 600");
  refused([](const auto& folder) { write(folder / "compensation/certificate.pem", "nonsense"); },
          "is not a certificate");
  refused([](const auto& folder) { write(folder / "governance.p7s", "nonsense"); },
          "is not a signed document");
  const auto elsewhere = system.path("elsewhere");
  ASSERT_EQ(make_certificates(system, {"--domains", "1-1", elsewhere}).exit_code, 0);
  expect_one_line(system.run("compensation", {"--domain", domain, "--security", elsewhere}, 10s),
                  "governance.p7s is for domains 1 to 1, found domain " + domain);
  const auto none = system.path("none");
  expect_one_line(system.run("compensation", {"--domain", domain, "--security", none}, 10s),
                  none.string() + " is not a folder");
  expect_one_line(
      system.run("zerodrift", {"ctl", "status", "--domain", domain, "--security", none}, 10s),
      "is not a folder");
}

TEST(Security, TheScriptRefusesWhatIsWrongInOneLineAndRenewsOneCertificate) {
  SystemUnderTest system(Domain::kSecurityAbuse);
  const auto folder = certificates(system);
  const auto key = content(folder / "compensation/key.pem");
  const auto other_key = content(folder / "console/key.pem");
  expect_one_line(make_certificates(system, {folder}), "exists");
  EXPECT_EQ(content(folder / "compensation/key.pem"), key);
  expect_one_line(make_certificates(system, {}), "no folder given");
  expect_one_line(make_certificates(system, {"--days", "0", system.path("x")}), "--days");
  expect_one_line(make_certificates(system, {"--days"}), "--days needs a value");
  expect_one_line(make_certificates(system, {"--days", "4000", system.path("x")}), "--ca-days");
  expect_one_line(make_certificates(system, {"--days", "4000", "--only", "compensation", folder}),
                  "ends before that");
  expect_one_line(make_certificates(system, {"--domains", "9-300", system.path("x")}), "--domains");
  expect_one_line(make_certificates(system, {"--only", "nobody", folder}), "no service 'nobody'");
  expect_one_line(make_certificates(system, {"--what", folder}), "--what");
  expect_one_line(make_certificates(system, {system.path("no/such/parent")}), "cannot write");
  EXPECT_FALSE(std::filesystem::exists(system.path("x")));

  const Finished renewed = make_certificates(system, {"--only", "compensation", folder});
  EXPECT_EQ(renewed.exit_code, 0) << renewed.err;
  EXPECT_NE(content(folder / "compensation/key.pem"), key);
  EXPECT_EQ(content(folder / "console/key.pem"), other_key);
  std::filesystem::remove_all(folder / "ca");
  expect_one_line(make_certificates(system, {"--only", "compensation", folder}), "is missing");
}

}  // namespace
}  // namespace zerodrift::system_test
